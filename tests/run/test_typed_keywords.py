"""Types of keyword arguments say what the models check; a type checker finds a misspelt or ill-typed setting."""

import subprocess
import sys
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import pytest

from warpchain.inputs import keywords
from warpchain.inputs.methods import METHODS, METHODS_BY_NEED
from warpchain.inputs.parameters import PRESETS
from warpchain.inputs.scene import Scene
from warpchain.inputs.sections import SECTIONS, SYMBOL_OF
from warpchain.sweeps.designs import SAMPLERS

ROOT = Path(__file__).parents[2]
TYPES: dict[Any, Any] = {
    int: keywords.Whole,
    float: keywords.Number,
    float | None: keywords.Number | None,
    bool: keywords.Truth,
    str: str,
    Scene.model_fields["link_masses"].annotation: keywords.Numbers | None,
}
"""Type of a field → that of the keyword."""

SNIPPET = """
import numpy as np
import warpchain
warpchain.walk(floor_friction=0.3, e_fc=0.1, links=np.int64(60), frequency=15, method="dp5", self_contact=False)
warpchain.walk(floor_frictoin=3)
warpchain.walk(floor_friction="3")
warpchain.walk(method="dp6")
warpchain.walk(start="flying")
warpchain.sweep(grid={"links": np.arange(20, 60, 10)}, samples=2, scene={"start": "rest"}, out="here")
warpchain.sweep(grid={"links": [40]}, samples=2, scene={"strat": "rest"}, out="here")
state = np.zeros((8, 3))
warpchain.simulate("soft", state, state, 1.0, skin=1e-3)
warpchain.simulate("soft", state, state, 1.0, links=8)
"""
WRONG = {5, 6, 7, 8, 10, 13}
"""Lines of the snippet that must be refused; all others are accepted."""


def hints_of(section: str) -> dict[str, Any]:
    """Types of the keywords of a section."""
    names = {"scene": "SceneSettings", "options": "OptionSettings", "parameters": "ParameterSettings"}
    return get_type_hints(getattr(keywords, names[section]))


@pytest.mark.parametrize("section", SECTIONS)
def test_keywords_are_the_fields(section: str) -> None:
    """Each field has a keyword of the same type, numbers of NumPy's included, and there is no other."""
    fields, hints = SECTIONS[section].model_fields, hints_of(section)
    symbols = {symbol: name for name, symbol in SYMBOL_OF.items() if name in fields}
    assert hints.keys() == fields.keys() | symbols.keys()
    assert all(hints[symbol] == hints[name] for symbol, name in symbols.items())
    for name, field in fields.items():
        is_literal = get_origin(field.annotation) is Literal
        expected = keywords.Method if name == "method" else field.annotation if is_literal else TYPES[field.annotation]
        assert hints[name] == expected, name


def test_names_are_all_there() -> None:
    """Methods, presets and samplers."""
    assert set(get_args(keywords.Method)) == {*METHODS, *METHODS_BY_NEED}
    assert set(get_args(keywords.Preset)) == set(PRESETS)
    assert set(get_args(keywords.Sampler)) == set(SAMPLERS)


@pytest.mark.slow
def test_a_type_checker_finds_wrong_settings(tmp_path: Path) -> None:
    """mypy refuses a misspelt name, a text for a number and an unknown method, and accepts what is right."""
    pytest.importorskip("mypy")
    path = tmp_path / "snippet.py"
    path.write_text(SNIPPET, encoding="utf-8")
    flags = (
        "--config-file",
        str(ROOT / "pyproject.toml"),
        "--no-error-summary",
        "--cache-dir",
        str(tmp_path / "cache"),
    )
    command = [sys.executable, "-m", "mypy", *flags, str(path)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", cwd=ROOT)
    errors = [line for line in done.stdout.splitlines() if ": error: " in line]
    assert {int(line.split("snippet.py:")[1].partition(":")[0]) for line in errors} == WRONG, done.stdout + done.stderr
    assert 'Unexpected keyword argument "floor_frictoin" for "walk"' in done.stdout
