"""Memory of rigid joints and of flights on them: rows in the order of :mod:`cpu.implicit.solver`.

The next link lies at the next place, eight columns further. A segment is padded with copies of neighbouring values
where they are needed. A joint lies at the column of the link on its left.
"""

import functools

import warp as wp

from warpchain.kernels.cpu.implicit.solver import LANES, SegmentLayout, segment_columns
from warpchain.kernels.methods.w_tableaus import ROS34PW2
from warpchain.kernels.types import Rows

wp.set_module_options({"enable_backward": False})

# Rows in segment order. The state; constants of the links and joints.
BASE = 0
INVERSE_MASS, INVERSE_INERTIA, MASS, INERTIA, VISCOUS, COULOMB, COUNTED = range(6, 13)
# A stage: rates, directions; joints' inverse smoothing and torques, α; accelerations.
STAGE_U, STAGE_V, SPIN = 13, 14, 15
COSINE, SINE = 16, 17
INVERSE_SMOOTHING, TORQUE, FREE = 18, 19, 20
RATE = 21
# Joint forces of the state and the accelerations that belong to it.
FORCE = 24
BASE_RATE = 26
# The system S F = r.
SYSTEM = 29
ROWS_OF_RIGID = SYSTEM + 22
# A flight: slopes; the θ of r, Σ γ_ij k_j of the rates; power; the new state.
SLOPE, TARGET, COUPLED = ROWS_OF_RIGID, ROWS_OF_RIGID + 1, ROWS_OF_RIGID + 2
POWER, DRAG = ROWS_OF_RIGID + 5, ROWS_OF_RIGID + 6
NEW = ROWS_OF_RIGID + 7
FIRST_STAGE_ROW = ROWS_OF_RIGID + 13
FLIGHT_SYSTEM = FIRST_STAGE_ROW + 6 * ROS34PW2.stages


@functools.cache
def force_layout(columns: int) -> SegmentLayout:
    """Layout of the system S F = r, for scratch of this width."""
    return SegmentLayout(size=2, columns=segment_columns(columns), matrix=SYSTEM, right=SYSTEM + 20)


@functools.cache
def friction_layout(columns: int) -> SegmentLayout:
    """Layout of the stages' system, for scratch of this width."""
    width = force_layout(columns).columns
    return SegmentLayout(size=3, columns=width, matrix=FLIGHT_SYSTEM, right=FLIGHT_SYSTEM + 45)


def flight_rows(columns: int) -> int:
    """Rows of a chain's scratch of this width that a flight takes."""
    forces, friction = force_layout(columns), friction_layout(columns)
    doubles = (FLIGHT_SYSTEM + 48) * forces.columns + LANES * (forces.separator_rows + friction.separator_rows)
    return -(-doubles // columns)


@functools.cache
def pad_behind(rows: tuple[int, ...]):
    """Warp function that copies, in these rows, the next segment's first link behind each segment's last."""

    @wp.func
    def pad(S: Rows, places: int, full: int):
        s = int(0)
        while s < 8:
            after = (s + 1) % 8
            source = 8 + after + wp.where(after >= full, 8, 0)
            for k in range(wp.static(len(rows))):
                S[wp.static(rows[k]), 8 * places + 8 + s] = S[wp.static(rows[k]), source]
            s += 1

    return pad


@functools.cache
def pad_joints(rows: tuple[int, ...]):
    """Warp function that copies, in these rows, the previous joint before each segment's first place."""

    @wp.func
    def pad(S: Rows, places: int, full: int):
        s = int(0)
        while s < 8:
            # a short segment repeats the last joint of the segment before; that one's predecessor is copied
            source = 8 * places + (s + 7) % 8 - wp.where(s >= full, 8, 0)
            for k in range(wp.static(len(rows))):
                S[wp.static(rows[k]), s] = S[wp.static(rows[k]), source]
            s += 1

    return pad
