"""Ways in which walks end, from the columns of a sweep."""

import math

import numpy as np
import pytest

from warpchain.kernels.events.tallies import BOUNCE_PAUSE
from warpchain.status import Status
from warpchain.walks.endings import IN_FLIGHT, Ending, endings
from warpchain.walks.rows import missing_rows, row_type

NAN = math.nan


def row(status: int, collapsed_at: float, collapse: int, flight: float, contact: int) -> np.ndarray:
    """One row of a sweep with these columns, the others missing."""
    rows = missing_rows(row_type([]), range(1))
    rows["status"], rows["collapsed_at"], rows["bounces_before_collapse"] = status, collapsed_at, collapse
    rows["flight_before_collapse"], rows["bounces_before_self_contact"] = flight, contact
    return rows


@pytest.mark.parametrize(
    ("columns", "ending"),
    [
        ((-1, NAN, -1, NAN, -1), Ending.UNKNOWN),
        ((Status.NOT_STEADY, NAN, -1, NAN, -1), Ending.UNKNOWN),
        ((Status.TIME_LIMIT, 0.5, 3, 0.0, 2), Ending.UNKNOWN),
        ((Status.AT_REST, NAN, -1, NAN, -1), Ending.KEPT),
        ((Status.AT_REST, NAN, -1, NAN, 4), Ending.KEPT),
        ((Status.AT_REST, 0.03, 0, NAN, -1), Ending.IN_FLIGHT),
        ((Status.AT_REST, 0.5, 1, 0.011, 1), Ending.IN_FLIGHT),
        ((Status.AT_REST, 0.5, 1, 0.009, 1), Ending.FIRST),
        ((Status.AT_REST, 0.5, 1, 0.0, -1), Ending.FIRST),
        ((Status.AT_REST, 0.5, 2, 0.0, 1), Ending.SECOND),
        ((Status.AT_REST, 0.5, 7, 0.0, -1), Ending.LATER),
        ((Status.AT_REST, 0.5, 7, 0.0, 7), Ending.LATER),
        ((Status.AT_REST, 0.5, 7, 0.0, 8), Ending.LATER),
        ((Status.AT_REST, 0.5, 7, 0.0, 0), Ending.FOLDED_AT_FIRST),
        ((Status.AT_REST, 0.5, 3, 0.0, 1), Ending.FOLDED_AT_FIRST),
        ((Status.AT_REST, 0.5, 3, 0.0, 2), Ending.FOLDED_AT_SECOND),
        ((Status.AT_REST, 0.5, 7, 0.0, 6), Ending.FOLDED_LATER),
    ],
)
def test_every_case_has_its_ending(columns: tuple[int, float, int, float, int], ending: Ending) -> None:
    """Status first, then where the loop collapsed, then in which bounce it had touched itself before."""
    assert endings(row(*columns)).tolist() == [ending]


def test_endings_have_the_shape_of_the_columns() -> None:
    """Columns of a block come in the shape of its grid."""
    one = row(Status.AT_REST, 0.5, 3, 0.0, 2)
    columns = {name: np.broadcast_to(one[name], (2, 3, 4)) for name in one.dtype.names or ()}
    found = endings(columns)
    assert found.shape == (2, 3, 4) and found.dtype == np.int8 and set(found.ravel()) == {Ending.FOLDED_AT_SECOND}


def test_flight_is_what_ends_a_bounce() -> None:
    """A chain is in flight as soon as an impulse on the floor would begin a new bounce."""
    assert float(BOUNCE_PAUSE) == IN_FLIGHT


def test_endings_are_named() -> None:
    """Each has a label and a meaning of its own."""
    assert len({each.label for each in Ending}) == len({each.meaning for each in Ending}) == len(Ending) == 9
