"""Structs that cross the border between host and device.

World (one chain instance) is always axis 0; W worlds, n links (the world's own, ``link_count``), N the longest.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class Model:
    """What a chain is made of: constant during a run. Every array has shape (W,)."""

    link_count: wp.array(dtype=wp.int32)  # n
    link_length: wp.array(dtype=wp.float64)  # ℓ [m], joint to joint
    inner_mass: wp.array(dtype=wp.float64)  # [kg], links 0, 2, 4, …
    outer_mass: wp.array(dtype=wp.float64)  # [kg], links 1, 3, 5, …
    inner_inertia: wp.array(dtype=wp.float64)  # [kg m²]
    outer_inertia: wp.array(dtype=wp.float64)  # [kg m²]
    joint_stiffness: wp.array(dtype=wp.float64)  # k [N/m]
    joint_damping: wp.array(dtype=wp.float64)  # b [N s/m]
    viscous_friction: wp.array(dtype=wp.float64)  # β [N m s]
    coulomb_friction: wp.array(dtype=wp.float64)  # τ_c [N m]
    friction_smoothing: wp.array(dtype=wp.float64)  # ω_c [rad/s]
    gravity: wp.array(dtype=wp.float64)  # g [m/s²], along −y
    circle_radius: wp.array(dtype=wp.float64)  # r [m], of a link's two circles
    tangential_restitution: wp.array(dtype=wp.float64)  # e_t
    floor_restitution: wp.array(dtype=wp.float64)  # e_fc
    floor_friction: wp.array(dtype=wp.float64)  # μ_fc
    chain_restitution: wp.array(dtype=wp.float64)  # e_cc
    chain_friction: wp.array(dtype=wp.float64)  # μ_cc
    sprocket_restitution: wp.array(dtype=wp.float64)  # e_sc
    sprocket_friction: wp.array(dtype=wp.float64)  # μ_sc
    sprocket_radius: wp.array(dtype=wp.float64)  # [m], the radius that link circles touch; centre at the origin


@wp.struct
class Drive:
    """What happens to a chain and when its run ends. Every array has shape (W,)."""

    sprocket_speed: wp.array(dtype=wp.float64)  # final angular velocity Ω [rad/s], counter-clockwise positive
    spin_up_start: wp.array(dtype=wp.float64)  # [s]
    spin_up_time: wp.array(dtype=wp.float64)  # [s]; 0: at full speed from the start
    hold_start: wp.array(dtype=wp.float64)  # [s]; the steady-state watch begins here
    loop_speed: wp.array(dtype=wp.float64)  # speed along the loop that counts as steady [m/s]
    loop_period: wp.array(dtype=wp.float64)  # [s]
    load_factor: wp.array(dtype=wp.float64)  # of the hold's first part, see scaled_loads
    steady_window: wp.array(dtype=wp.float64)  # over which means are taken in the hold's second part [s]
    steady_time: wp.array(dtype=wp.float64)  # for which the loop must then keep its shape [s]; negative: by itself
    steady_tolerance: wp.array(dtype=wp.float64)  # relative change of its shape that counts as kept
    further_hold: wp.array(dtype=wp.float64)  # how long a stationary loop is held on [s]
    release_phase: wp.array(dtype=wp.float64)  # and then for this part of a loop period
    hold_softness: wp.array(dtype=wp.float64)  # from the hold to the release, 1 to 2; 0: own values
    loaded_softness: wp.array(dtype=wp.float64)  # the same under load
    push_rate: wp.array(dtype=wp.float64)  # at which the sprocket pushes out circles that have sunk in [1/s]


@wp.struct
class State:
    """What evolves. Shapes (W,) unless given.

    A run is bit-identical however it is cut into launches: what the loop over steps remembers between two attempts is
    kept here and in the chain's scratch block, which therefore belongs to its world until the run ends.
    """

    links: wp.array3d(dtype=wp.float64)  # (W, 6, N): x, y [m], θ [rad], and their rates
    time: wp.array(dtype=wp.float64)  # [s]
    stop_time: wp.array(dtype=wp.float64)  # the run lands on this time exactly and ends [s]
    stop_status: wp.array(dtype=wp.int32)  # status it then gets
    is_fresh: wp.array(dtype=wp.int32)  # 1: links were set by the host, the scratch block is void
    has_first_stage: wp.array(dtype=wp.int32)  # 1: the scratch block holds the first stage of the next step
    gap: wp.array(dtype=wp.float64)  # of the CPU form: least distance to floor or sprocket [m]
    reach: wp.array(dtype=wp.float64)  # of the block form: time in which nothing comes near unseen [s]
    slack: wp.array(dtype=wp.float64)  # how far joints may yet move before the list is stale [m]; of blocks that fly
    step: wp.array(dtype=wp.float64)  # step that the controller proposes [s]
    last_error: wp.array(dtype=wp.float64)  # error ratio of the last accepted step (PI controller)
    is_rigid: wp.array(dtype=wp.int32)  # 1: on rigid joints, see joint_switch
    other_step: wp.array(dtype=wp.float64)  # step that was proposed last on the other model of the joints [s]
    closing_time: wp.array(dtype=wp.float64)  # when joints may next be closed [s]
    next_sample: wp.array(dtype=wp.int64)  # index of the next sample mark
    status: wp.array(dtype=wp.int32)
    watch: wp.array2d(dtype=wp.float64)  # (W, WATCH_ROWS): memory of the watches
    softness: wp.array(dtype=wp.float64)  # of the joints: 0 the model's own, 1 soft, 2 softest; see softening
    load_factor: wp.array(dtype=wp.float64)  # of gravity, friction and inertia on the sprocket, see scaled_loads
    first_area: wp.array(dtype=wp.float64)  # enclosed by the loop when its run began [m²]
    attempts_before: wp.array(dtype=wp.int64)  # attempts of the walk's earlier phases, for the limit
    first_sample: wp.array2d(dtype=wp.float64)  # (W, SAMPLE_COLUMNS): the chain when its run began …
    last_sample: wp.array2d(dtype=wp.float64)  # … and when it was last looked at, at the end of the run the last time
    counts: wp.array2d(dtype=wp.int64)  # (W, COUNT_ROWS)
    extremes: wp.array2d(dtype=wp.float64)  # (W, EXTREME_ROWS) [m]
    losses: wp.array2d(dtype=wp.float64)  # (W, LOSS_ROWS) [J]


@wp.struct
class Record:
    """Time series that the host drains between launches; a full one ends the launch, nothing is dropped."""

    sample_count: wp.array(dtype=wp.int32)  # (W,)
    frame_count: wp.array(dtype=wp.int32)  # (W,)
    samples: wp.array3d(dtype=wp.float64)  # (W, capacity, SAMPLE_COLUMNS); capacity 0: not recorded
    frames: wp.array3d(dtype=wp.float64)  # (W, capacity, 2 N): joint x …, joint y …; capacity 0: not recorded
    frame_times: wp.array2d(dtype=wp.float64)  # (W, capacity) [s]
    frame_loads: wp.array3d(dtype=wp.float64)  # (W, capacity, 3 N): joint forces x …, y …, moments …; see record


@wp.struct
class Control:
    """Numerical settings of a launch, the same for all its worlds."""

    tolerance: wp.float64  # absolute and relative
    soft_tolerance: wp.float64  # the same while joints are soft or softer
    flight_tolerance: wp.float64  # the same on rigid joints
    proportional: wp.int32  # 1: proportional-integral controller, 0: odeint's standard one
    contact_step: wp.float64  # longest step near a contact [s]
    skin: wp.float64  # margin of the neighbour list [m]
    smallest_step: wp.float64  # [s]
    step_limit: wp.int64  # attempts in all
    attempts: wp.int32  # attempts in this launch
    launch_time: wp.float64  # after which a block stops at its next look [s]
    sample_interval: wp.float64  # [s]
    frame_every: wp.int64  # samples per frame
    rest_speed: wp.float64  # [m/s]
    rest_time: wp.float64  # [s]
    soft_stiffness: wp.float64  # k of soft joints [N/m]
    soft_damping: wp.float64  # b [N s/m]
    soft_smoothing: wp.float64  # ω_c [rad/s]
    softest_stiffness: wp.float64  # the same of the softest, whose ω_c is that of soft ones
    softest_damping: wp.float64
    soft_contact_step: wp.float64  # longest near a contact on the softest joints, in the drive on soft ones [s]
    soften_area: wp.float64  # joints soften below this fraction of the first area
    stiffening_time: wp.float64  # from soft joints at the release to the model's own [s]


@wp.struct
class Chain:
    """One world's constants, read once per launch."""

    link_count: wp.int32
    half_length: wp.float64
    inner_mass: wp.float64
    outer_mass: wp.float64
    inner_inertia: wp.float64
    outer_inertia: wp.float64
    joint_stiffness: wp.float64
    joint_damping: wp.float64
    viscous_friction: wp.float64
    coulomb_friction: wp.float64
    inverse_smoothing: wp.float64
    gravity: wp.float64
    circle_radius: wp.float64
    tangential_restitution: wp.float64
    floor_restitution: wp.float64
    floor_friction: wp.float64
    chain_restitution: wp.float64
    chain_friction: wp.float64
    sprocket_restitution: wp.float64
    sprocket_friction: wp.float64
    sprocket_radius: wp.float64


@wp.func
def read_chain(model: Model, world: int) -> Chain:
    """Constants of one world."""
    chain = Chain()
    chain.link_count = model.link_count[world]
    chain.half_length = wp.float64(0.5) * model.link_length[world]
    chain.inner_mass = model.inner_mass[world]
    chain.outer_mass = model.outer_mass[world]
    chain.inner_inertia = model.inner_inertia[world]
    chain.outer_inertia = model.outer_inertia[world]
    chain.joint_stiffness = model.joint_stiffness[world]
    chain.joint_damping = model.joint_damping[world]
    chain.viscous_friction = model.viscous_friction[world]
    chain.coulomb_friction = model.coulomb_friction[world]
    chain.inverse_smoothing = wp.float64(1.0) / model.friction_smoothing[world]
    chain.gravity = model.gravity[world]
    chain.circle_radius = model.circle_radius[world]
    chain.tangential_restitution = model.tangential_restitution[world]
    chain.floor_restitution = model.floor_restitution[world]
    chain.floor_friction = model.floor_friction[world]
    chain.chain_restitution = model.chain_restitution[world]
    chain.chain_friction = model.chain_friction[world]
    chain.sprocket_restitution = model.sprocket_restitution[world]
    chain.sprocket_friction = model.sprocket_friction[world]
    chain.sprocket_radius = model.sprocket_radius[world]
    return chain
