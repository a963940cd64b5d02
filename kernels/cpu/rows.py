"""Rows of a chain's scratch, of which the host makes the memory."""

from warpchain.kernels import layout
from warpchain.kernels.cpu.implicit.rigid_layout import flight_rows
from warpchain.kernels.methods.method import find_method


def scratch_rows(name: str, columns: int) -> int:
    """Rows of a chain's scratch with this many columns."""
    method = find_method(name)
    rows = layout.scratch_rows(method.tableau.stages)
    return rows + flight_rows(columns) if method.has_rigid_flight else rows
