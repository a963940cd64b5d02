"""Memory of rigid joints and of flights on them: rows in the order of :mod:`cpu.implicit.solver`.

The next link lies at the next place, eight columns further. A segment is padded with copies of neighbouring values
where they are needed. A joint lies at the column of the link on its left.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.cpu.implicit.solver import SegmentLayout, segment_columns, segment_places
from warpchain.kernels.cpu.stage_rows import doubles_of_stages
from warpchain.kernels.methods import w_tableaus
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.types import Chain, Rows

# Rows in segment order. The state; constants of the links and joints, in the order of the scratch.
BASE = 0
MASS, INERTIA, INVERSE_MASS, INVERSE_INERTIA, VISCOUS, COULOMB, COUNTED = range(6, 13)
# A stage: velocity and spin, directions; joints' inverse smoothing and torques, α; accelerations.
STAGE_RATE, SPIN = 13, 15
COSINE, SINE = 16, 17
INVERSE_SMOOTHING, TORQUE, FREE = 18, 19, 20
RATE = 21
# Joint forces of the state and the accelerations that belong to it.
FORCE = 24
BASE_RATE = 26
# A flight: slopes; the θ of r, Σ γ_ij k_j of the rates; power; the new state; k of the stages.
SLOPE, TARGET, COUPLED = 29, 30, 31
POWER, DRAG = 34, 35
NEW = 36
STAGE = 42
# The system S F = r, and that of the stages.
FORCES = SegmentLayout(size=2, matrix=STAGE + 6 * w_tableaus.STAGES)
FRICTION = SegmentLayout(size=3, matrix=FORCES.end)


def scratch_rows(name: str, columns: int, is_mixed: bool) -> int:
    """Rows of a chain's scratch of this width, for a method: those of a flight, then those of stages on springs."""
    method = find_method(name)
    return first_stage_row(name, columns) + -(
        -doubles_of_stages(method.tableau, columns, 4 if is_mixed else 8) // columns
    )


def first_stage_row(name: str, columns: int) -> int:
    """Row from which on those of stages lie."""
    of_flight = -(-FRICTION.end * segment_columns(columns) // columns)
    return layout.SCRATCH_ROWS + (of_flight if find_method(name).has_rigid_flight else 0)


@functools.cache
def segment_rows(columns: int, first_row: int):
    """Warp function ``rows(K)`` → the rows in segment order, which lie in scratch of this width from a row on."""

    @wp.func
    def rows(K: Rows):
        return wp.array(
            ptr=K.ptr + wp.uint64(wp.static(8 * first_row * columns)),
            shape=(wp.static(FRICTION.end), wp.static(segment_columns(columns))),
            dtype=wp.float64,
        )

    return rows


@wp.func
def pad_behind(S: Rows, row: int, count: int, chain: Chain):
    """Copies, in ``count`` rows, the next segment's first link behind each segment's last."""
    places, full = segment_places(chain.link_count)
    s = int(0)
    while s < 8:
        after = (s + 1) % 8
        source = 8 + after + wp.where(after >= full, 8, 0)
        k = int(0)
        while k < count:
            S[row + k, 8 * places + 8 + s] = S[row + k, source]
            k += 1
        s += 1


@wp.func
def pad_joints(S: Rows, row: int, count: int, chain: Chain):
    """Copies, in ``count`` rows, the previous joint before each segment's first place."""
    places, full = segment_places(chain.link_count)
    s = int(0)
    while s < 8:
        # a short segment repeats the last joint of the segment before; that one's predecessor is copied
        source = 8 * places + (s + 7) % 8 - wp.where(s >= full, 8, 0)
        k = int(0)
        while k < count:
            S[row + k, s] = S[row + k, source]
            k += 1
        s += 1
