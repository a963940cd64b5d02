"""Takes the time series and frames of a walk out of its world, between launches."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from warpchain.engine import Batch
from warpchain.kernels import layout
from warpchain.motion import Motion
from warpchain.recording import Keep

Array = NDArray[np.float64]

EVERYTHING: Final = Keep(series_every=1, frame_every=1)
SERIES_COLUMNS: Final = [layout.TIME, layout.CENTER_X, layout.CENTER_Y, layout.CENTER_U, layout.CENTER_V]
"""Columns of a sample that are those of `warpchain.motion.SERIES`."""


class Recorder:
    """Samples and frames of one walk since its release."""

    def __init__(self, batch: Batch, world: int, keep: Keep = EVERYTHING) -> None:
        """Begin with nothing.

        Args:
            batch: Where the walk runs; whether there are samples and frames, and how often, is up to it.
            world: Index.
            keep: Which of the samples are kept, and whether frames are.
        """
        self._batch, self._world, self._keep = batch, world, keep
        self._has_samples, self._has_frames = batch.record.samples.size > 0, batch.record.frames.size > 0
        self._interval = (keep.series_every or 1) * batch.options.record_interval
        self._place = -1.0
        self._last: Array = np.empty((0, layout.SAMPLE_COLUMNS))
        self._samples: list[Array] = []
        self._frame_times: list[Array] = []
        self._frames: list[Array] = []

    def drain(self, released: bool) -> None:
        """Take what the last launch wrote; forget it if that was before the release."""
        if self._has_samples:
            samples = self._batch.drain_samples(self._world)
            if released and self._keep.series_every is not None and len(samples):
                self._samples.append(self._thinned(samples))
                self._last = samples[-1:]
        if self._has_frames:
            times, frames = self._batch.drain_frames(self._world)
            if released and self._keep.frame_every is not None:
                self._frame_times.append(times)
                self._frames.append(frames)

    def _thinned(self, samples: Array) -> Array:
        """The first of the samples in each interval: steps may be longer than the time between two looks."""
        if self._keep.series_every == 1:
            return samples
        places = np.floor(samples[:, layout.TIME] / self._interval)
        is_first = np.diff(places, prepend=self._place) > 0
        self._place = places[-1]
        return samples[is_first]

    def samples(self) -> Array:
        """Samples (t, SAMPLE_COLUMNS), however few are kept the last one among them."""
        kept = np.concatenate([np.empty((0, layout.SAMPLE_COLUMNS)), *self._samples])
        is_there = len(kept) == 0 or kept[-1, layout.TIME] == self._last[0, layout.TIME]
        return kept if is_there else np.concatenate([kept, self._last])

    def frames(self, links: int) -> tuple[Array, Array]:
        """Times of the frames (f,) [s], joint positions (f, n, 2) [m]."""
        return (
            np.concatenate([np.empty(0), *self._frame_times]),
            np.concatenate([np.empty((0, links, 2)), *self._frames]),
        )

    def motion(self, links: int, sprocket_height: float = math.nan) -> Motion:
        """What a sweep keeps of the walk."""
        times, frames = self.frames(links)
        series, joints = self.samples()[:, SERIES_COLUMNS], frames.astype(np.float32)
        for array in (series, joints):  # which NaN a failed walk has may depend on the batch
            array[np.isnan(array)] = np.nan
        return Motion(
            series=series,
            frame_time=times,
            frame_joints=joints,
            sprocket_height=sprocket_height,
        )
