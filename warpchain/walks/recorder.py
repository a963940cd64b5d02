"""Takes the time series and frames of a walk out of its world, between launches."""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.kernels import layout
from warpchain.loop.before_release import BEFORE, BeforeRelease
from warpchain.walks.even_clock import EvenClock
from warpchain.walks.motion import Keep
from warpchain.walks.moving_plane import angles, frame_axes

Array = NDArray[np.float64]

SERIES: Final[dict[str, int | list[int]]] = {
    "time": layout.TIME,
    "center": [layout.CENTER_X, layout.CENTER_Y],
    "center_velocity": [layout.CENTER_U, layout.CENTER_V],
    "kinetic_energy": layout.KINETIC,
    "gravitational_energy": layout.GRAVITATIONAL,
    "spring_energy": layout.SPRING,
    "lowest": layout.LOWEST,
    "rms_speed": layout.RMS_SPEED,
}
"""Arrays of a `WalkResult` that are columns of the samples."""


@dataclass(kw_only=True)
class _Piece:
    """What one launch has recorded: t samples and f frames of a chain of n links.

    Attributes:
        samples: Shape (t, columns of a sample).
        times: Of the frames [s], shape (f,).
        frames: Joints [m], shape (f, n, 2).
        loads: Forces [N] and moment [N m] of each joint, shape (f, n, 3); f is 0 if they are not kept.
        planes: Of the frames, shape (f, PLANE_VALUES).
    """

    samples: Array
    times: Array
    frames: Array
    loads: Array
    planes: Array


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
        self._width = batch.record.samples.shape[2]
        self._clock = EvenClock((keep.series_every or 1) * batch.options.record_interval, self._width)
        self._tilts = tilts
        self._drive: list[_Piece] = []
        self._pieces: list[_Piece] = []

    def _nothing(self) -> _Piece:
        """What a launch has recorded that recorded nothing."""
        links = self._batch.links[self._world]
        return _Piece(
            samples=np.empty((0, self._width)),
            times=np.empty(0),
            frames=np.empty((0, links, 2)),
            loads=np.empty((0, links, 3)),
            planes=np.empty((0, layout.PLANE_VALUES)),
        )

    def drain(self, released: bool) -> None:
        """Take what the last launch wrote; before the release only what `release` may want is kept."""
        piece, keep, batch, world = self._nothing(), self.keep, self._batch, self._world
        if self._has_samples:
            samples = batch.drain_samples(world)
            if not released:
                piece.samples = samples
            elif keep.series_every is not None:
                piece.samples = self._clock.rows(samples)
        if self._has_frames:
            if self._tilts and released:
                piece.planes = batch.frame_planes(world)
            if keep.loads or not released:
                piece.loads = batch.frame_loads(world)
            piece.times, piece.frames = batch.drain_frames(world)
        if keep.frame_every is None:
            piece = replace(self._nothing(), samples=piece.samples)
        if released:
            self._pieces.append(piece)
        elif keep.before > 0:
            self._drive.append(piece)
            oldest = batch.time(world) - keep.before
            while self._drive and _ends_before(self._drive[0], oldest):
                del self._drive[0]

    def _joined(self, pieces: list[_Piece], *names: str) -> list[Array]:
        """Attributes of pieces, each of all one behind the other."""
        return [np.concatenate([getattr(piece, name) for piece in (self._nothing(), *pieces)]) for name in names]

    def release(self, moment: float, raised: float, earliest: float) -> None:
        """Keep what was recorded in the last moments of the drive, all of which has been drained.

        Args:
            moment: Of the release, by the clock of the drive [s].
            raised: Height [m] by which the chain was raised at the release.
            earliest: When the loop was last given its own loads [s]; nothing older is kept.
        """
        if not self._drive:
            return
        samples, times, frames, loads = self._joined(self._drive, "samples", "times", "frames", "loads")
        oldest = max(moment - self.keep.before, earliest)
        samples = samples[(samples[:, layout.TIME] >= oldest) & (samples[:, layout.TIME] < moment)]
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

    def go_on(self, last: Array, time: float) -> None:
        """Begin within a walk at a time [s], with the sample before, (columns,)."""
        if last[layout.TIME] >= 0:
            self._clock.go_on(last, time)

    def motion(self) -> dict[str, Any]:
        """The arrays of a `WalkResult` by name, and its `before_release`."""
        names = ("samples", "times", "frames", "loads", "planes")
        samples, frame_time, joints, loads, planes = self._joined(self._pieces, *names)
        last = self._clock.last
        samples = np.concatenate([samples, last[~np.isin(last[:, layout.TIME], samples[-1:, layout.TIME])]])
        tilting = samples if self._tilts else np.empty((0, layout.ALL_COLUMNS))
        tilt, yaw = angles(tilting[:, layout.PLANE_COLUMN :])
        return {
            **{name: samples[:, columns] for name, columns in SERIES.items()},
            "center_z": tilting[:, layout.CENTER_Z],
            "tilt": tilt,
            "yaw": np.unwrap(yaw),
            "frame_time": frame_time,
            "frame_joints": joints,
            "frame_forces": loads[:, :, :2],
            "frame_moments": loads[:, :, 2],
            "frame_origin": planes[:, layout.ORIGIN : layout.ORIGIN + 3],
            "frame_axes": frame_axes(planes),
            BEFORE: self.before,
        }


def _ends_before(piece: _Piece, moment: float) -> bool:
    """Whether all of a piece is older than a moment [s]."""
    ends = [times[-1] for times in (piece.samples[:, layout.TIME], piece.times) if len(times)]
    return all(end < moment for end in ends)
