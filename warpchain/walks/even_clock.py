"""Time series on an even clock: samples are taken at the end of a step, rows are wanted at exact marks.

The integrator makes no step for a mark. Rows lie between the samples on either side, some 1 ms apart: places on the
cubic that has the places and velocities of both, everything else on the straight line. An impact between two samples
makes velocities and energies jump: there a row lies between the values before and after it, and a place is wrong by up
to an eighth of the jump times the time between the samples.
"""

import numpy as np

from warpchain.inputs.arrays import Array
from warpchain.kernels import layout

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
