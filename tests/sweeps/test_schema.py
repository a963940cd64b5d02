"""The JSON schema of sweep files."""

from pathlib import Path
from typing import Any

import pytest

from tests.support.json_schema import problems
from tests.support.sweep_content import UNIFORM, blocks, content
from warpchain.inputs.sections import NAME_OF_SYMBOL, SECTION_OF, SECTIONS
from warpchain.inputs.yaml_files import read_yaml
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.schema import sweep_schema
from warpchain.sweeps.sweep_file import _BLOCK_KEYS, _TOP_KEYS

SCHEMA = sweep_schema()
SHIPPED = sorted((Path(__file__).parents[2] / "sweeps").glob("*.yaml"))


def refused(given: object) -> list[str]:
    """What the schema refuses in the content of a file."""
    return list(problems(given, SCHEMA, SCHEMA))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_sweeps_are_valid(path: Path) -> None:
    """The schema takes every shipped sweep, and its canonical form; with a misspelt key it takes neither."""
    given = read_yaml(path)
    assert isinstance(given, dict)
    for whole in (given, load_sweep(path).canonical()):
        assert refused(whole) == []
        assert refused(whole | {"sampels": 3}) == ["$: additionalProperties"]
        for key in ("scene", "options", "parameters", "grid", "distributions", "record"):
            assert refused(whole | {key: {"frequncy": [5]}})[0] == f"$.{key}: additionalProperties"
        assert refused(whole | {"blocks": [{"name": "b", "gird": {}}]})[0] == "$.blocks[0]: additionalProperties"


def test_its_keys_are_those_of_a_file() -> None:
    """Top, block and sections of the schema know the keys that a file may have, names and symbols, and no others."""
    definitions = SCHEMA["definitions"]
    assert set(SCHEMA["properties"]) == set(_TOP_KEYS)
    assert set(definitions["block"]["properties"]) == set(_BLOCK_KEYS)
    assert set(definitions["grid"]["properties"]) == {"preset", *SECTION_OF, *NAME_OF_SYMBOL}
    for section, model in SECTIONS.items():
        symbols = {symbol for symbol, name in NAME_OF_SYMBOL.items() if name in model.model_fields}
        assert set(definitions[section]["properties"]) == model.model_fields.keys() | symbols


@pytest.mark.parametrize(
    "given",
    [
        content(),
        content(scene=None, grid=None),
        content(scene={"n": 60, "load_factor": None}, grid=None, options={"method": "explicit", "self_contact": False}),
        content(grid={"nu": {"from": 5, "to": 30, "count": 6}, "start": ["rest", "ellipse"]}),
        content(grid={"preset": ["paper", "soft"]}, preset=None, parameters={"mu_fc": 0.3}),
        content(distributions={"all": "fixed", "tau_c": {"gaussian": {"sigma": 2e-5}}, "g": UNIFORM}),
        content(record={"series": True, "frames": {"samples": [0], "interval": 0.01, "before": 0.5}}),
        blocks({"samples": 1}, same_samples_along=[]),
    ],
)
def test_what_a_sweep_may_say(given: dict[str, Any]) -> None:
    """The schema takes what `load_sweep` takes."""
    load_sweep(given)
    assert refused(given) == []


@pytest.mark.parametrize(
    "given",
    [
        content(version=2),
        content(name=None),
        content(name=""),
        content(samples=0),
        content(samples=1.5),
        content(preset="hard"),
        content(sampler="sobl"),
        content(scene={"links": "many"}),
        content(scene={"links": 2}),
        content(scene={"clearance": "1 cm"}),
        content(scene={"start": "up"}),
        content(options={"method": "rk4"}),
        content(options={"self_contact": 1}),
        content(parameters={"outer_mass": 0}),
        content(parameters={"m_outer": 0}),
        content(grid={"links": 60}),
        content(grid={"links": []}),
        content(grid={"nu": [-5]}),
        content(grid={"start": {"from": 1, "to": 2, "step": 1}}),
        content(grid={"frequency": {"from": 5, "to": 10, "step": 5, "count": 2}}),
        content(distributions={"links": "fixed"}),
        content(distributions={"gravity": "table"}),
        content(distributions={"gravity": {"uniform": [9]}}),
        content(distributions={"gravity": {"gaussian": {"mean": 9}}}),
        content(record={"series": {"every": 2}}),
        content(blocks=[{"name": "b"}]),
        blocks({"name": "a/b"}),
    ],
)
def test_what_a_sweep_may_not_say(given: dict[str, Any]) -> None:
    """The schema refuses what `load_sweep` refuses."""
    with pytest.raises(ValueError):
        load_sweep(given)
    assert refused(given) != []
