"""Sweeps: files, values, blocks and refusals."""

import itertools
import time
from typing import Any

import pytest

from tests.support.sweep_content import TABLE_1, UNIFORM, blocks, content
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError
from warpchain.sweeps.plan import load_sweep


def test_values_and_layout() -> None:
    """Fixed values, axes and samples reach the setups; the last axis varies fastest, then the samples."""
    sweep = load_sweep(
        content(
            scene={"start": "spinning"}, options={"method": "dp5"}, parameters={"gravity": 9}, record={"series": False}
        )
    )
    (block,) = sweep.blocks
    assert (sweep.name, sweep.seed, sweep.walk_count) == ("small", 7, 12)
    assert (block.name, block.first_cell, block.samples, block.shape) == ("main", 0, 3, (2, 2, 3))
    assert block.axes == {"links": (60, 90), "frequency": (5.0, 10.0)}
    assert list(block.axes) == ["links", "frequency"]
    assert block.drawn == (*TABLE_1, "phase", "clearance")
    places = itertools.product(range(3), range(2), range(2))
    for index, (sample, links, frequency) in enumerate(places):
        walk = sweep.walk(index)
        setup = walk.setup
        assert (walk.index, walk.block, walk.cell, walk.sample) == (index, 0, (links, frequency), sample)
        assert (setup.scene.links, setup.scene.frequency) == ((60, 90)[links], (5.0, 10.0)[frequency])
        assert (setup.preset, setup.scene.start, setup.options.method) == ("soft", "spinning", "dp5")
        assert (setup.parameters.gravity, setup.parameters.joint_stiffness) == (9.0, 1e7)
        assert tuple(walk.draws) == block.drawn
        for name, value in walk.draws.items():
            assert getattr(setup.parameters if name in TABLE_1 else setup.scene, name) == value
    for beyond in (-1, 12, 10**9):
        with pytest.raises(IndexError):
            sweep.walk(beyond)


def test_blocks_inherit_and_override() -> None:
    """A block takes from the top level what it does not say itself, value by value; a grid beats inherited values."""
    own = {"preset": "paper", "samples": 2, "sampler": "latin_hypercube", "scene": {"start": "ellipse"}}
    own |= {"options": {"method": "bs32"}, "distributions": {"floor_friction": "fixed"}}
    sweep = load_sweep(
        blocks(
            {"grid": {"links": [60]}},
            own | {"grid": {"frequency": [10, 20], "tolerance": [1e-5]}},
            {"grid": {"preset": ["paper", "soft"]}},
            scene={"links": 90, "frequency": 15},
            options={"tolerance": 1e-7},
            parameters={"floor_friction": 0.3},
            distributions={"floor_friction": {"gaussian": {"sigma": 0.01}}},
        )
    )
    assert [(block.name, block.first_cell) for block in sweep.blocks] == [("b0", 0), ("b1", 1), ("b2", 3)]
    assert [block.sampler for block in sweep.blocks] == ["random", "latin_hypercube", "random"]
    assert sweep.walk_count == 13
    first, second, paper, soft = (sweep.walk(index).setup for index in (0, 2, 3, 4))
    for setup, *expected in (
        (first, "soft", 60, "rest", 15, 1e-7, "hybrid"),
        (second, "paper", 90, "ellipse", 20, 1e-5, "bs32"),
    ):
        scene, options = setup.scene, setup.options
        found = [setup.preset, scene.links, scene.start, scene.frequency, options.tolerance, options.method]
        assert found == expected
    assert second.parameters.floor_friction == 0.3 != first.parameters.floor_friction
    assert [(each.preset, each.parameters.joint_stiffness) for each in (paper, soft)] == [("paper", 1e9), ("soft", 1e7)]


@pytest.mark.parametrize(
    ("name", "given", "values"),
    [
        ("links", {"from": 60, "to": 180, "step": 30}, (60, 90, 120, 150, 180)),
        ("links", {"from": 60, "to": 180, "count": 3}, (60, 120, 180)),
        ("frequency", {"from": 5, "to": 30, "step": 12.5}, (5.0, 17.5, 30.0)),
        ("floor_friction", {"from": 0, "to": 0.4, "step": 0.1}, (0.0, 0.1, 0.2, 0.3, 0.4)),
        ("floor_friction", {"from": 0, "to": 1, "count": 4}, (0.0, 1 / 3, 2 / 3, 1.0)),
        ("tolerance", {"from": 1e-9, "to": 3e-9, "step": 1e-9}, (1e-9, 2e-9, 3e-9)),
        ("self_contact", [True, False], (True, False)),
        ("start", ["spinning", "ellipse"], ("spinning", "ellipse")),
        ("frequency", [15, 10.5], (15.0, 10.5)),
    ],
)
def test_axis_values(name: str, given: object, values: tuple[object, ...]) -> None:
    """Lists keep their order; ranges hit both ends and give the decimal numbers that one expects between."""
    (block,) = load_sweep(content(grid={name: given}, samples=1)).blocks
    assert block.axes == {name: values}
    assert [type(value) for value in block.axes[name]] == [type(value) for value in values]


# Refusals

FULL = {"walk_limit": {"from": 1, "to": 10_000, "step": 1}}
LONG = {"from": 1e-3, "to": 1e-2, "count": 10_000}


@pytest.mark.parametrize(
    ("changes", "path"),
    [
        ({"version": 2}, "version"),
        ({"samples": None}, "samples"),
        ({"scene": {"frequncy": 5}}, "scene.frequncy"),
        ({"options": {"device": "cuda"}, "grid": {"method": ["os32", "hybrid"]}}, "grid.method[1]"),
        ({"parameters": {"mu_fc": 0.3, "floor_friction": 0.3}}, "parameters.floor_friction"),
        ({"grid": {"lniks": [60]}}, "grid.lniks"),
        ({"grid": {"links": []}}, "grid.links"),
        ({"grid": {"floor": ["flat", [[-1, 0], [1, 0]]]}}, "grid.floor"),
        ({"grid": {"links": [60, 1026]}, "options": {"device": "cuda"}}, "grid.links[1]"),
        ({"grid": {"frequency": [5, 5.0]}}, "grid.frequency"),
        ({"grid": {"preset": ["soft"]}}, "grid.preset"),
        ({"grid": {"method": ["standard", "reference"]}}, "grid"),
        ({"grid": {"device": ["cpu", "cuda"]}, "options": {}}, "grid"),
        ({"grid": {"links": {"from": 60, "to": 90, "step": 10, "count": 4}}}, "grid.links.step"),
        ({"grid": {"links": {"from": 60, "to": 90, "step": 20}}}, "grid.links.to"),
        ({"grid": {"frequency": {"from": 5, "to": 10, "step": 1e-300}}}, "grid.frequency.step"),
        ({"grid": {"start": ["rest", "spinning"]}, "scene": {"clearance_of": "hanging"}}, "scene.clearance_of"),
        ({"grid": {"link_length": [0.012, 0.008]}}, "parameters.circle_radius"),
        ({"distributions": {"links": "fixed"}}, "distributions.links"),
        ({"distributions": {"gravity": "table"}}, "distributions.gravity"),
        ({"distributions": {"floor_friction": {"uniform": [0.3, 0.2]}}}, "distributions.floor_friction.uniform[1]"),
        ({"distributions": {"g": {"gaussian": {"mean": -1, "sigma": 1}}}}, "distributions.gravity.gaussian.mean"),
        ({"distributions": {"e_fc": {"gaussian": {"sigma": 50}}}}, "distributions.floor_restitution"),
        ({"distributions": {"mu_fc": UNIFORM}, "grid": {"mu_fc": [0.3]}}, "distributions.floor_friction"),
        ({"distributions": {"sprocket_radius": {"uniform": [0.5, 0.6]}}, "grid": None}, "distributions"),
        ({"distributions": {"all": "fixed"}}, "samples"),
        ({"distributions": {"all": "fixed"}, "sampler": "saltelli"}, "sampler"),
        ({"samples": 12, "sampler": "sobol"}, "samples"),
        ({"same_samples_along": ["tolerance"]}, "same_samples_along"),
        ({"record": {"series": {"interval": 1.5e-3}}}, "record.series.interval"),
        ({"record": {"series": {"samples": [0, 3]}}}, "record.series.samples"),
        ({"record": {"frames": True}}, "record.frames"),
        ({"record": {"series": {"samples": [0]}, "frames": {"samples": [0, 1]}}}, "record.frames"),
        ({"points": {"mu_fc": [0.1, 0.2], "e_fc": [0.1]}}, "points.floor_restitution"),
        ({"blocks": [{"name": "b"}]}, "grid"),
        ({"blocks": [{"name": "a/b"}], "grid": None}, "blocks[0].name"),
        ({"blocks": [{"name": "b"}, {"name": "b"}], "grid": None}, "blocks[1].name"),
        ({"blocks": [{"name": "b", "grid": {"nu": [5, -5]}}], "grid": None}, "blocks[0].grid.frequency[1]"),
        # sizes
        ({"samples": 2**30}, "samples"),
        ({"grid": dict.fromkeys(list(Parameters.model_fields)[:12], LONG)}, "grid"),
        ({"grid": FULL | {"gravity": {"from": 1, "to": 11, "step": 1}}}, "grid"),
        ({"blocks": [{"name": f"b{number}", "grid": FULL} for number in range(5000)], "grid": None}, "blocks["),
    ],
)  # fmt: skip
def test_refusals(changes: dict[str, Any], path: str) -> None:
    """A wrong value is refused soon, by its path and in one line."""
    begun = time.process_time()
    with pytest.raises(InputError) as caught:
        load_sweep(content(**changes))
    assert time.process_time() - begun < 2
    assert caught.value.args[0].startswith(f"sweep.{path}" if path.endswith("[") else f"sweep.{path}: ")


def test_values_are_judged_in_their_cells() -> None:
    """A value that only defaults contradict is taken when the other values of its cells go with it."""
    sweep = load_sweep(
        content(
            grid={"smallest_step": [1e-4], "link_length": [0.02]},
            options={"contact_step": 1e-3},
            parameters={"circle_radius": 0.008},
        )
    )
    setup = sweep.walk(0).setup
    assert (setup.options.smallest_step, setup.parameters.circle_radius) == (1e-4, 0.008)
    assert load_sweep(sweep.canonical()).digest() == sweep.digest()
