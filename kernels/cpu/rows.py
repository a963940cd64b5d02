"""Rows of a chain's scratch, of which the host makes the memory; no Warp function stands here."""

from warpchain.kernels import layout
from warpchain.kernels.cpu.implicit.flight_layout import flight_rows
from warpchain.kernels.cpu.implicit.rosenbrock_layout import FIRST_STAGE_ROW, segments_of
from warpchain.kernels.cpu.implicit.solver import LANES
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.methods.rosenbrock_tableaus import ROSENBROCK_TABLES


def scratch_rows(name: str, columns: int) -> int:
    """Rows of a chain's scratch with this many columns."""
    method = find_method(name)
    if method.kind == "rosenbrock":
        return rosenbrock_rows(method.tableau, columns)
    rows = layout.scratch_rows(method.stages)
    return rows + flight_rows(columns) if method.has_rigid_flight else rows


def rosenbrock_rows(name: str, columns: int) -> int:
    """Rows of a chain's scratch of this width."""
    segments = segments_of(columns)
    rows = FIRST_STAGE_ROW + 3 * ROSENBROCK_TABLES[name].stages
    doubles = rows * segments.columns + segments.separator_rows * LANES
    return layout.STAGES + layout.STAGE_ROWS + -(-doubles // columns)
