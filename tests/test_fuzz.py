"""Hostile settings, sweeps and command lines end soon: in what they say, or in short lines that refuse them.

`pytest tests/test_fuzz.py --hypothesis-profile=long` tries for minutes.
"""

import contextlib
import copy
import io
import json
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.support.setups import setup_walk
from tests.support.sweep_content import blocks, content
from warpchain.chain.resolution import resolve
from warpchain.cli.main import main
from warpchain.inputs.fields import FIELDS, NAME_OF_SYMBOL
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import LONGEST_LINE, InputError
from warpchain.results import one_walk
from warpchain.sweeps.plan import load_sweep

SECONDS = 5.0
"""Most processor time of an input."""

hostile_inputs = settings(deadline=None, suppress_health_check=list(HealthCheck))

NUMBERS = st.one_of(
    st.integers(-5, 200),
    st.floats(),
    st.sampled_from([0.1, 1e-9, 1e9, 2**53 + 1, 2**63, 10**400, 5e-324, -0.0, 1.7e308]),
)
TEXTS = st.one_of(
    st.text(max_size=30), st.sampled_from(["", "\x1b[2J", "\u202e", "\ud800", "15 Hz", "060", "x" * 3000])
)
OBJECTS = st.sampled_from(
    [None, 1j, b"60", object(), range(30, 60, 10), range(10**30), np.float32(0.1), np.longdouble("1e4000"), np.bool_(1),
     np.timedelta64(60, "s"), np.zeros(10**6), np.array(60), np.array([30, 32], np.uint8), np.array([object()]),
     np.zeros(2, "i4,f8"), np.ma.masked, np.nan, int, {1: 2}, {(1, 2): 3}, {"from": 30, "to": 60, "step": 10}]
)  # fmt: skip
HOSTILE = st.recursive(
    st.one_of(NUMBERS, st.booleans(), TEXTS, OBJECTS),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(TEXTS, inner, max_size=3)),
    max_leaves=8,
)
NAMES = st.one_of(st.sampled_from([*FIELDS, *NAME_OF_SYMBOL, "preset", "grid", "blocks", "__class__", "<<"]), TEXTS)
VALUES = {name: value for model in (preset("soft"), Scene(), Options()) for name, value in model.model_dump().items()}

# Inputs: good ones, some of whose parts were replaced, renamed or moved

LAWS = {"mu_fc": {"uniform": [0.2, 0.4]}, "g": {"gaussian": {"mean": 9.8, "sigma": 0.1}}, "phase": "table"}
SWEEPS = [
    content(record={"series": True, "frames": {"samples": [0, 1], "interval": 0.01, "before": 0.5}}),
    content(grid={"nu": {"from": 5, "to": 30, "count": 6}, "start": ["rest", "ellipse"]}, distributions=LAWS),
    content(points={"n": [60, 90], "mu_fc": [0.3, 0.2]}, grid=None, scene={"floor": [[0, 0], [1, 0]]}, options={}),
    content(grid={"preset": ["paper", "soft"]}, preset=None, parameters={"mu_fc": 0.3}, same_samples_along=["preset"]),
    blocks({"samples": 4, "sampler": "saltelli"}, {"samples": 1, "distributions": {"all": "fixed"}}),
]
SETTINGS = [{name: value for name, value in VALUES.items() if value is not None}, {}, {"n": 40, "nu": 5, "e_fc": 0.5}]


def places(whole: Any) -> list[tuple[Any, Any]]:
    """Each mapping or list in a value, itself included, with each of its keys or numbers, and one more."""
    keys = list(whole) if isinstance(whole, dict) else range(len(whole))
    inner = [place for key in keys if isinstance(whole[key], dict | list) for place in places(whole[key])]
    return [*((whole, key) for key in keys), (whole, None), *inner]


@st.composite
def changed(draw: st.DrawFn, good: list[Any]) -> Any:
    """One of these with some changes, most of them small."""
    whole = copy.deepcopy(good[draw(st.integers(0, len(good) - 1))])
    for _ in range(draw(st.integers(0, 3))):
        found = places(whole)
        holder, key = found[draw(st.integers(0, len(found) - 1))]
        value = holder[key] if key is not None else VALUES[draw(st.sampled_from(list(VALUES)))]
        if draw(st.integers(0, 3)) == 0:
            value = copy.deepcopy(draw(HOSTILE))
        elif isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 2**63:
            value *= draw(st.sampled_from([1.0, 0.9, 1.1, 0.5, 3.0, -1.0, 0.0]))
        if isinstance(holder, list):
            holder[slice(key, None if key is None else key + 1)] = [value]
        else:
            holder[draw(NAMES) if key is None else key] = value
    return whole


def taken(call: Callable[[], Any]) -> Any:
    """What a call gives; None if it is refused, in short printable lines. Either way it takes little time."""
    begun = time.process_time()
    try:
        return call()
    except InputError as error:
        assert error.args and all(line.isprintable() and 0 < len(line) <= LONGEST_LINE for line in error.args)
        return None
    finally:
        assert time.process_time() - begun < SECONDS


@hostile_inputs
@given(settings=changed(SETTINGS), preset=st.sampled_from(["soft", "paper", None]), seed=st.none() | st.integers(-1, 9))
def test_settings_of_a_walk(settings: Any, preset: Any, seed: Any) -> None:
    """Keywords from Python; a setup given again means itself."""
    setup = taken(lambda: setup_walk(preset, settings, seed))
    if setup is not None:
        sections = {name: getattr(setup, name).model_dump() for name in ("parameters", "scene", "options")}
        assert resolve(setup.preset, **sections) == setup


@hostile_inputs
@given(changed(SWEEPS))
def test_content_of_a_sweep(content: Any) -> None:
    """Content from Python; the canonical form of what is taken is the same sweep, and its walks can be planned."""
    sweep = taken(lambda: load_sweep(content))
    if sweep is not None:
        again, last = load_sweep(json.loads(json.dumps(sweep.canonical()))), int(sweep.indices[-1])
        assert again.digest() == sweep.digest() and again.walk(last) == sweep.walk(last)


@hostile_inputs
@given(words=st.lists(st.tuples(NAMES, NUMBERS.map(repr)), max_size=3), more=st.lists(TEXTS, max_size=1))
def test_command_lines(monkeypatch: pytest.MonkeyPatch, words: list[tuple[str, str]], more: list[str]) -> None:
    """`--set NAME=VALUE` comes to the walk, or ends in one line with exit status 2."""

    def begin(setups: Any, on_compile: Any) -> Any:
        raise SystemExit(0)

    monkeypatch.setattr(one_walk, "compile_kernels", begin)
    sets = [word for name, value in words for word in ("--set", f"{name}={value}")]
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
    with contextlib.redirect_stderr(err), pytest.raises(SystemExit) as end:
        main(["walk", *sets, *more])
    lines = err.buffer.getvalue().decode().splitlines()  # type: ignore[attr-defined]
    refusals = [line for line in lines if not line.startswith("warning: ")]
    assert all(line.isprintable() and len(line) <= LONGEST_LINE for line in lines)
    assert end.value.code in (0, None) if not refusals else end.value.code == 2 and len(refusals) == 1
