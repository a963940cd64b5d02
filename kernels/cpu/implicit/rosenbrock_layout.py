"""Memory of the implicit step: rows in the order of :mod:`cpu.implicit.solver`.

The next link lies at the next place, eight columns further. A segment is padded with copies of neighbouring values
where they are needed. Rows of joints begin one place later: the joint on the right of the link in column c lies in
column c + 8, the joint on its left in column c.
"""

import functools

import warp as wp

from warpchain.kernels.cpu.implicit.solver import SegmentLayout, segment_columns

wp.set_module_options({"enable_backward": False})

# Rows in segment order. The state at the start of the step (6), its direction, the links' constants.
BASE = 0
BASE_COSINE, BASE_SINE, MASS, INERTIA, COUNTED = range(6, 11)
# Accelerations at the start of the step. Of joints there: slope and torque of friction, force, spin, opening rate.
BASE_RATE = 11
SLOPE, BASE_TORQUE, BASE_FORCE_X, BASE_FORCE_Y, BASE_SPIN, BASE_RATE_X, BASE_RATE_Y = range(14, 21)
# A stage: change of the direction since the start, r_q / g, γ Σ C U_v, joint forces and torques of the stage and those
# of the velocities r_q / g.
COSINE, SINE = 21, 22
SHIFT, DRIVE = 23, 26
FORCE_X, FORCE_Y, TORQUE, SHIFT_X, SHIFT_Y, SHIFT_TORQUE = range(29, 35)
POWER_FRICTION, POWER_DAMPING = 35, 36
# Change of a stage's place since the start, and its velocities; in the end the new state. Σ w U of angle and
# velocities, in rows that are no longer needed then.
NEW = 37
CHANGE = SHIFT
# Of joints at the start: opening, f'(w), rate of change of the spin.
BASE_OPENING_X, BASE_OPENING_Y, TANGENT, SPIN_RATE = range(43, 47)
# The linear system of :mod:`cpu.implicit.solver`, then three rows a stage: W of :class:`SecondOrderTable`.
SYSTEM = 47
LOWER, DIAGONAL, UPPER = SYSTEM, SYSTEM + 9, SYSTEM + 18
RIGHT_SIDE = SYSTEM + 45
FIRST_STAGE_ROW = RIGHT_SIDE + 3


@functools.cache
def segments_of(columns: int) -> SegmentLayout:
    """Layout of the linear system, for scratch of this width."""
    return SegmentLayout(size=3, columns=segment_columns(columns), matrix=SYSTEM, right=RIGHT_SIDE)


@functools.cache
def pad_behind(rows: tuple[int, ...]):
    """Warp function that copies, in these rows, the next segment's first link behind each segment's last."""

    @wp.func
    def pad(S: wp.array2d(dtype=wp.float64), places: int, full: int):
        s = int(0)
        while s < 8:
            after = (s + 1) % 8
            source = 8 + after + wp.where(after >= full, 8, 0)
            for k in range(wp.static(len(rows))):
                S[wp.static(rows[k]), 8 * places + 8 + s] = S[wp.static(rows[k]), source]
            s += 1

    return pad


@functools.cache
def pad_before(rows: tuple[int, ...], place: int):
    """Warp function that copies, in these rows, the end of the previous segment before the place that rows begin at."""

    @wp.func
    def pad(S: wp.array2d(dtype=wp.float64), places: int):
        s = int(0)
        while s < 8:
            for k in range(wp.static(len(rows))):
                source = 8 * places + wp.static(8 * place) + (s + 7) % 8
                S[wp.static(rows[k]), wp.static(8 * place) + s] = S[wp.static(rows[k]), source]
            s += 1

    return pad
