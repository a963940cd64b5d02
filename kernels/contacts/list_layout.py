"""Where the neighbour list of a chain lies in its memory."""

import functools
from dataclasses import dataclass

from warpchain.kernels import layout

GEOMETRY_ROWS = 34
"""Rows of the CPU's scratch of contacts, see :mod:`cpu.contacts.self_contacts`."""
GEOMETRY_COLUMNS = 64
"""Pairs of joints whose contacts are evaluated together, a multiple of 8."""


@dataclass(frozen=True)
class ListLayout:
    """Where a chain's neighbour list lies in one row of int32."""

    capacity: int  # greatest number of pairs; more is an overflow, which ends the walk with a status
    count: int  # offset of the number of pairs (one integer). All below are offsets, too
    nearest: int  # least distance of two joints that are not listed [m], bits of a single-precision number
    first: int  # lower joint of each pair; on a CPU in the order of contact resolution
    second: int  # higher joint of each pair
    touching: int  # GPU scratch: pairs that touch now, beyond those in shared memory
    found_first: int  # CPU scratch: lower joints as found, ordered by (p, q); then those of the pairs that touch now
    found_second: int  # CPU scratch: higher joints, likewise
    group: int  # CPU scratch: first joints of groups of eight that are near another one
    owners: int  # GPU scratch of chains too long for shared memory, see :mod:`gpu.contacts.self_contacts`
    geometry: int  # CPU scratch for contacts: doubles, on whole cache lines
    size: int  # integers in all

    @property
    def pending(self) -> int:
        """GPU scratch: which contacts are still to be resolved; on the places of ``found_first`` and following."""
        return self.found_first


@functools.cache
def list_layout(columns: int) -> ListLayout:
    """Layout for chains in scratch of this width."""
    capacity = layout.PAIRS_PER_LINK * columns
    integers = layout.consecutive_offsets(
        count=1,
        nearest=1,
        first=capacity + 1,
        second=capacity + 1,
        touching=capacity + 1,
        found_first=capacity,
        found_second=capacity,
        group=columns // 8 + 1,
        owners=3 * columns + 8,
    )
    geometry = -(-integers["size"] // 16) * 16
    size = geometry + 2 * GEOMETRY_ROWS * GEOMETRY_COLUMNS
    return ListLayout(capacity, **integers | {"geometry": geometry, "size": size})
