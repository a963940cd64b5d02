"""Time series on an even clock: samples are taken at the end of a step, rows are wanted at exact marks.

The integrator makes no step for a mark. Rows lie between the samples on either side, some 1 ms apart: places on the
cubic that has the places and velocities of both, everything else on the straight line. An impact between two samples
makes velocities and energies jump: there a row lies between the values before and after it, and a place is wrong by up
to an eighth of the jump times the time between the samples.
"""

import numpy as np
from numpy.typing import NDArray

from warpchain.kernels import layout

Array = NDArray[np.float64]

_PLACES = (
    (layout.CENTER_X, layout.CENTER_U),
    (layout.CENTER_Y, layout.CENTER_V),
    (layout.CENTER_Z, layout.CENTER_W),
)
"""Columns of a sample: a place, and its velocity."""


def between(samples: Array, times: Array) -> Array:
    """Rows at some times within a series of at least two samples; one at the time of a sample is that sample.

    Args:
        samples: shape (t, columns of a sample), times rising.
        times: [s], rising.
    """
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


class EvenClock:
    """Rows at whole multiples of an interval, from samples that come in pieces.

    Attributes:
        last: The latest sample, shape (1, columns), or (0, columns) before the first.
    """

    def __init__(self, interval: float, columns: int) -> None:
        """Begin before the first sample; interval [s]: between two marks."""
        self.last: Array = np.empty((0, columns))
        self._interval = interval
        self._next = 0

    def go_on(self, last: Array, time: float) -> None:
        """Begin between two samples, the first of which was `last`, (columns,), with the mark after a time [s]."""
        self.last, self._next = last[None, : self.last.shape[1]].copy(), self._passed(time)

    def rows(self, samples: Array) -> Array:
        """Rows at the marks up to the last of some more samples; the very first sample is a row as it is."""
        if not len(samples):
            return samples
        start = samples[:0] if len(self.last) else samples[:1]
        known = np.concatenate([self.last, samples])
        if len(start):
            self._next = self._passed(start[0, layout.TIME])
        end = self._passed(known[-1, layout.TIME])
        marks = np.arange(self._next, end, dtype=np.float64) * self._interval
        self._next, self.last = max(self._next, end), samples[-1:].copy()
        return np.concatenate([start, between(known, marks)]) if len(marks) else start

    def _passed(self, time: float) -> int:
        """Number of the first mark after a time [s]."""
        mark = int(time / self._interval)
        while mark * self._interval <= time:
            mark += 1
        while (mark - 1) * self._interval > time:
            mark -= 1
        return mark
