"""What every benchmark writes."""

import json
import math
from dataclasses import dataclass
from typing import Annotated

from warpchain.bench.record import Column, columns_of, machine, plain


@dataclass(frozen=True)
class Row:
    """A row of a table."""

    speed: Annotated[float, Column("m/s", "how fast")]
    note: str = ""


def test_json_holds_everything_and_no_nan() -> None:
    """Dataclasses are objects at any depth, tuples lists, and what is not finite is null."""
    value = {"rows": (Row(1.5), Row(math.nan, "unknown")), "one": Row(-math.inf), "counts": {"a": [1, math.nan]}}
    assert plain(value) == {
        "rows": [{"speed": 1.5, "note": ""}, {"speed": None, "note": "unknown"}],
        "one": {"speed": None, "note": ""},
        "counts": {"a": [1, None]},
    }
    json.dumps(plain(value), allow_nan=False)


def test_columns_are_the_annotated_fields() -> None:
    """A field without unit and meaning is no column."""
    assert columns_of(Row) == {"speed": Column("m/s", "how fast")}


def test_the_machine_has_a_processor_and_versions() -> None:
    """Nothing of it is empty."""
    about = machine()
    assert all(about.values()) and {"processor", "system", "warpchain", "warp-lang", "numpy"} <= set(about)
