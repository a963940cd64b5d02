"""Ways in which walks end: where and when the loop was lost, from the columns of a sweep.

Every walk that is at rest has one ending. Its loop collapses when it first encloses less than half of its area at the
release; `bounces_before_collapse` says in which bounce, counted from 1.
"""

from enum import IntEnum

import numpy as np

from studies.common import Array, Columns
from warpchain import Status

IN_FLIGHT = 0.01
"""Time since the last impulse on the floor [s] from which a chain is in flight; a later impulse begins a bounce."""


class Ending(IntEnum):
    """How a walk lost its loop."""

    UNKNOWN = -1
    KEPT = 0
    IN_FLIGHT = 1
    FIRST = 2
    SECOND = 3
    LATER = 4

    @property
    def label(self) -> str:
        """Name in files and tables, such as `folded_at_first`."""
        return self.name.lower()

    @property
    def meaning(self) -> str:
        """In words, as captions have it."""
        return _MEANINGS[self]


_MEANINGS: dict[Ending, str] = {
    Ending.UNKNOWN: "not at rest, or missing",
    Ending.KEPT: "at rest without having lost its loop",
    Ending.IN_FLIGHT: "collapsed in flight",
    Ending.FIRST: "collapsed in its first bounce",
    Ending.SECOND: "collapsed in its second bounce",
    Ending.LATER: "collapsed in a later bounce",
}


def endings(columns: Columns) -> Array:
    """The ending of each walk, as codes of `Ending`.

    Args:
        columns: of a sweep by name, such as those of a block: `status`, `collapsed_at`, `bounces_before_collapse` and
            `flight_before_collapse`, of one shape.

    Returns:
        Codes of the shape of the columns.
    """
    collapse = columns["bounces_before_collapse"]
    cases = (
        (columns["status"] != Status.AT_REST, Ending.UNKNOWN),
        (np.isnan(columns["collapsed_at"]), Ending.KEPT),
        ((collapse == 0) | (columns["flight_before_collapse"] > IN_FLIGHT), Ending.IN_FLIGHT),
        (collapse == 1, Ending.FIRST),
        (collapse == 2, Ending.SECOND),
    )
    codes = np.select([case for case, _ in cases], [code for _, code in cases], Ending.LATER)
    return codes.astype(np.int8)
