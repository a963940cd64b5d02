"""Ways in which walks end, from the columns of a sweep: every walk that is at rest has one.

Its loop collapses when it first encloses less than half of its area at the release; `bounces_before_collapse` says in
which bounce, counted from 1.
"""

from enum import IntEnum

import numpy as np

from studies.common import Array, Columns
from warpchain import Status

IN_FLIGHT = 0.01  # Time since the last impulse on the floor [s] from which a chain is in flight


class Ending(IntEnum):
    """How a walk lost its loop; `meaning` in words, as captions have it."""

    meaning: str

    UNKNOWN = -1, "not at rest, or missing"
    KEPT = 0, "at rest without having lost its loop"
    IN_FLIGHT = 1, "collapsed in flight"
    FIRST = 2, "collapsed in its first bounce"
    SECOND = 3, "collapsed in its second bounce"
    LATER = 4, "collapsed in a later bounce"

    def __new__(cls, code: int, meaning: str) -> "Ending":
        """A code with its meaning."""
        ending = int.__new__(cls, code)
        ending._value_, ending.meaning = code, meaning
        return ending

    @property
    def label(self) -> str:
        """Name in files and tables, such as `in_flight`."""
        return self.name.lower()


def endings(columns: Columns) -> Array:
    """The ending of each walk, as codes of `Ending`.

    Columns are those of a sweep, or of a block, by name, of one shape: `status`, `collapsed_at`,
    `bounces_before_collapse` and `flight_before_collapse`.
    """
    collapse = columns["bounces_before_collapse"]
    cases = (
        (columns["status"] != Status.AT_REST, Ending.UNKNOWN),
        (np.isnan(columns["collapsed_at"]), Ending.KEPT),
        ((collapse == 0) | (columns["flight_before_collapse"] > IN_FLIGHT), Ending.IN_FLIGHT),
        (collapse == 1, Ending.FIRST),
        (collapse == 2, Ending.SECOND),
    )
    return np.select(*zip(*cases, strict=True), Ending.LATER).astype(np.int8)
