"""What a step kernel is compiled for, and the compiler's flags."""

from dataclasses import dataclass

COMPILER_FLAGS = (
    "-march=native -ffp-contract=fast -mllvm=-inline-threshold=40000 -mllvm=-inline-cold-callsite-threshold=3000"
)
"""Clang flags of the step kernels. Fused multiply-adds make a stage 1.7 times faster."""


@dataclass(frozen=True)
class Features:
    """What a step kernel is compiled for; code for anything else is left out.

    Attributes:
        method: Name of a method, see :mod:`methods.method`.
        columns: Width of a chain's scratch, see :func:`layout.padded_width`.
        fixed_body: A key of :data:`contacts.fixed_body.BODIES`.
        self_contact: Contacts between a chain's own links.
        tilts: Whether the plane of the chain may move, see :mod:`physics.plane`; with an explicit method only.
        moving_sprocket: Whether the sprocket is there as well, above a floor, and moves.
    """

    method: str
    columns: int
    fixed_body: str
    self_contact: bool
    tilts: bool = False
    moving_sprocket: bool = False

    @property
    def is_driven(self) -> bool:
        """Whether there is a driven sprocket: loads and links may change at a sample."""
        return self.fixed_body == "sprocket"

    @property
    def has_floor(self) -> bool:
        """Whether there is a floor of any kind."""
        return self.fixed_body not in ("none", "sprocket")
