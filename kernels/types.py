"""Structs that host and device share.

World (one chain instance) is always axis 0. W: number of worlds; n: links of a world (``link_count``); N: greatest n.
"""

from typing import Any

import warp as wp

Rows: Any = wp.array2d(dtype=wp.float64)
"""One row for each quantity, one column for each link or joint, see :mod:`layout`."""
Row: Any = wp.array(dtype=wp.float64)
"""One number after the other."""
Integers: Any = wp.array(dtype=wp.int32)
"""Likewise, of integers: a neighbour list, or the counters of a block."""

LOADING_TIME = wp.constant(wp.float64(0.25))
"""Time [s] in which multiplied loads fall to the loop's own."""


@wp.struct
class Chain:
    """One world's constants; in a kernel also under its present loads and with its present softness.

    The host fills a field from the parameter of its name, or as ``World.set_chain`` of the engine says, or else with 0.
    """

    link_count: wp.int32  # n
    half_length: wp.float64  # a [m], half of the distance between a link's joints
    inverse_square: wp.float64  # 1/a² [1/m²]
    mass: wp.float64  # of all links [kg]
    joint_stiffness: wp.float64  # k [N/m]
    joint_damping: wp.float64  # b [N s/m]
    inverse_smoothing: wp.float64  # 1/ω_c [s/rad]
    gravity: wp.float64  # g [m/s²], along −y
    circle_radius: wp.float64  # r [m], the greatest of the links' circles; of one link's, see with_circles
    half_width: wp.float64  # h [m], of a link, across the plane of the chain
    tangential_restitution: wp.float64  # e_t
    floor_restitution: wp.float64  # e_fc
    floor_friction: wp.float64  # μ_fc
    chain_restitution: wp.float64  # e_cc
    chain_friction: wp.float64  # μ_cc
    sprocket_restitution: wp.float64  # e_sc
    sprocket_friction: wp.float64  # μ_sc
    sprocket_radius: wp.float64  # [m], the radius that link circles touch; centre at the origin
    push_rate: wp.float64  # speed at which floor and links push out sunken circles, per depth [1/s]
    # the plane that the links move in, if it tilts, see physics.plane: otherwise 0
    plane_speed: wp.float64
    turn_x: wp.float64
    turn_y: wp.float64
    up_x: wp.float64
    up_y: wp.float64
    up_z: wp.float64
    origin_height: wp.float64


@wp.func
def with_circles(chain: Chain, radius: wp.float64) -> Chain:
    """The chain as one of its links has it, whose two circles have this radius [m]."""
    own = chain
    own.circle_radius = radius
    return own


CHAIN_DOUBLES: int = Chain.numpy_dtype()["itemsize"] // 8  # type: ignore[attr-defined]
"""Size of a world's constants, in doubles."""


@wp.struct
class Model:
    """What no run changes."""

    chains: wp.array(dtype=Chain)  # (W,)
    links: wp.array3d(dtype=wp.float64)  # (W, LINK_ROWS, N): what each link and joint has of its own, see layout
    # the floor, if it is not flat, see contacts.terrain
    faces: wp.array3d(dtype=wp.float64)  # (W, faces, FACE_VALUES)
    cells: wp.array3d(dtype=wp.float64)  # (W, GROUND_CELLS + 1, CELL_VALUES)


@wp.struct
class Drive:
    """What the sprocket does and when a hold ends. Every array has shape (W,)."""

    sprocket_speed: wp.array(dtype=wp.float64)  # final angular velocity Ω [rad/s], counter-clockwise positive
    spin_up_start: wp.array(dtype=wp.float64)  # [s]
    spin_up_time: wp.array(dtype=wp.float64)  # [s]; 0: at full speed from the start
    hold_start: wp.array(dtype=wp.float64)  # from then on the loop is watched until it is stationary [s]
    loop_speed: wp.array(dtype=wp.float64)  # speed of the sprocket's surface, along the loop [m/s]
    loop_period: wp.array(dtype=wp.float64)  # [s]
    load_factor: wp.array(dtype=wp.float64)  # of the hold's first part, see physics.scaled_loads
    steady_window: wp.array(dtype=wp.float64)  # over which means are taken in the hold's second part [s]
    steady_time: wp.array(dtype=wp.float64)  # for which its shape must then stay [s]; negative: see events.release
    steady_tolerance: wp.array(dtype=wp.float64)  # greatest relative change of the shape of a stationary loop
    extra_hold: wp.array(dtype=wp.float64)  # how long a stationary loop is held further [s]
    release_phase: wp.array(dtype=wp.float64)  # and after that, in loop periods
    hold_softness: wp.array(dtype=wp.float64)  # of the joints from the hold to the release, 1 to 2; 0: own values
    loaded_softness: wp.array(dtype=wp.float64)  # of the joints under load
    push_rate: wp.array(dtype=wp.float64)  # speed at which the sprocket pushes out sunken circles, per depth [1/s]
    motion: wp.array3d(dtype=wp.float64)  # (W, MOTION_ROWS, MOTION_VALUES): of the sprocket above a floor
    farthest: wp.array(dtype=wp.float64)  # |x| of the centre of mass at which a walk ends [m]; 0: at none


@wp.struct
class Record:
    """Time series, which the host drains between launches. A full one ends the launch; nothing is dropped."""

    sample_count: wp.array(dtype=wp.int32)  # (W,)
    frame_count: wp.array(dtype=wp.int32)  # (W,)
    samples: wp.array3d(dtype=wp.float64)  # (W, capacity, *columns*, see layout); capacity 0: not recorded
    frames: wp.array3d(dtype=wp.float64)  # (W, capacity, 2 N): joint x …, joint y …; then the plane, if it tilts; or 0
    frame_times: wp.array2d(dtype=wp.float64)  # (W, capacity) [s]
    frame_loads: wp.array3d(dtype=wp.float64)  # (W, capacity, 3 N): joint forces x …, y …, moments …; see record


@wp.struct
class Control:
    """Numerical settings of a launch, the same for all its worlds."""

    tolerance: wp.float64  # of a step's error, absolute and relative
    soft_tolerance: wp.float64  # while joints are soft or softer
    flight_tolerance: wp.float64  # on rigid joints
    proportional: wp.int32  # 1: proportional-integral controller, 0: odeint's standard one
    contact_step: wp.float64  # longest step near a contact [s]
    skin: wp.float64  # margin of the neighbour list [m]
    smallest_step: wp.float64  # [s]
    step_limit: wp.int64  # attempts in all
    attempts: wp.int32  # attempts in this launch
    launch_time: wp.float64  # after which a block stops at its next sample [s]
    sample_interval: wp.float64  # [s]
    frame_every: wp.int64  # samples per frame
    frame_interval: wp.float64  # between frame marks, for chains that have them [s]
    rest_speed: wp.float64  # [m/s]
    rest_time: wp.float64  # [s]
    soft_stiffness: wp.float64  # k of soft joints [N/m]
    soft_damping: wp.float64  # b [N s/m]
    soft_smoothing: wp.float64  # ω_c [rad/s]
    softest_stiffness: wp.float64  # k of the softest joints, whose ω_c is that of soft ones
    softest_damping: wp.float64  # b of the softest joints [N s/m]
    soft_mass: wp.float64  # mean mass of links [kg] that these k and b are for
    soft_contact_step: wp.float64  # contact_step of the softest joints, in the drive also of soft ones [s]
    pile_push: wp.float64  # push_rate of a chain with soft or softer joints [1/s]
    soften_area: wp.float64  # joints soften when the area falls below this fraction of the first
    stiffening_time: wp.float64  # in which joints return to their own values after the release [s]


@wp.struct
class Ground:
    """The floor of one world, if it is not flat, see :mod:`contacts.terrain`."""

    faces: wp.array2d(dtype=wp.float64)
    cells: wp.array2d(dtype=wp.float64)


@wp.func
def read_ground(model: Model, world: int) -> Ground:
    """The floor of one world."""
    return Ground(model.faces[world], model.cells[world])


@wp.struct
class Worlds:
    """All worlds of a batch: what step kernels hand to events and hooks, with ``world``, the index of one of them.

    Functions of physics take only what they need. The rows K of a chain's links are always an argument of their own,
    of static shape, because clang does not vectorise loops over an array that it reads from a struct. Kernels hand
    this struct on as they get it: a copy that also held the index took all registers of a GPU's threads.

    Behind the structs of what surrounds the worlds lies their state, which changes during a run. Its arrays have the
    shape (W,) unless given. A run is bit-identical however it is cut into launches: all that the step loop needs for
    the next attempt is kept here and in the chain's scratch, which belongs to its world until the run ends.
    """

    model: Model
    drive: Drive
    record: Record
    control: Control
    scratch: wp.array3d(dtype=wp.float64)  # (W, rows, columns), see layout
    lists: wp.array2d(dtype=wp.int32)  # (W, size), see contacts.list_layout

    links: wp.array3d(dtype=wp.float64)  # (W, 6, N): x, y [m], θ [rad], and their rates
    time: wp.array(dtype=wp.float64)  # [s]
    stop_time: wp.array(dtype=wp.float64)  # the run ends at exactly this time [s]
    stop_status: wp.array(dtype=wp.int32)  # status of a run that ends there
    is_fresh: wp.array(dtype=wp.int32)  # 1: the host has set the links, and the scratch is void
    # 1: the scratch holds the first stage of the next step; on a CPU 2: and its rounded state, see :mod:`cpu.joints`
    has_first_stage: wp.array(dtype=wp.int32)
    gap: wp.array(dtype=wp.float64)  # CPU: least distance to floor or sprocket [m]
    time_to_contact: wp.array(dtype=wp.float64)  # GPU: longest step that cannot miss a contact [s]
    slack: wp.array(dtype=wp.float64)  # CPU: how far joints may move before the neighbour list is stale [m]
    step: wp.array(dtype=wp.float64)  # proposed next step [s]
    last_error: wp.array(dtype=wp.float64)  # error ratio of the last accepted step (PI controller)
    is_rigid: wp.array(dtype=wp.int32)  # 1: joints are rigid, see cpu.implicit.flights
    other_step: wp.array(dtype=wp.float64)  # last step proposed for the other model of the joints [s]
    closing_time: wp.array(dtype=wp.float64)  # earliest time at which joints may close [s]
    next_sample: wp.array(dtype=wp.int64)  # index of the next sample mark
    next_frame: wp.array(dtype=wp.int64)  # index of the next frame mark; −1: frames are taken with samples
    status: wp.array(dtype=wp.int32)
    watch: wp.array2d(dtype=wp.float64)  # (W, WATCH_ROWS): memory of the watches
    plane: wp.array2d(dtype=wp.float64)  # (W, PLANE_ROWS): the plane of the chain, if it tilts, see layout
    softness: wp.array(dtype=wp.float64)  # of the joints: 0 the model's own, 1 soft, 2 softest; see events.softening
    load_factor: wp.array(dtype=wp.float64)  # of loads on the sprocket, see physics.scaled_loads
    first_area: wp.array(dtype=wp.float64)  # area inside the loop when its run began [m²]
    attempts_before: wp.array(dtype=wp.int64)  # attempts of the walk's earlier phases, which its limit includes
    first_sample: wp.array2d(dtype=wp.float64)  # (W, ALL_COLUMNS): the sample taken when the run began
    last_sample: wp.array2d(dtype=wp.float64)  # the latest, in the end that of the final state
    counts: wp.array2d(dtype=wp.int64)  # (W, COUNT_ROWS)
    extremes: wp.array2d(dtype=wp.float64)  # (W, EXTREME_ROWS) [m]
    losses: wp.array2d(dtype=wp.float64)  # (W, LOSS_ROWS) [J]


STATE: tuple[str, ...] = tuple(Worlds.vars)[6:]  # type: ignore[attr-defined]
"""Names of the arrays of the worlds' state."""


def make_entry(module: wp.Module, is_block: bool):
    """Kernel without a body: name, arguments, threads of a step kernel; ``is_block``: for ``wp.launch_tiled``."""

    def advance(launched: Integers, worlds: Worlds):
        _place, _ = wp.tid()

    def advance_block(launched: Integers, worlds: Worlds):
        _block, _lane = wp.tid()

    function = advance_block if is_block else advance
    return wp.kernel(function, name="advance", module=module, enable_backward=False, grid_stride=False)
