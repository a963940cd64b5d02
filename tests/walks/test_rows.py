"""Rows of a shard: their columns, and what rows that are still to be filled in claim."""

import numpy as np

from tests.support.made_walks import make_walk
from warpchain.walks.rows import KEYS, fill_row, missing_rows, numbers_of, row_type
from warpchain.walks.walk_result import NUMBERS


def test_a_row_has_all_numbers_of_a_walk() -> None:
    """What a row keeps of a walk is what the walk says, wall time apart."""
    walk = make_walk()
    (row,) = missing_rows(row_type([]), np.zeros(1, KEYS))
    fill_row(row, vars(walk), {})
    found = numbers_of({name: row[name] for name in row.dtype.names})
    assert set(found) == NUMBERS.keys() - {"wall_time"}
    for name, value in found.items():
        np.testing.assert_equal(value, getattr(walk, name))
