"""Where the neighbour list of a chain lies, which joints it holds, and how cells of the grid are hashed."""

import functools
from dataclasses import dataclass

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.physics.elementary import TWO
from warpchain.kernels.types import Chain

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class ListLayout:
    """Where the integers of a chain's neighbour list lie: offsets into one row of int32.

    Attributes:
        capacity: Greatest number of pairs; more is an overflow, which ends the walk with a status.
        table: Number of hash buckets, a power of two.
    """

    columns: int
    capacity: int
    table: int

    @property
    def count(self) -> int:
        """Number of pairs (one integer)."""
        return 0

    @property
    def first(self) -> int:
        """Lower joint of each pair, in the order of contact resolution."""
        return 1

    @property
    def second(self) -> int:
        """Higher joint of each pair."""
        return self.first + self.capacity

    @property
    def touching(self) -> int:
        """Scratch: indices of pairs that touch now."""
        return self.second + self.capacity

    @property
    def found_first(self) -> int:
        """Scratch: pairs as found, ordered by (p, q)."""
        return self.touching + self.capacity + 1

    @property
    def found_second(self) -> int:
        """Scratch: see ``found_first``."""
        return self.found_first + self.capacity

    @property
    def bucket(self) -> int:
        """Scratch: last joint put into each bucket, −1 for none."""
        return self.found_second + self.capacity

    @property
    def next_joint(self) -> int:
        """Scratch: the joint put into the same bucket before this one."""
        return self.bucket + self.table

    @property
    def cell_x(self) -> int:
        """Scratch: cell of each joint."""
        return self.next_joint + self.columns

    @property
    def cell_y(self) -> int:
        """Scratch: cell of each joint."""
        return self.cell_x + self.columns

    @property
    def pending(self) -> int:
        """Scratch of the block form, over parts that serve at other times: which contacts have not gone yet."""
        return self.found_first

    @property
    def owners(self) -> int:
        """Scratch of the block form for chains too long for shared memory, see :mod:`gpu.contacts.self_contacts`."""
        return max(self.cell_y + self.columns, self.pending + 2 * self.capacity)

    @property
    def size(self) -> int:
        """Integers in all."""
        return self.geometry + 2 * self.geometry_rows * self.geometry_columns

    @property
    def geometry_rows(self) -> int:
        """Rows of the CPU's scratch for contacts, see :mod:`cpu.contacts.self_contacts`."""
        return 34

    @property
    def geometry_columns(self) -> int:
        """Pairs of joints whose contacts are worked out together, a multiple of 8."""
        return 64

    @property
    def geometry(self) -> int:
        """That scratch: doubles, on whole cache lines."""
        return -(-(self.owners + 3 * self.columns + 8) // 16) * 16


@functools.cache
def list_layout(columns: int) -> ListLayout:
    """Layout for chains in scratch blocks of this width."""
    table = 1
    while table < 2 * columns:
        table *= 2
    return ListLayout(columns=columns, capacity=layout.PAIRS_PER_LINK * columns, table=table)


@wp.func
def listing_reach(chain: Chain, skin: wp.float64, opening: wp.float64):
    """Distance [m] below which two joints are listed; ``opening``: greatest |C| [m]."""
    return TWO * chain.circle_radius + skin + TWO * opening


@wp.func
def bucket_of(cell_x: int, cell_y: int, table: int):
    """Bucket of a cell in a hash table whose size is a power of two."""
    mixed = cell_x * 73856093 ^ cell_y * 19349663
    return (mixed ^ (mixed >> 15)) & (table - 1)
