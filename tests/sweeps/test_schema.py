"""The JSON schema of sweep files."""

from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator

from tests.support.sweep_content import blocks, content
from tests.test_fuzz import SWEEPS
from warpchain.inputs.fields import NAME_OF_SYMBOL, SECTION_OF
from warpchain.inputs.yaml_files import read_yaml
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.sweep_file import sweep_schema

SCHEMA = Draft7Validator(sweep_schema())
SHIPPED = sorted((Path(__file__).parents[2] / "sweeps").glob("*.yaml"))


def test_it_is_a_schema_that_knows_all_names() -> None:
    """Names and symbols, with what they mean."""
    Draft7Validator.check_schema(SCHEMA.schema)
    axes = SCHEMA.schema["$defs"]["grid"]["properties"]
    assert set(axes) == {"preset", *SECTION_OF, *NAME_OF_SYMBOL}
    assert "friction" in SCHEMA.schema["$defs"]["parameters"]["properties"]["mu_fc"]["description"]


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_sweeps_are_valid(path: Path) -> None:
    """The schema takes every shipped sweep, and its canonical form; with a misspelt key it takes neither."""
    given = read_yaml(path)
    assert isinstance(given, dict)
    for whole in (given, load_sweep(path).canonical()):
        SCHEMA.validate(whole)
        assert not SCHEMA.is_valid(whole | {"sampels": 3})
        for key in ("scene", "options", "parameters", "grid", "distributions", "record"):
            assert not SCHEMA.is_valid(whole | {key: {"frequncy": [5]}})
        assert not SCHEMA.is_valid(whole | {"blocks": [{"name": "b", "gird": {}}]})


@pytest.mark.parametrize(
    "given",
    [
        *SWEEPS,
        content(scene={"n": 60, "load_factor": None}, grid=None, options={"method": "explicit", "self_contact": False}),
        content(grid={"floor": {"flat": "flat", "ramp": [[0, 0], [1, 0.1]]}}),
    ],
)
def test_what_a_sweep_may_say(given: dict[str, Any]) -> None:
    """The schema takes what `load_sweep` takes."""
    load_sweep(given)
    SCHEMA.validate(given)


@pytest.mark.parametrize(
    "given",
    [
        content(version=2),
        content(scene={"clearance": "1 cm"}),
        content(options={"method": "rk4"}),
        content(parameters={"m_outer": 0}),
        content(grid={"nu": [-5]}),
        content(grid={"floor": ["flat"]}),
        content(grid={"floor": {"ramp": "hill"}}),
        content(distributions={"gravity": {"gaussian": {"mean": 9}}}),
        content(record={"series": {"every": 2}}),
        blocks({"name": "a/b"}),
    ],
)
def test_what_a_sweep_may_not_say(given: dict[str, Any]) -> None:
    """The schema refuses what `load_sweep` refuses."""
    with pytest.raises(ValueError):
        load_sweep(given)
    assert not SCHEMA.is_valid(given)
