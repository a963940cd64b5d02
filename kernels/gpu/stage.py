"""What a thread of a block sees: its run, the chain's constants and links on the board, the proximity of the chain.

Registers are scarce: spills go to local memory, and large shared memory leaves little L1 cache for them. So the chain's
constants lie on the board and are read where they are needed.
"""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.physics import geometry
from warpchain.kernels.physics.geometry import Link
from warpchain.kernels.physics.plane import on_plane
from warpchain.kernels.types import Chain, Ground, Integers, Row, Rows


@wp.struct
class Run:
    """A thread's view of its block: which world it carries on, memory of all its threads, its own link."""

    ground: Ground
    world: wp.int32
    is_driven: wp.bool  # whether its chain hangs on a driven sprocket
    K: Rows  # the board
    kept: Rows  # rows of the scratch, of which some are kept between launches
    L: Integers  # the neighbour list
    T: Integers  # of the contacts, see TouchLayout
    P: Row  # the plane of the chain, if it tilts; the first thread changes it
    stored_plane: Row  # where that lies between launches
    S: wp.uint64  # memory of what links know of the start of a step, see :mod:`gpu.increments`
    # memory in which stages exchange; between them contacts use it as E and F, sums over the links as M
    exchange: wp.uint64
    E: Rows
    F: Rows
    M: Row
    maxima: wp.uint64  # for :func:`gpu.threads.block_maxima`
    skin: wp.float32  # of the neighbour list [m]
    lane: wp.int32  # its link
    column: wp.int32  # its link, or the last one for threads without a link
    before: wp.int32  # the link to the left
    after: wp.int32  # the link to the right
    links: wp.int32  # number of links of the chain


@wp.struct
class Proximity:
    """Maxima over a whole chain in one state, in single precision, which keeps signs."""

    opening: wp.float32  # greatest of a joint [m]
    gap: wp.float32  # least to floor or sprocket [m]
    displacement: wp.float32  # greatest of a joint since the neighbour list was built [m]
    speed: wp.float32  # bound on the speed of any point [m/s]


@wp.func_native("return reinterpret_cast<::wp::uint64>(K.data + offset);")
def address_on_board(K: Rows, offset: int) -> wp.uint64:
    """Where a number on the board lies; with ``K.ptr`` the compiler would not know that it is shared memory."""


@wp.func
def constants_address(K: Rows):
    """Where the chain's constants lie on the board."""
    return address_on_board(K, wp.static(layout.BOARD_VALUES) * K.shape[1] + wp.static(layout.VALUES))


@wp.func
def constants(K: Rows) -> Chain:
    """The chain's constants, from the board; the compiler loads the fields that are used."""
    chains = wp.array(ptr=constants_address(K), shape=(1,), dtype=Chain)
    return chains[0]


@wp.func
def write_constants(K: Rows, chain: Chain):
    """Writes the chain's constants on the board."""
    chains = wp.array(ptr=constants_address(K), shape=(1,), dtype=Chain)
    chains[0] = chain


@wp.func
def read_link(K: Rows, column: int) -> Link:
    """A link, from the board."""
    return geometry.read_link(K, constants(K), column)


@wp.func
def felt_plane(run: Run) -> Chain:
    """The chain on the plane that its links feel in this step."""
    return on_plane(constants(run.K), run.P, layout.PLANE_MID)
