"""What a step kernel is compiled for, and the compiler's flags."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any


def _vector_flag() -> str:
    """Asks for vectors of 512 bits on x86 processors that have them.

    For Intel's processors clang prefers 256 bits, because such vectors once lowered the clock.
    """
    processor = Path("/proc/cpuinfo")
    has_them = processor.exists() and " avx512vl" in processor.read_text(encoding="utf-8", errors="replace")
    return " -mprefer-vector-width=512" if has_them else ""


COMPILER_FLAGS = (
    "-march=native -ffp-contract=fast -mllvm=-inline-threshold=40000 -mllvm=-inline-cold-callsite-threshold=3000"
    + _vector_flag()
)
"""Clang flags of the step kernels, part of their name in the cache. Fused products make a stage 1.7 times faster."""


@dataclass(frozen=True)
class Features:
    """What a step kernel is compiled for; code for anything else is left out."""

    method: str  # name of a method, see :mod:`methods.method`
    columns: int  # width of a chain's scratch, see :func:`layout.padded_width`
    fixed_body: str  # A key of :data:`contacts.fixed_body.BODIES`
    self_contact: bool  # contacts between a chain's own links
    # whether the plane of the chain may move, see :mod:`physics.plane`; with an explicit method only
    tilts: bool = False
    load: str = "weight"  # a key of :data:`physics.load.LOADS`
    moving_sprocket: bool = False  # whether the sprocket is there as well, above a floor, and moves
    # GPU: whether chains of a launch may hang on a driven sprocket while others meet that body, see :mod:`gpu.loop`
    has_drive: bool = False
    is_mixed: bool = False  # whether stages on springs are in single precision, see :mod:`physics.increments`

    @property
    def is_driven(self) -> bool:
        """Whether there is a driven sprocket: loads and links may change at a sample."""
        from warpchain.kernels.contacts.fixed_body import BODIES  # only a kernel that is compiled needs its source

        return BODIES[self.fixed_body].is_driven

    @property
    def acceleration(self) -> Any:
        """Warp function of what accelerates a link besides its joints and the motion of its plane."""
        from warpchain.kernels.physics.load import LOADS

        return LOADS[self.load].acceleration

    @property
    def has_floor(self) -> bool:
        """Whether there is a floor of any kind."""
        return self.fixed_body != "none" and not self.is_driven
