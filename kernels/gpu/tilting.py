"""A chain whose plane may tilt, in a block of threads: see :mod:`cpu.tilting`.

The first thread of the block moves the plane, in one row of :attr:`State.plane`. What the links feel of it lies on the
board. Sums over the links are those of the hardware warps, added up by the first thread, and round otherwise than on a
CPU.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts.tilting_floor import (
    copy_inverse,
    link_touches,
    meet_tilting_floor,
    push_plane_by,
    steepness,
)
from warpchain.kernels.gpu.board import ends_of
from warpchain.kernels.gpu.stage import Place, constants, felt_plane, read_link
from warpchain.kernels.gpu.threads import barrier, warp_width
from warpchain.kernels.gpu.upright import BlockPlane
from warpchain.kernels.layout import (
    BOARD_FIRST,
    BOARD_VALUES,
    COSINE,
    INERTIA,
    INVERSE_INERTIA,
    INVERSE_MASS,
    MASS,
    OMEGA,
    ORIGIN,
    PLANE_MID,
    PLANE_SPEED,
    PLANE_TURN_X,
    PLANE_TURN_Y,
    SINE,
    SUMS_OF_MOTION,
    SUMS_OF_PLACES,
    UP,
    VALUE_PLANE,
    VALUE_PLANE_BEFORE,
    U,
    V,
    X,
    Y,
)
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.physics.plane import (
    begin_plane_step,
    end_plane_step,
    invert_plane_mass,
    motion_terms,
    on_plane,
    place_terms,
    plane_load,
)
from warpchain.kernels.types import Drive, Ground, Row, Rows, State

wp.set_module_options({"enable_backward": False})

FELT = 7
"""Values of a plane that lie on the board: u, ω1, ω2, the three of up, and the height of the origin."""


vec4d = wp.types.vector(length=4, dtype=wp.float64)
vec8d = wp.types.vector(length=8, dtype=wp.float64)


def sum_up_source(count: int) -> str:
    """Source of a native function that sums ``count`` values of each thread, a power of two up to 16.

    In each round a thread keeps half of its values and passes the other half to its partner, which keeps those: 9
    exchanges for 8 values, where a sum of each value by itself takes 40. Exchanges are what such sums cost on a GPU.
    The rounds are written out, because a loop over them would keep the values in local memory.
    """
    lines = ["#if defined(__CUDA_ARCH__)", "int index = 0;"]
    half, width = count // 2, 16
    while half:
        lines.append(f"{{ const bool upper = (lane & {width}) != 0; index = 2 * index + (upper ? 1 : 0);")
        for k in range(half):
            mine, other = f"x[{k}]", f"x[{k + half}]"
            passed = f"__shfl_xor_sync(0xffffffffu, upper ? {mine} : {other}, {width})"
            lines.append(f"{mine} = (upper ? {other} : {mine}) + {passed};")
        lines.append("}")
        half, width = half // 2, width // 2
    sharing = width
    while width:
        lines.append(f"x[0] += __shfl_xor_sync(0xffffffffu, x[0], {width});")
        width //= 2
    lines.append(
        f"if ((lane & {2 * sharing - 1}) == 0) memory.data[(slot + index) * (block_dim / 32) + lane / 32] = x[0];"
    )
    lines += [
        "#else",
        f"for (int k = 0; k < {count}; ++k) memory.data[(slot + k) * block_dim + lane] = x[k];",
        "#endif",
    ]
    return "\n" + "\n".join(lines) + "\n"


@wp.func_native(sum_up_source(4))
def add_up_four(memory: Row, slot: int, lane: int, block_dim: int, x: vec4d):
    """Writes the sums of four values over each hardware warp, from ``slot`` on; a fiber is a warp of its own.

    After a barrier :func:`added_up` reads the sums over the block.
    """
    ...


@wp.func_native(sum_up_source(8))
def add_up_eight(memory: Row, slot: int, lane: int, block_dim: int, x: vec8d):
    """The same for eight values, which fibers have no memory for."""
    ...


@wp.func_native("""
#if defined(__CUDA_ARCH__)
    return __syncthreads_count(x);
#else
    memory.data[slot * block_dim + lane] = x ? 1.0 : 0.0;
    WP_TILE_SYNC();
    int count = 0;
    for (int i = 0; i < block_dim; ++i) {
        count += memory.data[slot * block_dim + i] != 0.0;
    }
    return count;
#endif
""")
def barrier_count(memory: Row, slot: int, lane: int, block_dim: int, x: bool) -> int:
    """A barrier that returns to all threads in how many of them x is true; fibers count in a slot of the memory."""
    ...


@wp.func
def added_up(memory: Row, slot: int, block_dim: int):
    """The sum over all threads of the block."""
    warps = block_dim // warp_width()
    total = ZERO
    i = int(0)
    while i < warps:
        total += memory[slot * warps + i]
        i += 1
    return total


@wp.func
def write_felt_plane(K: Rows, P: Row):
    """Writes the plane of the middle of the step on the board; what lay there becomes that of the attempt before."""
    for k in range(wp.static(FELT)):
        K[BOARD_VALUES, VALUE_PLANE_BEFORE + k] = K[BOARD_VALUES, VALUE_PLANE + k]
    K[BOARD_VALUES, VALUE_PLANE] = P[PLANE_MID + PLANE_SPEED]
    K[BOARD_VALUES, VALUE_PLANE + 1] = P[PLANE_MID + PLANE_TURN_X]
    K[BOARD_VALUES, VALUE_PLANE + 2] = P[PLANE_MID + PLANE_TURN_Y]
    for k in range(3):
        K[BOARD_VALUES, VALUE_PLANE + 3 + k] = P[PLANE_MID + UP + k]
    K[BOARD_VALUES, VALUE_PLANE + 6] = P[PLANE_MID + ORIGIN + 1]


@wp.func
def copy_plane(target: Row, source: Row):
    """Copies a plane with all its sums."""
    row = int(0)
    while row < layout.PLANE_ROWS:
        target[row] = source[row]
        row += 1


@wp.func
def shift_first_stage(K: Rows, lane: int):
    """Changes a link's first stage on the board from the plane of the attempt before to that of this one."""
    own = constants(K)
    link = read_link(K, lane)
    now = felt_plane(K, own, VALUE_PLANE)
    before = felt_plane(K, own, VALUE_PLANE_BEFORE)
    ax, ay, turn = plane_load(now, link.x, link.y, link.arm_x, link.arm_y)
    old_ax, old_ay, old_turn = plane_load(before, link.x, link.y, link.arm_x, link.arm_y)
    K[BOARD_FIRST, lane] = K[BOARD_FIRST, lane] + (ax - old_ax)
    K[BOARD_FIRST + 1, lane] = K[BOARD_FIRST + 1, lane] + (ay - old_ay)
    K[BOARD_FIRST + 2, lane] = K[BOARD_FIRST + 2, lane] + (turn - old_turn)


@wp.func
def places_of(K: Rows, i: int):
    """The part of link i in the sums for its plane that depend on places."""
    return place_terms(constants(K), K[MASS, i], K[INERTIA, i], K[X, i], K[Y, i], K[COSINE, i], K[SINE, i])


@wp.func
def motion_of(K: Rows, i: int):
    """The part of link i in those that depend on velocities."""
    return motion_terms(K[MASS, i], K[INERTIA, i], K[X, i], K[Y, i], K[U, i], K[V, i], K[OMEGA, i])


@wp.func
def add_places_one_by_one(K: Rows, P: Row, n: int):
    """Writes the sums over all links that depend on places, by one fiber."""
    for k in range(wp.static(SUMS_OF_PLACES)):
        P[wp.static(layout.PLANE_SUMS + k)] = ZERO
    i = int(0)
    while i < n:
        places = places_of(K, i)
        for k in range(wp.static(SUMS_OF_PLACES)):
            P[wp.static(layout.PLANE_SUMS + k)] = P[wp.static(layout.PLANE_SUMS + k)] + places[k]
        i += 1


@wp.func
def add_motion_one_by_one(K: Rows, P: Row, n: int):
    """Writes those that depend on velocities, by one fiber."""
    for k in range(wp.static(SUMS_OF_MOTION)):
        P[wp.static(layout.MOTION_SUMS + k)] = ZERO
    i = int(0)
    while i < n:
        motion = motion_of(K, i)
        for k in range(wp.static(SUMS_OF_MOTION)):
            P[wp.static(layout.MOTION_SUMS + k)] = P[wp.static(layout.MOTION_SUMS + k)] + motion[k]
        i += 1


@functools.cache
def block_tilting(block_dim: int) -> BlockPlane:
    """A plane that may tilt, above a flat floor, for blocks of this size."""
    count_slot, sum_slot = 0, 1

    @wp.func
    def load(K: Rows, P: Row, state: State, world: int):
        copy_plane(P, state.plane[world])
        write_felt_plane(K, P)

    @wp.func
    def store(P: Row, state: State, world: int):
        copy_plane(state.plane[world], P)

    @wp.func
    def after_first_stage():
        barrier()  # all have read the plane that they feel

    @wp.func
    def begin_step(K: Rows, P: Row, place: Place, h: wp.float64):
        if place.lane == 0:
            begin_plane_step(P, constants(K).gravity, h)
            write_felt_plane(K, P)
        barrier()
        if place.lane < place.links:
            shift_first_stage(K, place.lane)

    @wp.func
    def sum_up(K: Rows, P: Row, M: Row, place: Place):
        if warp_width() > 1:
            places = places_of(K, place.column)
            motion = motion_of(K, place.column)
            terms = vec8d()
            if place.lane < place.links:
                for k in range(wp.static(SUMS_OF_PLACES)):
                    terms[k] = places[k]
                for k in range(wp.static(SUMS_OF_MOTION)):
                    terms[wp.static(SUMS_OF_PLACES + k)] = motion[k]
            add_up_eight(M, wp.static(sum_slot), place.lane, wp.static(block_dim), terms)
        barrier()
        if place.lane == 0:
            if warp_width() > 1:
                for k in range(wp.static(SUMS_OF_PLACES + SUMS_OF_MOTION)):
                    P[wp.static(layout.PLANE_SUMS + k)] = added_up(M, wp.static(sum_slot + k), wp.static(block_dim))
            else:
                add_places_one_by_one(K, P, place.links)
                add_motion_one_by_one(K, P, place.links)
            invert_plane_mass(P)

    @wp.func
    def begin_run(K: Rows, P: Row, M: Row, place: Place):
        if place.lane == 0:
            P[layout.SUM_MASS] = constants(K).mass
        barrier()  # all have read the ends
        sum_up(K, P, M, place)

    @wp.func
    def end_step(K: Rows, P: Row, M: Row, place: Place, h: wp.float64):
        sum_up(K, P, M, place)
        if place.lane == 0:
            end_plane_step(P, constants(K).gravity, h)

    @wp.func
    def meet(K: Rows, P: Row, M: Row, place: Place, _ground: Ground, _drive: Drive, _world: int, _time: wp.float64):
        lane = place.lane
        barrier()  # the plane and its mass are those of the new state
        chain = on_plane(constants(K), P, 0)
        slope = steepness(chain)
        link = read_link(K, lane)
        left_x, left_y, right_x, right_y = ends_of(link)
        touches = wp.int64(0)
        if lane < place.links:
            touches = link_touches(
                chain, slope, left_x, left_y, right_x, right_y, link.x, link.y, link.u, link.v, link.omega
            )
        touching = barrier_count(M, wp.static(count_slot), lane, wp.static(block_dim), touches > wp.int64(0))
        hits = int(0)
        if touching > 0:
            push = ZERO
            moment_x = ZERO
            moment_y = ZERO
            if touches > wp.int64(0):
                met = meet_tilting_floor(
                    chain,
                    slope,
                    copy_inverse(P, wp.float64(touching)),
                    left_x,
                    left_y,
                    right_x,
                    right_y,
                    link.x,
                    link.y,
                    K[MASS, lane],
                    K[INERTIA, lane],
                    K[INVERSE_MASS, lane],
                    K[INVERSE_INERTIA, lane],
                    link.u,
                    link.v,
                    link.omega,
                )
                K[U, lane] = met.u
                K[V, lane] = met.v
                K[OMEGA, lane] = met.omega
                K[layout.BOARD_LOST_FIXED, lane] = K[layout.BOARD_LOST_FIXED, lane] + met.lost
                push = met.push
                moment_x = met.moment_x
                moment_y = met.moment_y
                hits = int(met.hits)
            if warp_width() > 1:
                summed = vec8d()
                summed[0] = push
                summed[1] = moment_x
                summed[2] = moment_y
                motion = motion_of(K, place.column)
                if lane < place.links:
                    for k in range(wp.static(SUMS_OF_MOTION)):
                        summed[3 + k] = motion[k]
                add_up_eight(M, wp.static(sum_slot), lane, wp.static(block_dim), summed)
            else:
                add_up_four(M, wp.static(sum_slot), lane, wp.static(block_dim), vec4d(push, moment_x, moment_y, ZERO))
            barrier()
            if lane == 0:
                if warp_width() > 1:
                    for k in range(wp.static(SUMS_OF_MOTION)):
                        P[wp.static(layout.MOTION_SUMS + k)] = added_up(
                            M, wp.static(sum_slot + 3 + k), wp.static(block_dim)
                        )
                else:
                    add_motion_one_by_one(K, P, place.links)
                lost = push_plane_by(
                    P,
                    added_up(M, wp.static(sum_slot), wp.static(block_dim)),
                    added_up(M, wp.static(sum_slot + 1), wp.static(block_dim)),
                    added_up(M, wp.static(sum_slot + 2), wp.static(block_dim)),
                )
                K[layout.BOARD_LOST_FIXED, 0] = K[layout.BOARD_LOST_FIXED, 0] + lost
        return hits

    return BlockPlane(load, store, begin_run, after_first_stage, begin_step, end_step, meet)
