"""Digest and canonical form of a sweep."""

import json
from collections.abc import Mapping
from typing import Any

import pytest

from tests.support.sweep_content import content
from warpchain.inputs.validation import InputError
from warpchain.run.sweep_run import on_device
from warpchain.sweeps.plan import load_sweep


def digest(given: Mapping[str, Any]) -> str:
    """Digest of a sweep's content."""
    return load_sweep(given).digest()


SAME: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "name": ({}, {"name": "another"}),
    "range": ({}, {"grid": {"links": {"from": 60, "to": 90, "step": 30}, "frequency": [5.0, 10.0]}}),
    "defaults": ({}, {"scene": {"start": "rest"}, "options": {"method": "standard"}, "parameters": {"gravity": 9.809}}),
    "defaults of the sweep": ({}, {"sampler": "random", "record": {"series": False}, "same_samples_along": []}),
    "table": ({}, {"distributions": {"all": "table", "mu_fc": {"gaussian": {"sigma": 0.02}}, "phase": "table"}}),
    "block": ({}, {"blocks": [{"name": "x", "grid": {"links": [60, 90], "frequency": [5, 10]}}], "grid": None}),
    "axes": ({"grid": {"n": [60], "mu_fc": [0.2, 0.3]}}, {"grid": {"links": [60], "floor_friction": [0.2, 0.3]}}),
    "points": ({"points": {"μ_fc": [0.2]}}, {"points": {"floor_friction": [0.2]}}),
}


@pytest.mark.parametrize("kind", SAME)
def test_digest_ignores_what_does_not_matter(kind: str) -> None:
    """Names, symbols and other ways to say the same leave the digest as it is."""
    one, other = SAME[kind]
    assert digest(content(**one)) == digest(content(**other))


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, ("hybrid", "os32")),
        ({"method": "standard", "tolerance": 1e-4}, ("hybrid", "os32")),
        ({"method": "dp5"}, ("dp5", "dp5")),
        ({"method": "reference"}, ("rkf78", "rkf78")),
    ],
)
def test_a_method_by_need_is_that_of_the_device(options: dict[str, Any], expected: tuple[str, str]) -> None:
    """The same file on another device has the method that its word means there, with the settings given."""
    planned = load_sweep(content(options=options))
    here, there = (sweep.walk(0).setup.options for sweep in (planned, on_device(planned, "cuda:1")))
    assert (here.method, there.method) == expected
    assert there.device == "cuda:1"
    assert there.tolerance == options.get("tolerance", here.tolerance)
    again = load_sweep(on_device(planned, "cuda:1").canonical())
    assert again.walk(0).setup.options == there


def test_a_sweep_goes_on_on_any_gpu() -> None:
    """A folder begun on one GPU is that of the same sweep on another; the CPU makes other numbers."""
    planned = load_sweep(content(options={"method": "explicit"}))
    one, other, cpu = (on_device(planned, device).digest() for device in ("cuda", "cuda:3", "cpu"))
    assert one == other != cpu


def test_a_device_is_refused_beside_devices_on_an_axis() -> None:
    """One of them would be passed over."""
    planned = load_sweep(content(grid={"device": ["cuda:0", "cuda:1"]}, options={}))
    with pytest.raises(InputError, match="device: cpu is not possible with device as an axis of the grid; remove one"):
        on_device(planned, "cpu")


def test_a_stored_sweep_keeps_its_method_unless_it_is_given_a_word_again() -> None:
    """A stored sweep goes on as it was, keeps its method on any device that has it, and takes a word in its place."""
    planned = load_sweep(content(options={}))
    stored = planned.canonical()
    assert load_sweep(stored).digest() == planned.digest()
    with pytest.raises(
        InputError, match=r"^sweep\.blocks\[0\]\.options\.method: 'hybrid' runs only on a CPU; use explicit"
    ):
        on_device(load_sweep(stored), "cuda")
    for block in stored["blocks"]:
        block["options"]["method"] = "standard"
    assert load_sweep(stored).digest() == planned.digest()
    assert on_device(load_sweep(stored), "cuda").digest() == on_device(planned, "cuda").digest()


def test_digest_tells_apart_what_matters() -> None:
    """Whatever changes a number or its place changes the digest."""
    changes: list[dict[str, Any]] = [
        {},
        {"seed": 8},
        {"samples": 4},
        {"samples": 4, "sampler": "sobol"},
        {"preset": "paper"},
        {"scene": {"clearance": 0.01}},
        {"scene": {"walk_limit": 21.0}},
        {"options": {"method": "dp5"}},
        {"parameters": {"gravity": 9.81}},
        {"grid": {"frequency": [5, 10], "links": [60, 90]}},
        {"grid": {"links": [60, 90], "frequency": [5, 10.000000000000002]}},
        {"same_samples_along": ["links"]},
        {"independent": ["clearance"]},
        {"record": {"series": True}},
        {"record": {"series": {"interval": 2e-3}}},
        {"record": {"series": True, "frames": True}},
        {"distributions": {"phase": {"uniform": [0, 0.5]}}},
        {"distributions": {"phase": "fixed"}},
        {"distributions": {"floor_friction": {"gaussian": {"mean": 0.27, "sigma": 0.021}}}},
        {"points": {"floor_friction": [0.2, 0.3]}},
        {"grid": {"preset": ["paper", "soft"]}, "preset": None},
        {"grid": {"preset": ["paper", "soft"]}, "preset": None, "parameters": {"gravity": 9.81}},
    ]
    assert len({digest(content(**change)) for change in changes}) == len(changes)


def test_a_new_field_with_a_default_changes_no_digest() -> None:
    """What an older version wrote out, without a field that this one has, is the same sweep."""
    planned = load_sweep(content())
    older = planned.canonical()
    for block in older["blocks"]:
        del block["scene"]["stop_time"], block["options"]["soften_area"], block["parameters"]["half_width"]
    assert load_sweep(older).digest() == planned.digest()
    text = json.dumps(load_sweep(content(scene={"stop_time": 1.0})).canonical())
    assert load_sweep(json.loads(text)).digest() != planned.digest()
