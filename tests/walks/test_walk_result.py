"""Results of walks: what they hold, and the file that keeps them."""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tests.support.made_walks import assert_same, make_unreleased, make_walk
from warpchain.hdf5_files import hdf5_image
from warpchain.status import Status
from warpchain.walks.walk_result import ENERGIES, WalkResult, load_walk

# Status


def test_status_says_what_to_try() -> None:
    """Only rest and a finished simulation are good ends; every failure names a remedy, in one line."""
    assert [status for status in Status if status.ok] == [Status.AT_REST, Status.FINISHED, Status.DISTANCE_LIMIT]
    for status in Status:
        assert re.fullmatch(r"[A-Z][^\n]*\.", status.sentence), status
        assert ("; " in status.sentence) == (not status.ok), status


# The record itself


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("lowest", np.zeros(800)),
        ("center", np.zeros((801, 3))),
        ("frame_joints", np.zeros((41, 32, 2))),
        ("impulses", {"floor": 1}),
        ("energy", dict.fromkeys([*ENERGIES, "heat"], 0.0)),
    ],
)
def test_misshapen_fields_are_refused(field: str, value: Any) -> None:
    """A walk whose arrays or dictionaries don't fit together can't be made, and the error names the field."""
    with pytest.raises(ValueError, match=rf"^{field}: .*; give|^{field}: .*give") as caught:
        make_walk(**{field: value})
    assert "\n" not in str(caught.value)


def test_to_dict_is_json() -> None:
    """The dictionary is strict JSON, with None for what is not finite, and comes back equal."""
    walk = make_walk(dx=math.nan, greatest_opening=math.inf)
    described = walk.to_dict()
    assert json.loads(json.dumps(described, allow_nan=False)) == described
    assert described["dx"] is None and described["greatest_opening"] is None
    assert described["status"] == "at_rest" and described["status_sentence"] == Status.AT_REST.sentence
    assert described["seed"] == 2**100 + 1 and described["preset"] == "soft"
    assert described["parameters"]["floor_friction"] == 0.3 and described["options"]["method"] == "dp5"
    assert described["scene"]["links"] == 30 and described["impulses"]["self"] == 11
    assert {"walk_time", "simulated_time", "wall_time", "bounces", "steps_accepted", "steps_rejected"} < set(described)
    assert not {"time", "center", "frame_joints"} & set(described)


# The file


@pytest.mark.parametrize("make", [make_walk, make_unreleased])
def test_round_trip(make: Callable[[], WalkResult], tmp_path: Path) -> None:
    """A walk read back equals the one saved to the bit, NaN and absent parts included."""
    walk = make()
    walk.save(tmp_path / "walk.h5")
    assert_same(load_walk(tmp_path / "walk.h5"), walk)
    assert [path.name for path in tmp_path.iterdir()] == ["walk.h5"]


def _refused(path: Path) -> str:
    with pytest.raises(ValueError) as caught:
        load_walk(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ") and "; " in text and "\n" not in text
    return text


def test_foreign_files_are_refused(tmp_path: Path) -> None:
    """Text, an empty file, other HDF5, and other files of warpchain are told apart."""
    path = tmp_path / "walk.h5"
    path.write_text("dx = 0.6\n")
    assert "not an HDF5 file" in _refused(path)
    path.write_bytes(b"")
    assert "not an HDF5 file" in _refused(path)
    with h5py.File(path, "w") as file:
        file["x"] = 1.0
    assert "damaged, cut short or of an earlier warpchain" in _refused(path)
    path.write_bytes(hdf5_image("another kind", lambda file: None))
    assert "a another kind, not a warpchain walk" in _refused(path)
