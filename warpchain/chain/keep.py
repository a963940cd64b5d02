"""`Keep`, which part of a walk's motion is recorded; made from arguments, it is passed down to the device."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Self

FRAME_INTERVAL: Final = 2e-3
"""Time [s] between two frames, unless it is said otherwise."""


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

    @classmethod
    def asked(cls, interval: float | None, before: float, loads: bool, record_interval: float) -> Self:
        """The series, and frames at an interval [s], rounded to whole `record_interval`s unless it is shorter."""
        if interval is None:
            return cls(series_every=1)
        samples = interval / record_interval
        own = interval if samples <= 0.999 else 0.0
        return cls(series_every=1, frame_every=max(1, round(samples)), frame_interval=own, loads=loads, before=before)

    @classmethod
    def union(cls, keeps: Iterable[Self]) -> Self:
        """What a batch takes from all of its chains, so that each walk can keep what it wants.

        A `ValueError` says that frames are wanted at different intervals.
        """
        wanted = list(keeps)
        intervals = {keep.frame_interval for keep in wanted if keep.frame_interval > 0}
        if len(intervals) > 1:
            raise ValueError(f"keeps: frame intervals {sorted(intervals)} s; walks that run together have one")
        return cls(
            series_every=next((1 for keep in wanted if keep.series_every), None),
            frame_every=next((keep.frame_every for keep in wanted if keep.frame_every), None),
            frame_interval=max(intervals, default=0.0),
            loads=any(keep.before > 0 or keep.loads for keep in wanted),
        )


NOTHING: Final = Keep()

LONGEST_INTERVAL: Final = 1000.0
"""Greatest time [s] between two samples or frames that are kept, and of what is kept before a release."""
