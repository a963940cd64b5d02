"""Properties of softened joints, on the sprocket and after a collapse; they are numerical constants, not presets.

The kernels in `warpchain.kernels.events.softening` go from a chain's own joints over these softly; loops on softened
joints and their averages count with them.
"""

from typing import Final, NamedTuple


class Joints(NamedTuple):
    """Stiffness [N/m] and damping [N s/m] of joints, and the width [rad/s] of Coulomb friction's sign change."""

    stiffness: float
    damping: float
    smoothing: float


SOFT: Final = Joints(stiffness=1e7, damping=100.0, smoothing=0.1)
"""Soft joints."""
SOFTEST: Final = SOFT._replace(stiffness=1e6, damping=30.0)
"""The softest joints. From half of the loop's first area on, walks on them end within 0.01 ± 0.04 mm (60 links at 15
Hz) and 1.5 ± 1.5 mm (150 at 20 Hz) of those on joints of their own, in 2.7 times fewer attempts. On k = 3e5 N/m circles
sink 2 mm into the floor; from 0.9 of the area on, 1e6 N/m may shift Δx, by 8 ± 4 mm of 1 m.
"""
SOFT_MASS: Final = (3.700e-3 + 3.147e-3) / 2
"""Mean mass of links [kg] for which these k and b are meant, Table 1's. From twice as much on they grow with it: else a
chain with 900 times Table 1's masses, k and b, the same in another unit of mass, walks up to 9 % too far."""
