"""Which part of the motion of a walk is kept."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class Keep:
    """What is kept of the motion of one walk.

    Attributes:
        series_every: a sample is kept at every so many sample marks; None: no series.
        frame_every: a frame is kept at every so many sample marks; None: no frames.
        frame_interval: time [s] between two frames after the release, instead, if it is shorter than that between two
            sample marks; 0: as `frame_every` says.
        loads: whether force and moment of each joint are kept with the frames after the release.
        before: time [s] before the release of which samples and frames are kept as well, with the loads of the
            joints; 0: none.
    """

    series_every: int | None = None
    frame_every: int | None = None
    frame_interval: float = 0.0
    loads: bool = False
    before: float = 0.0


NOTHING: Final = Keep()

LONGEST_INTERVAL: Final = 1000.0
"""Greatest time [s] between two samples or frames that are kept, and of what is kept before a release."""
