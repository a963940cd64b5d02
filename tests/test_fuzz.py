"""Hostile settings, sweeps and command lines end soon: in what they say, or in short lines that refuse them.

`pytest tests/test_fuzz.py --hypothesis-profile=long` tries for minutes.
"""

import contextlib
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
from warpchain.cli.main import main
from warpchain.inputs.distributions import DRAWABLE
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.inputs.scene import Scene
from warpchain.inputs.setup import resolve
from warpchain.inputs.validation import FIELDS, LONGEST_LINE, NAME_OF_SYMBOL, SECTION_OF, InputError, field_choices
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.plan import load_sweep
from warpchain.walks import one_walk

SECONDS = 5.0
"""Most processor time of an input."""

hostile_inputs = settings(deadline=None, suppress_health_check=list(HealthCheck))

# Values: most are plausible, so that many inputs get past the first check

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
NAMES = st.one_of(st.sampled_from([*FIELDS, *NAME_OF_SYMBOL, "preset", "__class__", "<<"]), TEXTS)
VALUES = {name: value for model in (preset("soft"), Scene(), Options()) for name, value in model.model_dump().items()}


def mostly(usual: st.SearchStrategy[Any], hostile: st.SearchStrategy[Any] = HOSTILE) -> st.SearchStrategy[Any]:
    """The one, and now and then the other."""
    return st.integers(0, 15).flatmap(lambda chance: hostile if chance == 1 else usual)


def plausible(name: str) -> st.SearchStrategy[Any]:
    """Values that a field may have, and some just beyond."""
    value = VALUES.get(name)
    if name == "links":
        return st.sampled_from([60, 40, 90, 62, 31, 4, 400])
    if value is None:
        return NUMBERS
    if isinstance(value, bool | str):
        return st.sampled_from([*field_choices(FIELDS[name]), value, "other"])
    return st.sampled_from([1, 1.0, 0.9, 1.1, 0.5, 3.0, -1.0, 0.0]).map(lambda factor: value * factor)


def mapping_of(
    names: st.SearchStrategy[str], values: Callable[[str], st.SearchStrategy[Any]]
) -> st.SearchStrategy[Any]:
    """Names with values that suit them, mostly."""
    some = st.lists(mostly(names, NAMES), max_size=3, unique=True)
    return some.flatmap(lambda found: st.fixed_dictionaries({name: mostly(values(name)) for name in found}))


def axis(name: str) -> st.SearchStrategy[Any]:
    """Values of an axis."""
    ends = {"from": plausible(name), "to": plausible(name)}
    spans = st.fixed_dictionaries(ends, optional={"step": NUMBERS, "count": NUMBERS})
    return st.one_of(st.lists(mostly(plausible(name)), min_size=1, max_size=3), spans)


def law(name: str) -> st.SearchStrategy[Any]:
    """What samples draw of a quantity."""
    return st.one_of(
        st.sampled_from(["fixed", "table", "gauss"]),
        st.lists(plausible(name), min_size=2, max_size=2).map(lambda ends: {"uniform": ends}),
        st.fixed_dictionaries({"sigma": NUMBERS}, optional={"mean": plausible(name)}).map(lambda m: {"gaussian": m}),
    )


def section(of: str) -> st.SearchStrategy[Any]:
    """Content of a section."""
    return mapping_of(st.sampled_from([name for name in FIELDS if SECTION_OF[name] == of]), plausible)


KEPT = st.fixed_dictionaries(
    {},
    optional={
        "interval": st.sampled_from([0.001, 0.01, 1e-12, 1e300]),
        "samples": st.lists(st.integers(-1, 5), max_size=3),
        "before": NUMBERS,
    },
)
BLOCK = {
    **{of: mostly(section(of)) for of in ("scene", "options", "parameters")},
    "distributions": mostly(mapping_of(st.sampled_from(["all", *DRAWABLE]), law)),
    "points": mostly(mapping_of(st.sampled_from(["mu_fc", "r", "phase"]), axis), HOSTILE),
    "grid": mostly(mapping_of(st.sampled_from(["links", "frequency", "mu_fc", "tolerance", "preset", "start"]), axis)),
    "samples": mostly(st.sampled_from([1, 2, 4, 8, 2**30])),
    "sampler": mostly(st.sampled_from(SAMPLERS)),
    "preset": mostly(st.sampled_from(["soft", "paper"])),
}
SWEEPS = st.fixed_dictionaries(
    {"version": mostly(st.just(1)), "name": mostly(st.just("a")), "seed": mostly(st.integers(0, 2**128))}
    | {key: BLOCK[key] for key in ("samples", "preset")},
    optional={
        **{key: BLOCK[key] for key in BLOCK if key not in ("samples", "preset")},
        "blocks": st.lists(st.fixed_dictionaries({"name": st.sampled_from("abc")}, optional=BLOCK), max_size=3),
        "same_samples_along": mostly(st.lists(NAMES, max_size=2)),
        "record": mostly(st.fixed_dictionaries({}, optional={"series": st.booleans() | KEPT, "frames": KEPT})),
    },
)
SETTINGS = mapping_of(
    st.sampled_from([*FIELDS, *NAME_OF_SYMBOL]), lambda name: plausible(NAME_OF_SYMBOL.get(name, name))
)


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
@given(settings=SETTINGS, preset=mostly(st.sampled_from(["soft", "paper"])), seed=mostly(st.none() | st.integers(0, 9)))
def test_settings_of_a_walk(settings: Any, preset: Any, seed: Any) -> None:
    """Keywords from Python; a setup given again means itself."""
    setup = taken(lambda: setup_walk(preset, settings, seed))
    if setup is not None:
        sections = {name: getattr(setup, name).model_dump() for name in ("parameters", "scene", "options")}
        assert resolve(setup.preset, **sections) == setup


@hostile_inputs
@given(SWEEPS)
def test_content_of_a_sweep(content: Any) -> None:
    """Content from Python; the canonical form of what is taken is the same sweep, and its walks can be planned."""
    sweep = taken(lambda: load_sweep(content))
    if sweep is not None:
        assert load_sweep(json.loads(json.dumps(sweep.canonical()))).digest() == sweep.digest()
        last = int(sweep.indices[-1])
        assert sweep.planned(last).index == last


@hostile_inputs
@given(words=st.lists(st.tuples(NAMES, mostly(NUMBERS).map(repr)), max_size=3), more=st.lists(TEXTS, max_size=1))
def test_command_lines(monkeypatch: pytest.MonkeyPatch, words: list[tuple[str, str]], more: list[str]) -> None:
    """`--set NAME=VALUE` comes to the walk, or ends in one line with exit status 2."""

    def begin(setups: Any, **_: object) -> Any:
        raise SystemExit(0)

    monkeypatch.setattr(one_walk, "run_setups", begin)
    sets = [word for name, value in words for word in ("--set", f"{name}={value}")]
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
    with contextlib.redirect_stderr(err), pytest.raises(SystemExit) as end:
        main(["walk", *sets, *more])
    lines = err.buffer.getvalue().decode().splitlines()  # type: ignore[attr-defined]
    refusals = [line for line in lines if not line.startswith("warning: ")]
    assert all(line.isprintable() and len(line) <= LONGEST_LINE for line in lines)
    assert end.value.code in (0, None) if not refusals else end.value.code == 2 and len(refusals) == 1
