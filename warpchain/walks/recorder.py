"""Takes the time series and frames of a walk out of its world, between launches."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.kernels import layout
from warpchain.loop.before_release import BeforeRelease
from warpchain.walks.motion import Keep
from warpchain.walks.moving_plane import angles, frame_axes
from warpchain.walks.walk_result import BEFORE, MOTION

Array = NDArray[np.float64]


@dataclass(frozen=True)
class _Piece:
    """What one launch has recorded: samples (t, SAMPLE_COLUMNS), frames (f, n, 2) at times (f,), loads (f, n, 3)."""

    samples: Array
    frame_times: Array
    frames: Array
    loads: Array


class Recorder:
    """Samples and frames of one walk since its release, and of the last moments before if they are to be kept.

    Attributes:
        before: What is kept of the time before the release; None: nothing.
        keep: Which of the samples and frames are kept.
    """

    def __init__(self, batch: Batch, world: int, keep: Keep, tilts: bool = False) -> None:
        """Begin with nothing.

        Args:
            batch: Where the walk runs; whether it takes samples and frames, and how often, was decided with it.
            world: Index.
            keep: Which of the samples are kept, and whether frames are.
            tilts: Whether the plane of the chain moves; the batch then keeps it.
        """
        self.before: BeforeRelease | None = None
        self._batch, self._world, self.keep = batch, world, keep
        self._has_samples, self._has_frames = batch.record.samples.size > 0, batch.record.frames.size > 0
        self._place = -1.0
        self._width = batch.record.samples.shape[2]
        self._last: Array = np.empty((0, self._width))
        self._tilts = tilts
        self._planes: list[Array] = []
        self._samples: list[Array] = []
        self._frame_times: list[Array] = []
        self._frames: list[Array] = []
        self._loads: list[Array] = []
        self._drive: list[_Piece] = []

    def drain(self, released: bool) -> None:
        """Take what the last launch wrote; before the release only what `release` may want is kept."""
        if not released and self.keep.before > 0:
            self._drain_drive()
            return
        if self._has_samples:
            samples = self._batch.drain_samples(self._world)
            if released and self.keep.series_every is not None and len(samples):
                self._samples.append(self._thinned(samples, self.keep.series_every))
                self._last = samples[-1:]
        if self._has_frames:
            planes = self._batch.frame_planes(self._world)
            if released and self.keep.loads:
                self._loads.append(self._batch.frame_loads(self._world))
            times, frames = self._batch.drain_frames(self._world)
            if released and self.keep.frame_every is not None:
                self._frame_times.append(times)
                self._frames.append(frames)
                self._planes.append(planes)

    def _drain_drive(self) -> None:
        """Take what the last launch wrote, and forget what is too old already."""
        world = self._world
        samples = self._batch.drain_samples(world) if self._has_samples else np.empty((0, self._width))
        loads = self._batch.frame_loads(world)
        times, frames = self._batch.drain_frames(world)
        self._drive.append(_Piece(samples, times, frames, loads))
        oldest = self._batch.time(world) - self.keep.before
        while self._drive and _ends_before(self._drive[0], oldest):
            del self._drive[0]

    def release(self, moment: float, raised: float, earliest: float) -> None:
        """Keep what was recorded in the last moments of the drive, all of which has been drained.

        Args:
            moment: Of the release, by the clock of the drive [s].
            raised: Height [m] by which the chain was raised at the release.
            earliest: When the loop was last given its own loads [s]; nothing older is kept.
        """
        pieces, self._drive = self._drive, []
        if not pieces:
            return
        samples, times, frames, loads = (
            np.concatenate([getattr(piece, name) for piece in pieces])
            for name in ("samples", "frame_times", "frames", "loads")
        )
        oldest = max(moment - self.keep.before, earliest)
        is_wanted = (samples[:, layout.TIME] >= oldest) & (samples[:, layout.TIME] < moment)
        samples = samples[is_wanted]
        wanted = (times >= oldest) & (times < moment)
        raise_by = np.array([0.0, raised])
        self.before = BeforeRelease(
            time=samples[:, layout.TIME] - moment,
            center=samples[:, [layout.CENTER_X, layout.CENTER_Y]] + raise_by,
            center_velocity=samples[:, [layout.CENTER_U, layout.CENTER_V]],
            frame_time=times[wanted] - moment,
            frame_joints=frames[wanted] + raise_by,
            frame_forces=loads[wanted, :, :2],
            frame_moments=loads[wanted, :, 2],
        )

    def _thinned(self, samples: Array, every: int) -> Array:
        """The first of the samples in each interval; a step may be longer than the time between two sample marks."""
        if every == 1:
            return samples
        places = np.floor(samples[:, layout.TIME] / (every * self._batch.options.record_interval))
        is_first = np.diff(places, prepend=self._place) > 0
        self._place = places[-1]
        return samples[is_first]

    def samples(self) -> Array:
        """Samples (t, SAMPLE_COLUMNS) that are kept, and the last one in any case."""
        kept = np.concatenate([np.empty((0, self._width)), *self._samples])
        is_there = len(kept) == 0 or kept[-1, layout.TIME] == self._last[0, layout.TIME]
        return kept if is_there else np.concatenate([kept, self._last])

    def motion(self) -> dict[str, Any]:
        """The arrays of a `WalkResult` by name, and its `before_release`."""
        samples, links = self.samples(), self._batch.links[self._world]
        tilting = samples if self._tilts else np.empty((0, layout.ALL_COLUMNS))
        tilt, yaw = angles(tilting[:, layout.PLANE_COLUMN :])
        loads = np.concatenate([np.empty((0, links, 3)), *self._loads])
        planes = np.concatenate([np.empty((0, layout.PLANE_VALUES)), *(self._planes if self._tilts else [])])
        return {
            **{name: samples[:, stored.sample] for name, stored in MOTION.items() if stored.sample is not None},
            "center_z": tilting[:, layout.CENTER_Z],
            "tilt": tilt,
            "yaw": np.unwrap(yaw),
            "frame_time": np.concatenate([np.empty(0), *self._frame_times]),
            "frame_joints": np.concatenate([np.empty((0, links, 2)), *self._frames]),
            "frame_forces": loads[:, :, :2],
            "frame_moments": loads[:, :, 2],
            "frame_origin": planes[:, layout.ORIGIN : layout.ORIGIN + 3],
            "frame_axes": frame_axes(planes),
            BEFORE: self.before,
        }


def _ends_before(piece: _Piece, moment: float) -> bool:
    """Whether all of a piece is older than a moment [s]."""
    ends = [times[-1] for times in (piece.samples[:, layout.TIME], piece.frame_times) if len(times)]
    return all(end < moment for end in ends)
