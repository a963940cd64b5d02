"""A chain whose plane may tilt, in a block of threads: see :mod:`cpu.tilting`.

The first thread of the block moves the plane, a row of :attr:`Worlds.plane` that lies behind the board meanwhile. Sums
over the links are those of the hardware warps, added up by the first thread, and round otherwise than on a CPU.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.contacts import tilting_floor
from warpchain.kernels.gpu.contacts.proximity import touching_link
from warpchain.kernels.gpu.stage import Run, constants
from warpchain.kernels.gpu.threads import barrier, barrier_count, warp_width
from warpchain.kernels.gpu.upright import PlaneHooks
from warpchain.kernels.layout import U
from warpchain.kernels.physics import plane
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.physics.geometry import put
from warpchain.kernels.types import Row, Worlds, with_circles

SUMS = layout.SUMS_OF_PLACES + layout.SUMS_OF_MOTION
vec8d = wp.types.vector(length=8, dtype=wp.float64)


def sum_up_source() -> str:
    """Source of a native function that sums eight values of each thread.

    In each round a thread keeps half of its values and passes the other half to its partner, which keeps those: 9
    exchanges for 8 values, where a sum of each value by itself takes 40. Exchanges are what such sums cost on a GPU.
    The rounds are written out, because a loop over them would keep the values in local memory. Fibers take turns
    instead: the first adds up what all have written.
    """
    lines = ["#if defined(__CUDA_ARCH__)", "int index = 0;"]
    half, width = SUMS // 2, 16
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
    lines.append(f"if ((lane & {2 * sharing - 1}) == 0) memory.data[index * (block_dim / 32) + lane / 32] = x[0];")
    lines += [
        "#else",
        f"for (int k = 0; k < {SUMS}; ++k) {{",
        f"    memory.data[{SUMS} + lane] = x[k];",
        "    WP_TILE_SYNC();",
        "    double sum = 0.0;",
        f"    for (int i = 0; i < block_dim; ++i) sum += memory.data[{SUMS} + i];",
        "    WP_TILE_SYNC();",
        "    memory.data[k] = sum;",
        "}",
        "#endif",
    ]
    return "\n" + "\n".join(lines) + "\n"


@wp.func_native(sum_up_source())
def add_up(memory: Row, lane: int, block_dim: int, x: vec8d):
    """Writes sums of eight values over each hardware warp, or all fibers; after a barrier :func:`added_up` reads."""


@wp.func
def added_up(memory: Row, k: int, block_dim: int):
    """The sum over all threads of the block of the value ``k``."""
    warps = wp.where(warp_width() > 1, block_dim // 32, 1)
    total = ZERO
    for i in range(warps):
        total += memory[k * warps + i]
    return total


@wp.func
def copy_plane(target: Row, source: Row):
    """Copies a plane with all its sums."""
    for row in range(layout.PLANE_ROWS):
        target[row] = source[row]


@functools.cache
def tilting_plane(block_dim: int, votes: int) -> PlaneHooks:
    """A plane that may tilt above a flat floor; votes: slot of :func:`gpu.threads.barrier_count`."""

    @wp.func
    def load(run: Run):
        copy_plane(run.P, run.stored_plane)

    @wp.func
    def store(run: Run):
        copy_plane(run.stored_plane, run.P)

    @wp.func
    def begin_step(run: Run, h: wp.float64):
        if run.lane == 0:
            plane.begin_step(run.P, constants(run.K).gravity, h)
        barrier()

    @wp.func
    def sum_up(run: Run):
        places = plane.place_terms(run.K, constants(run.K), run.column)
        motion = plane.motion_terms(run.K, run.column)
        terms = vec8d()
        if run.lane < run.links:
            for k in range(wp.static(layout.SUMS_OF_PLACES)):
                terms[k] = places[k]
            for k in range(wp.static(layout.SUMS_OF_MOTION)):
                terms[wp.static(layout.SUMS_OF_PLACES + k)] = motion[k]
        add_up(run.M, run.lane, wp.static(block_dim), terms)
        barrier()
        if run.lane == 0:
            for k in range(wp.static(SUMS)):
                run.P[wp.static(layout.PLANE_SUMS + k)] = added_up(run.M, wp.static(k), wp.static(block_dim))
            plane.invert_mass(run.P)

    @wp.func
    def begin_run(run: Run):
        if run.lane == 0:
            run.P[layout.SUM_MASS] = constants(run.K).mass
        barrier()  # all have read the ends
        sum_up(run)

    @wp.func
    def end_step(run: Run, h: wp.float64):
        sum_up(run)
        if run.lane == 0:
            plane.end_step(run.P, constants(run.K).gravity, h)

    @wp.func
    def meet(run: Run, _worlds: Worlds, _time: wp.float64, _gap: wp.float32):
        K = run.K
        P = run.P
        lane = run.lane
        barrier()  # the plane and its mass are those of the new state
        chain = with_circles(plane.on_plane(constants(K), P, 0), K[layout.RADIUS, run.column])
        slope = tilting_floor.steepness(chain)
        link = touching_link(run)
        touches = wp.int64(0)
        if lane < run.links:
            touches = tilting_floor.link_touches(chain, slope, link)
        touching = barrier_count(run.T, wp.static(votes), touches > wp.int64(0))
        hits = int(0)
        if touching > 0:
            summed = vec8d()
            if touches > wp.int64(0):
                inverse = tilting_floor.copy_inverse(P, wp.float64(touching))
                met = tilting_floor.meet_floor(chain, slope, inverse, link)
                put(K, U, lane, met.motion)
                K[layout.BOARD_LOST_FIXED, lane] = K[layout.BOARD_LOST_FIXED, lane] + met.lost
                for k in range(3):
                    summed[k] = met.push[k]
                hits = int(met.hits)
            motion = plane.motion_terms(K, run.column)
            if lane < run.links:
                for k in range(wp.static(layout.SUMS_OF_MOTION)):
                    summed[3 + k] = motion[k]
            add_up(run.M, lane, wp.static(block_dim), summed)
            barrier()
            if lane == 0:
                for k in range(wp.static(layout.SUMS_OF_MOTION)):
                    P[wp.static(layout.MOTION_SUMS + k)] = added_up(run.M, wp.static(3 + k), wp.static(block_dim))
                push = wp.vec3d()
                for k in range(3):
                    push[k] = added_up(run.M, k, wp.static(block_dim))
                lost = tilting_floor.push_plane_by(P, push)
                K[layout.BOARD_LOST_FIXED, 0] = K[layout.BOARD_LOST_FIXED, 0] + lost
        return hits

    return PlaneHooks(meet, load, store, begin_run, begin_step, end_step)
