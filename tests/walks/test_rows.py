"""Rows of a shard: their columns, and what rows that are still to be filled in claim."""

import numpy as np
import pytest

from tests.support.made_walks import make_walk
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.store.block_result import BlockResult
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.rows import COLUMNS, KEYS, MISSING, field_column, fill_row, missing_rows, numbers_of, row_type
from warpchain.walks.walk_result import NUMBERS


def test_names_of_columns_mean_one_thing() -> None:
    """No column has the name of a quantity that may be drawn, or of an attribute of a result."""
    fields = {*Parameters.model_fields, *Scene.model_fields, *Options.model_fields}
    assert not fields & COLUMNS.keys()
    taken = {*dir(BlockResult), *dir(SweepResult), *BlockResult.__annotations__, *SweepResult.__annotations__}
    assert not taken & (fields | COLUMNS.keys())


def test_a_row_has_all_numbers_of_a_walk() -> None:
    """What a row keeps of a walk is what the walk says, wall time apart."""
    walk = make_walk()
    (row,) = missing_rows(row_type([]), np.zeros(1, KEYS))
    fill_row(row, vars(walk), {})
    found = numbers_of({name: row[name] for name in row.dtype.names})
    assert set(found) == NUMBERS.keys() - {"wall_time"}
    for name, value in found.items():
        np.testing.assert_equal(value, getattr(walk, name))


def test_fields_have_units() -> None:
    """Every field of a setup has a unit and a meaning, an unknown name none."""
    assert field_column("gravity").unit == "m/s²" and field_column("frequency").unit == "Hz"
    assert field_column("method").unit == field_column("preset").unit == "1"
    for name in (*Parameters.model_fields, *Scene.model_fields, *Options.model_fields):
        assert field_column(name).unit and len(field_column(name).meaning) > 5, name
    with pytest.raises(KeyError):
        field_column("lenght")


def test_missing_rows_claim_nothing() -> None:
    """Rows to fill in have their keys; all else is NaN or −1."""
    keys = np.zeros(3, KEYS)
    keys["sample"] = [5, 6, 7]
    rows = missing_rows(row_type(["phase"]), keys)
    assert rows["sample"].tolist() == [5, 6, 7] and set(rows["status"]) == {MISSING}
    for name in set(rows.dtype.names or ()) - set(KEYS.names or ()):
        assert np.isnan(rows[name]).all() if rows[name].dtype.kind == "f" else (rows[name] == -1).all(), name
