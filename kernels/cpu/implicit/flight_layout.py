"""Memory of a flight on rigid joints, after that of :mod:`cpu.implicit.rigid_layout`."""

import functools

from warpchain.kernels.cpu.implicit.rigid_layout import ROWS_OF_RIGID, force_layout
from warpchain.kernels.cpu.implicit.solver import LANES, SegmentLayout
from warpchain.kernels.methods.w_tableaus import ROS34PW2

# Rows in segment order, after those of rigid. Slopes; the θ of r, Σ γ_ij k_j of the rates; power; the new state.
SLOPE, TARGET, COUPLED = ROWS_OF_RIGID, ROWS_OF_RIGID + 1, ROWS_OF_RIGID + 2
POWER, DRAG = ROWS_OF_RIGID + 5, ROWS_OF_RIGID + 6
NEW = ROWS_OF_RIGID + 7
FIRST_STAGE_ROW = ROWS_OF_RIGID + 13
FLIGHT_SYSTEM = FIRST_STAGE_ROW + 6 * ROS34PW2.stages


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
