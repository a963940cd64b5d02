"""Takes the time series and frames of a walk out of its world, between launches; series have an even clock.

Samples are taken at the end of a step, rows are wanted at exact marks, and the integrator makes no step for a mark.
Rows lie between the samples on either side, some 1 ms apart: places on the cubic that has the places and velocities of
both, everything else on the straight line. An impact between two samples makes velocities and energies jump: there a
row lies between the values before and after it, and a place is wrong by up to an eighth of the jump times the time
between the samples.
"""

from typing import Any, Final

import numpy as np

from warpchain.chain.keep import Keep
from warpchain.chain.setup import Setup
from warpchain.engine.world import Recorded, World
from warpchain.inputs.arrays import Array
from warpchain.kernels import layout
from warpchain.loop.stationary_loop import BEFORE_RELEASE, BeforeRelease
from warpchain.walks.moving_plane import angles, frame_axes

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


class Recorder:
    """Samples and frames of one walk since its release, and of the last moments before if they are to be kept."""

    def __init__(self, world: World, keep: Keep, setup: Setup) -> None:
        """Begin with nothing; how often samples and frames are taken, the batch of the world has decided."""
        self.before: BeforeRelease | None = None
        self._world, self.keep, self._tilts = world, keep, setup.scene.plane == "tilting"
        self._interval = (keep.series_every or 1) * setup.options.record_interval
        self._drive: list[tuple[float, Recorded]] = []  # with the time at which the launch ended [s]
        self._pieces: list[Recorded] = []
        self._after: float | None = None

    def drain(self, released: bool) -> None:
        """Take what the last launch wrote; before the release only what `release` may want is kept."""
        if not self._world.records:
            return
        piece, keep = self._world.drain(), self.keep
        if released:
            series, frames = keep.series_every is not None, keep.frame_every is not None
            wanted = zip(piece, (series, frames, frames, keep.loads, frames and self._tilts), strict=True)
            self._pieces.append(Recorded(*(rows if is_kept else rows[:0].copy() for rows, is_kept in wanted)))
        elif keep.before > 0:
            until = self._world.time
            self._drive = [*(each for each in self._drive if each[0] >= until - keep.before), (until, piece)]

    def latest_frames(self) -> tuple[Array, Array]:
        """Times [s] of the frames that were drained last, and their joints in the room [m], (f, n, 2), or (f, n, 3)."""
        if not self._pieces:
            return np.empty(0), np.empty((0, 0, 2))
        _, times, joints, _, planes = self._pieces[-1]
        origin = planes[:, None, layout.ORIGIN : layout.ORIGIN + 3]
        return times, origin + joints @ frame_axes(planes) if self._tilts else joints

    def _joined(self, pieces: list[Recorded]) -> Recorded:
        """All pieces, one behind the other; nothing has been recorded since."""
        return Recorded(*map(np.concatenate, zip(*pieces, self._world.drain(), strict=True)))

    def release(self, moment: float, raised: float, earliest: float) -> None:
        """Keep what was recorded in the last moments of the drive, all of which has been drained.

        The chain was raised by so much [m] at the moment of the release, by the clock of the drive [s]. Nothing is kept
        from before the earliest, when the loop was last given its own loads.
        """
        if not self._drive:
            return
        samples, times, frames, loads, _ = self._joined([piece for _, piece in self._drive])
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
        if last[layout.TIME] >= 0 and self.keep.series_every is not None:
            nothing = self._world.drain()
            self._pieces.append(nothing._replace(samples=last[None, : nothing.samples.shape[1]].copy()))
            self._after = time

    def motion(self, datum: float = 0.0) -> dict[str, Any]:
        """The arrays of a `WalkResult` by name, and its `before_release`; `datum`: of potential energies [J]."""
        samples, times, frames, loads, planes = self._joined(self._pieces)
        samples = even_rows(samples, self._interval, self._after)
        samples[:, layout.GRAVITATIONAL] -= datum
        tilting = samples if self._tilts else np.empty((0, layout.ALL_COLUMNS))
        tilt, yaw = angles(tilting[:, layout.PLANE_COLUMN :])
        return {
            **{name: samples[:, columns] for name, columns in SERIES.items()},
            "center_z": tilting[:, layout.CENTER_Z],
            "tilt": tilt,
            "yaw": np.unwrap(yaw),
            "frame_time": times,
            "frame_joints": frames,
            "frame_forces": loads[:, :, :2],
            "frame_moments": loads[:, :, 2],
            "frame_origin": planes[:, layout.ORIGIN : layout.ORIGIN + 3],
            "frame_axes": frame_axes(planes),
            BEFORE_RELEASE: self.before,
        }


_PLACES = ((layout.CENTER_X, layout.CENTER_U), (layout.CENTER_Y, layout.CENTER_V), (layout.CENTER_Z, layout.CENTER_W))
"""Columns of a sample: a place, and its velocity."""


def between(samples: Array, times: Array) -> Array:
    """Rows at rising times [s] within two samples or more, (t, columns); one at the time of a sample is that sample."""
    clock = samples[:, layout.TIME]
    later = np.clip(np.searchsorted(clock, times), 1, len(samples) - 1)
    first, second = samples[later - 1], samples[later]
    change, span = second - first, (clock[later] - clock[later - 1])
    share = (times - clock[later - 1]) / span
    rows: Array = first + share[:, None] * change
    for place, velocity in _PLACES:
        if place < samples.shape[1]:
            bend_first, bend_second = (span * row[:, velocity] - change[:, place] for row in (first, second))
            rows[:, place] += share * (1 - share) * ((1 - share) * bend_first - share * bend_second)
    is_sample = clock[later] == times
    rows[is_sample] = second[is_sample]
    rows[:, layout.TIME] = times
    return rows


def even_rows(samples: Array, interval: float, after: float | None = None) -> Array:
    """Rows at whole multiples of an interval [s] from the first to the last of some samples, and these two as they are.

    To a walk that goes on `after` a time [s] the first sample does not belong: marks begin after that.
    """
    clock = samples[:, layout.TIME]
    if not len(samples):
        return samples
    first, last = (_passed(time, interval) for time in (clock[0] if after is None else after, clock[-1]))
    marks = np.arange(first, last, dtype=np.float64) * interval
    rows = between(samples, marks) if len(marks) else samples[:0]
    begin = samples[: after is None]
    is_row = clock[-1] in (*marks[-1:], *begin[:, layout.TIME])
    return np.concatenate([begin, rows, samples[len(samples) - (not is_row) :]])


def _passed(time: float, interval: float) -> int:
    """Number of the first mark after a time [s]."""
    mark = int(time / interval)
    while mark * interval <= time:
        mark += 1
    while (mark - 1) * interval > time:
        mark -= 1
    return mark
