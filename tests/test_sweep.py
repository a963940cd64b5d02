"""Sweeps: files and their refusals, planned walks, distributions, designed samples, digests."""

import copy
import itertools
import json
import math
import pickle
import time
import tracemalloc
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy import stats

from warpchain import design
from warpchain.design import design_points, saltelli_outputs, sobol_indices
from warpchain.options import check_scene, fewest_links, resolve
from warpchain.parameters import PRESETS, Bounds, InputError, Parameters, preset
from warpchain.planning import CELL_LIMIT, Sweep, load_sweep
from warpchain.sampling import Gaussian, Uniform, random_generator, sample_parameters, sample_scene
from warpchain.walker import setup_walk

SWEEPS = Path(__file__).parents[1] / "sweeps"
TABLE_1 = [name for name, quantity in Parameters.quantities().items() if quantity.sigma > 0]
UNIFORM = {"uniform": [0.2, 0.4]}


def content(**changes: Any) -> dict[str, Any]:
    """A small sweep of one block with some keys replaced; None takes a key out."""
    whole: dict[str, Any] = {
        "version": 1,
        "name": "small",
        "seed": 7,
        "preset": "soft",
        "samples": 3,
        "grid": {"links": [60, 90], "frequency": [5, 10]},
    }
    whole |= changes
    return {key: value for key, value in whole.items() if value is not None}


def blocks(*given: Mapping[str, Any], **changes: Any) -> dict[str, Any]:
    """A sweep of several blocks, each with a name and whatever is given."""
    named = [{"name": f"b{number}", **block} for number, block in enumerate(given)]
    return content(grid=None, blocks=named, **changes)


def drawn(sweep: Sweep, walks: int) -> np.ndarray:
    """What the first walks drew, shape (walks, drawn quantities)."""
    return np.array([list(sweep.planned(index).drawn.values()) for index in range(walks)])


# Files and their values


def test_values_and_layout() -> None:
    """Fixed values, axes and samples reach the setups; the sample varies fastest, then the last axis."""
    sweep = load_sweep(
        content(
            scene={"start": "spinning"}, options={"method": "dp5"}, parameters={"gravity": 9}, record={"series": False}
        )
    )
    (block,) = sweep.blocks
    assert (sweep.name, sweep.seed, sweep.walk_count) == ("small", 7, 12)
    assert (block.name, block.first, block.samples, block.shape) == ("main", 0, 3, (2, 2, 3))
    assert block.axes == {"links": (60, 90), "frequency": (5.0, 10.0)}
    assert list(block.axes) == ["links", "frequency"]
    assert block.drawn == (*TABLE_1, "phase", "clearance")
    places = itertools.product(range(2), range(2), range(3))
    for index, (links, frequency, sample) in enumerate(places):
        walk = sweep.planned(index)
        setup = walk.setup
        assert (walk.index, walk.block, walk.cell, walk.sample) == (index, 0, (links, frequency), sample)
        assert (setup.scene.links, setup.scene.frequency) == ((60, 90)[links], (5.0, 10.0)[frequency])
        assert (setup.preset, setup.scene.start, setup.options.method) == ("soft", "spinning", "dp5")
        assert (setup.parameters.gravity, setup.parameters.joint_stiffness) == (9.0, 1e7)
        assert tuple(walk.drawn) == block.drawn
        for name, value in walk.drawn.items():
            assert getattr(setup.parameters if name in TABLE_1 else setup.scene, name) == value


@pytest.mark.parametrize("index", [-1, 12, 10**9])
def test_no_such_walk(index: int) -> None:
    """A number outside the sweep is an IndexError, negative ones included."""
    with pytest.raises(IndexError):
        load_sweep(content()).planned(index)


def test_blocks_inherit_and_override() -> None:
    """A block takes from the top level what it does not say itself, value by value; a grid beats inherited values."""
    sweep = load_sweep(
        blocks(
            {"grid": {"links": [60]}},
            {
                "preset": "paper",
                "samples": 2,
                "sampler": "latin_hypercube",
                "scene": {"start": "ellipse"},
                "options": {"tolerance": 1e-9},
                "distributions": {"floor_friction": "fixed"},
                "grid": {"frequency": [10, 20], "tolerance": [1e-5]},
            }
            | {"options": {"method": "bs32"}},
            {"grid": {"preset": ["paper", "soft"]}},
            scene={"links": 90, "frequency": 15},
            options={"tolerance": 1e-7},
            parameters={"floor_friction": 0.3},
            distributions={"floor_friction": {"gaussian": {"sigma": 0.01}}},
        )
    )
    assert [block.name for block in sweep.blocks] == ["b0", "b1", "b2"]
    assert [block.first for block in sweep.blocks] == [0, 3, 7]
    assert [block.sampler for block in sweep.blocks] == ["random", "latin_hypercube", "random"]
    assert sweep.walk_count == 13
    first, second, paper, soft = (sweep.planned(index).setup for index in (0, 5, 7, 10))
    assert (first.preset, first.scene.links, first.scene.start) == ("soft", 60, "rest")
    assert (first.scene.frequency, first.options.tolerance, first.options.method) == (15, 1e-7, "dp5")
    assert (second.preset, second.scene.links, second.scene.start) == ("paper", 90, "ellipse")
    assert (second.scene.frequency, second.options.tolerance, second.options.method) == (20, 1e-5, "bs32")
    assert second.parameters.floor_friction == 0.3 != first.parameters.floor_friction
    assert (paper.preset, paper.parameters.joint_stiffness) == ("paper", 1e9)
    assert (soft.preset, soft.parameters.joint_stiffness) == ("soft", 1e7)


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


def test_from_a_file(tmp_path: Path) -> None:
    """A file gives the same sweep as its content, its canonical copy too; a sweep is taken as it is."""
    path = tmp_path / "sweep.yaml"
    path.write_text(yaml.safe_dump(content(distributions={"coulomb_friction": {"gaussian": {"sigma": 2e-5}}})))
    sweep = load_sweep(path)
    again = tmp_path / "again.yaml"
    again.write_text(yaml.safe_dump(sweep.canonical(), sort_keys=False))
    for other in (load_sweep(str(path)), load_sweep(again), pickle.loads(pickle.dumps(sweep)), load_sweep(sweep)):
        assert other.digest() == sweep.digest()
        assert other.canonical() == sweep.canonical()
        assert [other.planned(index) for index in range(12)] == [sweep.planned(index) for index in range(12)]


# Refusals


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (content(version=None), "sweep.version: missing; give 1"),
        (content(version=2), "sweep.version: 2 is not supported; give 1"),
        (content(version=True), "sweep.version: True is not supported; give 1"),
        (content(name=None), "sweep.name: missing; give the sweep a name"),
        (content(name=3), "sweep.name: 3 is no name; give a line of text"),
        (content(seed=None), "sweep.seed: missing; give a whole number"),
        (content(seed=-1), "sweep.seed: -1 is no whole number from 0 to 2**128 - 1; give one"),
        (content(seed=1.5), "sweep.seed: 1.5 is no whole number"),
        (content(preset=None), "sweep.preset: missing; name the parameters to start from"),
        (content(preset="hard"), "sweep.preset: 'hard' is unknown; presets are paper, soft"),
        (content(preset=["soft"]), "sweep.preset: ['soft'] is unknown"),
        (content(samples=None), "sweep.samples: missing; give the number of samples per cell"),
        (content(samples=0), "sweep.samples: 0 is no whole number from 1 to 1073741824; give one"),
        (content(samples=True), "sweep.samples: True is no whole number"),
        (content(sampler="sobl"), "sweep.sampler: 'sobl' is unknown; did you mean sobol?"),
        (content(sample=12), "sweep.sample: unknown key; did you mean samples?"),
        (content(scene={"frequncy": 5}), "sweep.scene.frequncy: unknown key; did you mean frequency?"),
        (content(scene={"gravity": 5}), "sweep.scene.gravity: unknown key"),
        (content(scene=[5]), "sweep.scene: [5] is not a mapping; give keys with values"),
        (content(scene={"clearance": "1 cm"}), "sweep.scene.clearance: '1 cm' has a unit written with it"),
        (content(scene={"clearance": None}), "sweep.scene.clearance: empty; give a plain number in m"),
        (
            content(options={"method": "rk4"}),
            "sweep.options.method: 'rk4' is unknown; give one of standard, fast, reference,",
        ),
        (content(parameters={"outer_mass": 0}), "sweep.parameters.outer_mass: 0 is not greater than 0 kg"),
        (content(record={"serie": True}), "sweep.record.serie: unknown key; did you mean series"),
        (content(record=[1]), "sweep.record: [1] is not a mapping"),
        (
            content(record={"series": 1}),
            "sweep.record.series: 1; give true, false or {interval: 0.001, samples: [0, 1]}",
        ),
        (content(record={"series": {"every": 2}}), "sweep.record.series.every: unknown key"),
        (
            content(record={"series": {"interval": 0}}),
            "sweep.record.series.interval: 0 is no positive number; give one",
        ),
        (
            content(record={"series": {"interval": "1 ms"}}),
            "sweep.record.series.interval: '1 ms' is no positive number",
        ),
        (
            content(record={"series": {"interval": 1.5e-3}}),
            "sweep.record.series.interval: 0.0015 s is no whole multiple of options.record_interval 0.001 s; give one",
        ),
        (
            content(record={"series": True}, options={"record_interval": 2e-3}),
            "sweep.record.series.interval: 0.001 s is no whole multiple of options.record_interval 0.002 s; give one",
        ),
        (
            content(record={"series": {"samples": 2}}),
            "sweep.record.series.samples: 2 is no list; give all, or a list such as [0, 1]",
        ),
        (content(record={"series": {"samples": []}}), "sweep.record.series.samples: empty; give one item or more"),
        (
            content(record={"series": {"samples": [0, -1]}}),
            "sweep.record.series.samples[1]: -1 is no whole number from 0",
        ),
        (content(record={"series": {"samples": [1, 1]}}), "sweep.record.series.samples: a number is given twice"),
        (
            content(record={"series": {"samples": [0, 3]}}),
            "sweep.record.series.samples: 3 is no sample of any block; give numbers from 0 to 2",
        ),
        (content(record={"frames": True}), "sweep.record.frames: kept of samples without series; give them in"),
        (
            content(record={"series": {"samples": [0]}, "frames": {"samples": [0, 1]}}),
            "sweep.record.frames: kept of samples without series; give them in sweep.record.series as well",
        ),
        (content(grid=[60]), "sweep.grid: [60] is not a mapping"),
        (content(grid={"lniks": [60]}), "sweep.grid.lniks: unknown key; did you mean links?"),
        (content(grid={"links": 60}), "sweep.grid.links: 60 is no list; give a list such as [60], or {from:, to:"),
        (content(grid={"links": []}), "sweep.grid.links: empty; give one item or more"),
        (content(grid={"links": [60, 61]}), "sweep.grid.links[1]: 61 is odd; a chain alternates"),
        (content(grid={"links": [60, 90.0]}), "sweep.grid.links[1]: 90.0 is of type float; give a whole number"),
        (content(grid={"preset": ["soft"]}), "sweep.grid.preset: also given in sweep.preset; leave one out"),
        (
            content(grid={"preset": ["soft", "firm"]}, preset=None),
            "sweep.grid.preset[1]: 'firm' is unknown; presets are paper, soft",
        ),
        (
            content(grid={"frequency": [5, 10, 15, -5]}),
            "sweep.grid.frequency[3]: -5 is less than 0 Hz; give 0 or more",
        ),
        (content(grid={"frequency": [5, 5.0]}), "sweep.grid.frequency[1]: 5.0 is given twice; leave one out"),
        (
            content(grid={"frequency": [5]}, scene={"frequency": 5}),
            "sweep.grid.frequency: also given in sweep.scene; leave one out",
        ),
        (content(grid={"links": {"from": 60}}), "sweep.grid.links.to: missing; give the last value"),
        (content(grid={"links": {"from": 60, "to": 90}}), "sweep.grid.links: a range needs either step or count"),
        (
            content(grid={"links": {"from": 60, "to": 90, "step": 10, "count": 4}}),
            "sweep.grid.links: a range needs either step or count; give one of them",
        ),
        (
            content(grid={"links": {"from": 90, "to": 60, "step": 10}}),
            "sweep.grid.links.to: 60 is not greater than from: 90; give a greater value",
        ),
        (
            content(grid={"links": {"from": 60, "to": 90, "step": 20}}),
            "sweep.grid.links.to: steps of 20 from 60 miss 90; give 80 or 100, or a count instead of the step",
        ),
        (
            content(grid={"links": {"from": 60, "to": 90, "step": 5}}),
            "sweep.grid.links[1]: 65 is odd",
        ),
        (
            content(grid={"links": {"from": 60, "to": 90, "count": 5}}),
            "sweep.grid.links.count: 5 gives values that are not whole; give another",
        ),
        (
            content(grid={"links": {"from": 60, "to": 90, "count": 1}}),
            "sweep.grid.links.count: 1 is no whole number from 2 to 10000; give one",
        ),
        (
            content(grid={"frequency": {"from": 5, "to": 30, "step": 0}}),
            "sweep.grid.frequency.step: 0 is no positive number; give one",
        ),
        (
            content(grid={"frequency": {"from": 5, "to": 30, "step": 1e-9}}),
            "sweep.grid.frequency.step: gives more than 10000 values; give a larger step",
        ),
        (content(grid={"frequency": {"from": "5 Hz", "to": 30, "step": 1}}), "sweep.grid.frequency.from: '5 Hz' "),
        (content(grid={"start": {"from": 1, "to": 2, "step": 1}}), "sweep.grid.start: start is no number and has"),
        (content(grid={"links": {"first": 60}}), "sweep.grid.links.first: unknown key"),
        (content(distributions={"all": "none"}), "sweep.distributions.all: 'none' is unknown; give table or fixed"),
        (content(distributions={"links": "fixed"}), "sweep.distributions.links: unknown key"),
        (
            content(distributions={"gravity": "table"}),
            "sweep.distributions.gravity: there is no uncertainty of gravity in Table 1; give uniform or gaussian",
        ),
        (content(distributions={"gravity": 9.81}), "sweep.distributions.gravity: 9.81 is no distribution; give "),
        (content(distributions={"gravity": {}}), "sweep.distributions.gravity: {} is no distribution; give table,"),
        (
            content(distributions={"gravity": {"normal": {}}}),
            "sweep.distributions.gravity.normal: unknown key; ",
        ),
        (
            content(distributions={"floor_friction": {"uniform": [0.2]}}),
            "sweep.distributions.floor_friction.uniform: [0.2] is no interval; give [lower, upper]",
        ),
        (
            content(distributions={"floor_friction": {"uniform": [0.3, 0.2]}}),
            "sweep.distributions.floor_friction.uniform[1]: 0.2 is not greater than 0.3; give a greater value",
        ),
        (
            content(distributions={"floor_friction": {"uniform": [-0.1, 0.2]}}),
            "sweep.distributions.floor_friction.uniform[0]: -0.1 is less than 0; give 0 or more",
        ),
        (
            content(distributions={"phase": {"uniform": [0, 1.5]}}),
            "sweep.distributions.phase.uniform[1]: 1.5 is not less than 1; give a smaller value",
        ),
        (
            content(distributions={"floor_friction": {"gaussian": {"mean": 2, "sigma": 0.1}}}),
            "sweep.distributions.floor_friction.gaussian.mean: 2 is greater than 1; give 1 or less",
        ),
        (
            content(distributions={"floor_friction": {"gaussian": {"mean": 0.2}}}),
            "sweep.distributions.floor_friction.gaussian.sigma: missing; give the standard deviation",
        ),
        (
            content(distributions={"floor_friction": {"gaussian": {"sigma": 0}}}),
            "sweep.distributions.floor_friction.gaussian.sigma: 0 is no positive number; give one",
        ),
        (
            content(distributions={"floor_friction": {"gaussian": {"sigma": 50}}}),
            "sweep.distributions.floor_friction: less than 5% of the draws about 0.27 with standard deviation 50 are",
        ),
        (
            content(distributions={"floor_friction": UNIFORM}, parameters={"floor_friction": 0.3}),
            "sweep.distributions.floor_friction: floor_friction also has a value in parameters; leave one out",
        ),
        (
            content(distributions={"phase": "table"}, scene={"phase": 0.5}),
            "sweep.distributions.phase: phase also has a value in scene; leave one out, or give fixed",
        ),
        (
            content(distributions={"floor_friction": UNIFORM}, grid={"floor_friction": [0.3]}),
            "sweep.distributions.floor_friction: floor_friction also has a value in grid; leave one out",
        ),
        (
            content(distributions={"all": "fixed"}),
            "sweep.samples: nothing is drawn, so all 3 samples would be the same; give 1, or distributions",
        ),
        (
            content(distributions={"all": "fixed"}, sampler="saltelli"),
            "sweep.sampler: saltelli has nothing to draw; give distributions",
        ),
        (
            content(sampler="sobol", samples=12),
            "sweep.samples: 12 is not a power of two, which sobol needs to be balanced; give 8 or 16",
        ),
        (content(sampler="saltelli", samples=3), "sweep.samples: 3 is not a power of two"),
        (content(same_samples_along="links"), "sweep.same_samples_along: 'links' is no list"),
        (
            content(same_samples_along=["links", "tolerance"]),
            "sweep.same_samples_along[1]: 'tolerance' is no axis of any block; give one of frequency, links",
        ),
        (content(same_samples_along=["links", "links"]), "sweep.same_samples_along[1]: 'links' is given twice"),
        (content(grid=None, same_samples_along=["links"]), "sweep.same_samples_along[0]: 'links' is no axis"),
        (content(blocks=[]), "sweep.grid: given together with blocks; move it into a block"),
        (content(grid=None, blocks=[]), "sweep.blocks: empty; give one item or more"),
        (content(grid=None, blocks={"name": "b"}), "sweep.blocks: {'name': 'b'} is no list"),
        (content(grid=None, blocks=[3]), "sweep.blocks[0]: 3 is not a mapping"),
        (content(grid=None, blocks=[{"grid": {}}]), "sweep.blocks[0].name: missing; give the block a name"),
        (blocks({}, {"name": "b0"}), "sweep.blocks[1].name: 'b0' is given twice; give another name"),
        (blocks({"name": "a/b"}), "sweep.blocks[0].name: 'a/b' is no plain name"),
        (blocks({"seed": 1}), "sweep.blocks[0].seed: unknown key"),
        (blocks({}, {"samples": -1}), "sweep.blocks[1].samples: -1 is no whole number"),
        (blocks({}, samples=None), "sweep.blocks[0].samples: missing"),
        (
            blocks({}, {"grid": {"frequency": [5, 10, 15, -5]}}),
            "sweep.blocks[1].grid.frequency[3]: -5 is less than 0 Hz; give 0 or more",
        ),
        (
            blocks({"distributions": {"floor_friction": UNIFORM}}, parameters={"floor_friction": 0.3}),
            "sweep.blocks[0].distributions.floor_friction: floor_friction also has a value in parameters",
        ),
        (
            blocks({"grid": {"floor_friction": [0.3]}}, distributions={"floor_friction": UNIFORM}),
            "sweep.distributions.floor_friction: floor_friction also has a value in grid",
        ),
        (
            content(grid={"links": [60, 20], "frequency": [5]}),
            "sweep.grid.links[1]: 20 links of 0.01268 m do not reach round the sprocket",
        ),
        (
            blocks({"grid": {"sprocket_radius": [0.05, 0.2]}}),
            "sweep.blocks[0].scene.links: 60 links of 0.01268 m do not reach round the sprocket whose joints ride at "
            "0.2042 m; give at least 102 (in the cell sprocket_radius 0.2)",
        ),
        (
            content(grid={"start": ["rest", "spinning"]}, scene={"clearance_of": "hanging"}),
            "sweep.scene.clearance_of: 'hanging' needs a chain that hangs",
        ),
        (
            content(grid={"links": [60]}, distributions={"sprocket_radius": {"uniform": [0.5, 0.6]}}),
            "sweep.distributions: 1000 samples made no possible walk; the last: scene.links: 60 links",
        ),
        (
            content(grid={"link_length": [0.012, 0.008]}),
            "sweep.parameters.circle_radius: 0.0042 is not smaller than half the link length 0.004; give a smaller "
            "radius (in the cell link_length 0.008)",
        ),
        (
            content(
                grid={
                    "frequency": {"from": 1, "to": 9999, "step": 1},
                    "gravity": {"from": 1, "to": 11, "step": 1},
                }
            ),
            f"sweep.grid: the sweep has more than {CELL_LIMIT} cells; give fewer values",
        ),
    ],
)
def test_refusals(given: dict[str, Any], message: str) -> None:
    """A wrong file is refused with one line: the path of the offending value, the problem and the remedy."""
    before = copy.deepcopy(given)
    with pytest.raises(InputError) as caught:
        load_sweep(given)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)
    assert given == before


def test_unreadable_files(tmp_path: Path) -> None:
    """A missing file, no mapping and a key given twice are refused in one line that begins with the file."""
    (tmp_path / "list.yaml").write_text("[1, 2]")
    (tmp_path / "twice.yaml").write_text("version: 1\nversion: 1\n")
    for name in ("none.yaml", "list.yaml", "twice.yaml"):
        with pytest.raises(InputError) as caught:
            load_sweep(tmp_path / name)
        assert str(caught.value).startswith(str(tmp_path / name))


def test_values_are_judged_in_their_cells() -> None:
    """A value that only defaults contradict is taken when the other values of its cells go with it."""
    sweep = load_sweep(
        content(
            grid={"smallest_step": [1e-4], "link_length": [0.02]},
            options={"contact_step": 1e-3},
            parameters={"circle_radius": 0.008},
        )
    )
    setup = sweep.planned(0).setup
    assert (setup.options.smallest_step, setup.parameters.circle_radius) == (1e-4, 0.008)
    assert load_sweep(sweep.canonical()).digest() == sweep.digest()


def test_scipy_is_asked_for_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without SciPy a designed sampler is refused with the remedy; random samples do not need it."""
    monkeypatch.setattr(design, "find_spec", lambda name: None)
    load_sweep(content())
    with pytest.raises(InputError, match=r"^sweep\.sampler: sobol needs SciPy, .* pip install 'warpchain\[scipy\]'"):
        load_sweep(content(sampler="sobol", samples=4))


# Random numbers


@pytest.mark.parametrize("sampler", ["random", "sobol", "latin_hypercube", "saltelli"])
def test_walks_depend_on_their_index_only(sampler: str) -> None:
    """A planned walk is the same whatever was planned before it, and all walks differ."""
    given = content(sampler=sampler, samples=4)
    sweep = load_sweep(given)
    walks = [sweep.planned(index) for index in range(sweep.walk_count)]
    order = np.random.default_rng(1).permutation(sweep.walk_count).tolist()
    design_points.cache_clear()
    other = load_sweep(given)
    assert {index: other.planned(index) for index in order} == dict(enumerate(walks))
    assert len({tuple(walk.drawn.values()) for walk in walks}) == len(walks)


def test_more_samples_and_more_blocks_change_nothing_before() -> None:
    """A sample stays what it is when its cell gets more samples and when blocks are added behind."""
    few, many = load_sweep(blocks({})), load_sweep(blocks({"samples": 50}, {}))
    assert [few.planned(index).drawn for index in range(3)] == [many.planned(index).drawn for index in range(3)]


def test_first_sample_is_that_of_a_single_walk() -> None:
    """Sample 0 of cell 0 is what a single walk draws from the same seed; the others follow the same rule."""
    settings = {"links": 90, "frequency": 12.0, "floor_friction": 0.1}
    for seed in (0, 7, 2**127):
        sweep = load_sweep(
            content(
                seed=seed,
                scene={"links": 90, "frequency": 12.0},
                parameters={"floor_friction": 0.1},
                grid={"tolerance": [1e-4, 1e-7]},
            )
        )
        assert sweep.planned(0).setup == setup_walk("soft", settings, seed)
        base = resolve(
            "soft",
            scene={"links": 90, "frequency": 12.0},
            options={"tolerance": 1e-7},
            parameters={"floor_friction": 0.1},
        )
        rng = random_generator(seed, 1, 2)
        walk = sweep.planned(5)
        assert walk.setup.parameters == sample_parameters(base.parameters, rng)
        assert walk.setup.scene == sample_scene(base.scene, rng)
        assert walk.setup.options == base.options


def test_large_sweeps_cost_nothing() -> None:
    """A sweep of 10¹¹ walks is loaded and its walks are planned in little time and memory, wherever they are."""
    load_sweep(content()).planned(0)
    tracemalloc.start()
    try:
        sweep = load_sweep(content(samples=2**30, grid={"frequency": {"from": 1, "to": 100, "step": 1}}))
        assert sweep.walk_count == 100 * 2**30
        for index in (0, 10**6, sweep.walk_count - 1):
            assert sweep.planned(index).sample == index % 2**30
        assert tracemalloc.get_traced_memory()[1] < 2e6
    finally:
        tracemalloc.stop()
    began = time.process_time()
    for index in range(0, sweep.walk_count, sweep.walk_count // 200):
        sweep.planned(index)
    assert (time.process_time() - began) / 200 < 1e-3


def test_same_samples_along_axes() -> None:
    """Along the named axes samples are the same, along the others and between blocks they are not."""
    grid = {"tolerance": [1e-6, 1e-9], "frequency": [5, 10]}
    sweep = load_sweep(blocks({"grid": grid}, {"grid": grid}, same_samples_along=["tolerance"]))
    values = drawn(sweep, 24).reshape(2, 2, 2, 3, -1)
    assert (values[:, 0] == values[:, 1]).all()
    distinct = values[:, 0].reshape(12, -1)
    assert all(len(set(column)) == 12 for column in distinct.T)
    apart = drawn(load_sweep(blocks({"grid": grid}, {"grid": grid})), 24)
    assert all(len(set(column)) == 24 for column in apart.T)


def test_same_samples_about_different_means() -> None:
    """Along an axis of means, the same standard normal numbers are drawn about each."""
    sweep = load_sweep(content(grid={"floor_friction": [0.3, 0.5]}, same_samples_along=["floor_friction"]))
    values = drawn(sweep, 6).reshape(2, 3, -1)
    friction = sweep.blocks[0].drawn.index("floor_friction")
    assert values[1, :, friction] - values[0, :, friction] == pytest.approx(np.full(3, 0.2), rel=1e-12)
    assert (np.delete(values[0], friction, axis=1) == np.delete(values[1], friction, axis=1)).all()


# Distributions


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({}, [*TABLE_1, "phase", "clearance"]),
        ({"distributions": {"all": "table"}}, [*TABLE_1, "phase", "clearance"]),
        ({"scene": {"phase": 0.5}}, [*TABLE_1, "clearance"]),
        ({"grid": {"clearance": [0.01]}}, [*TABLE_1, "phase"]),
        ({"grid": {"link_length": [0.013]}}, [*TABLE_1, "phase", "clearance"]),
        ({"distributions": {"all": "fixed", "phase": "table"}}, ["phase"]),
        ({"distributions": {"all": "fixed"}, "samples": 1}, []),
        (
            {
                "distributions": {
                    "all": "fixed",
                    "clearance": {"gaussian": {"sigma": 0.001}},
                    "frequency": {"uniform": [10, 20]},
                    "gravity": UNIFORM,
                    "link_length": "table",
                },
                "grid": {"links": [60]},
            },
            ["link_length", "gravity", "frequency", "clearance"],
        ),
        (
            {"distributions": {name: "fixed" for name in TABLE_1}, "parameters": {"floor_friction": 0.3}},
            ["phase", "clearance"],
        ),
    ],
)
def test_what_is_drawn(changes: dict[str, Any], names: list[str]) -> None:
    """Table 1, phase and clearance unless said otherwise; a set phase or clearance stays, a set parameter is a mean."""
    sweep = load_sweep(content(**changes))
    assert list(sweep.blocks[0].drawn) == names == list(sweep.planned(0).drawn)
    setup = sweep.planned(0).setup
    if "phase" not in names:
        assert setup.scene.phase == changes.get("scene", {}).get("phase", 0.0)
    if "floor_friction" not in names:
        assert setup.parameters.floor_friction == changes.get("parameters", {}).get("floor_friction", 0.27)


CASES = {
    "viscous_friction": ({"gaussian": {"mean": 1e-4, "sigma": 2e-5}}, stats.norm(1e-4, 2e-5), 0.0, math.inf),
    "floor_restitution": ({"gaussian": {"mean": 0.005, "sigma": 0.01}}, stats.norm(0.005, 0.01), 0.0, 1.0),
    "chain_restitution": ({"gaussian": {"sigma": 0.3}}, stats.norm(0.8, 0.3), 0.0, 1.0),
    "floor_friction": ({"uniform": [0.2, 0.3]}, stats.uniform(0.2, 0.1), 0.0, 1.0),
    "gravity": ({"uniform": [0, 20]}, stats.uniform(0, 20), 0.0, math.inf),
    "inner_mass": ("table", stats.norm(3.7e-3, 2e-6), 0.0, math.inf),
    "frequency": ({"gaussian": {"mean": 15, "sigma": 1}}, stats.norm(15, 1), 0.0, math.inf),
    "phase": ({"uniform": [0, 1]}, stats.uniform(0, 1), 0.0, 1.0),
    "clearance": ("table", stats.uniform(0.005, 0.01), 0.0, math.inf),
}


@pytest.mark.parametrize(("sampler", "samples"), [("random", 2000), ("sobol", 1024), ("latin_hypercube", 1000)])
def test_distributions(sampler: str, samples: int) -> None:
    """Every quantity follows its own truncated distribution (Kolmogorov–Smirnov), whatever the sampler."""
    given = {name: form for name, (form, *_) in CASES.items()}
    sweep = load_sweep(content(sampler=sampler, samples=samples, grid=None, distributions={"all": "fixed", **given}))
    values = dict(zip(sweep.blocks[0].drawn, drawn(sweep, samples).T, strict=True))
    assert set(values) == set(CASES)
    for name, (_, whole, lower, upper) in CASES.items():
        low, high = whole.cdf(lower), whole.cdf(upper)
        result = stats.kstest(values[name], lambda x, w=whole, a=low, b=high: (w.cdf(x) - a) / (b - a))
        assert result.pvalue > 1e-3, name
        assert lower < values[name].min() and values[name].max() < upper, name
        # Designed points fill every quantity far more evenly than random ones, whose distance is about 0.87/√N.
        assert sampler == "random" or result.statistic < 2.5 / samples, name
    correlation = np.corrcoef(np.array(list(values.values()))) - np.eye(len(values))
    assert np.abs(correlation).max() < 5 / math.sqrt(samples)


@pytest.mark.parametrize("ends", [(0.0, 1.0), (-math.inf, 0.5), (0.3, math.inf), (6.0, 7.0), (-40.0, -7.0), (9.0, 9.1)])
def test_quantiles_of_truncated_gaussians(ends: tuple[float, float]) -> None:
    """Quantiles agree with SciPy's truncated Gaussian, far in both tails too."""
    gaussian = Gaussian(0.25, 0.5, Bounds(*(0.25 + 0.5 * end for end in ends)))
    for fraction in (1e-12, 1e-3, 0.3, 0.5, 0.9, 1 - 1e-9):
        expected = stats.truncnorm(*ends, loc=0.25, scale=0.5).ppf(fraction)
        assert gaussian.quantile(fraction) == pytest.approx(expected, rel=1e-8, abs=1e-12)


def test_shares_and_quantiles_stay_inside() -> None:
    """The share of physical draws is that of the interval; quantiles never leave it."""
    assert Gaussian(0.0, 2.0, Bounds(0.0)).share() == pytest.approx(0.5)
    assert Gaussian(0.0, 1.0, Bounds(-1.0, 1.0)).share() == pytest.approx(0.6826894921)
    half = Uniform(0.0, 1.0, Bounds(0.5))
    assert (half.share(), half.quantile(0.0), half.quantile(0.5)) == (0.5, 0.5, 0.75)
    with pytest.raises(ValueError, match="no mean"):
        Gaussian(None, 1.0, Bounds(0.0)).quantile(0.5)


@pytest.mark.parametrize("sampler", ["random", "sobol", "latin_hypercube", "saltelli"])
def test_every_planned_walk_is_possible(sampler: str) -> None:
    """A sample whose chain does not reach round its sprocket is drawn again as a whole, the d + 2 walks together."""
    radius = 0.0602  # 32 links reach round 64.68 mm, where the joints ride if the radius is 60.48 mm
    base = resolve("soft", scene={"links": 32}, options={}, parameters={"sprocket_radius": radius})
    assert fewest_links(base.scene, base.parameters) == 32
    with pytest.raises(InputError):
        resolve("soft", scene={"links": 32}, options={}, parameters={"sprocket_radius": radius + 0.0005})
    names = ["sprocket_radius", "phase"]
    sweep = load_sweep(
        content(
            sampler=sampler,
            samples=64,
            grid={"links": [32, 60]},
            parameters={"sprocket_radius": radius},
            distributions={"all": "fixed", **{name: "table" for name in names}},
            same_samples_along=["links"],
        )
    )
    walks = [sweep.planned(index) for index in range(sweep.walk_count)]
    for walk in walks:
        check_scene(walk.setup.scene, walk.setup.parameters)
    per_sample = 4 if sampler == "saltelli" else 1
    values = drawn(sweep, sweep.walk_count).reshape(2, 64, per_sample, 2)
    redrawn = (values[0] != values[1]).any(axis=(1, 2))
    assert 5 < redrawn.sum() < 60
    longest = max(walk.setup.parameters.sprocket_radius for walk in walks[: len(walks) // 2])
    impossible = (values[1, :, :, 0] > longest).any(axis=1)
    assert (redrawn == impossible).all()
    if sampler == "random":
        for sample in range(64):
            rng = random_generator(7, 0, sample)
            pair = rng.normal(radius, 5e-4), rng.random()
            while pair[0] > longest:
                pair = rng.normal(radius, 5e-4), rng.random()
            assert tuple(values[0, sample, 0]) == pair
    if sampler == "saltelli":
        first, second, *crossed = values[0].transpose(1, 0, 2)
        for number, points in enumerate(crossed):
            assert (points[:, number] == second[:, number]).all()
            assert (points[:, 1 - number] == first[:, 1 - number]).all()


# Designed samples


def unit_cube(names: list[str], sampler: str, samples: int, seed: int = 7) -> Sweep:
    """A sweep of one cell that draws fractions, uniform from 0 to 1."""
    return load_sweep(
        content(
            seed=seed,
            sampler=sampler,
            samples=samples,
            grid=None,
            distributions={"all": "fixed", **{name: {"uniform": [0, 1]} for name in names}},
        )
    )


FRACTIONS = ["floor_restitution", "floor_friction", "chain_restitution", "chain_friction"]


def test_sobol_points_are_even() -> None:
    """Scrambled Sobol points have a discrepancy far below that of random ones, and another for each cell and seed."""
    discrepancy = {
        sampler: stats.qmc.discrepancy(drawn(unit_cube(FRACTIONS, sampler, 256), 256))
        for sampler in ("random", "sobol")
    }
    assert discrepancy["sobol"] < 0.1 * discrepancy["random"]
    others = [unit_cube(FRACTIONS, "sobol", 8, seed) for seed in (7, 8)]
    assert (drawn(others[0], 8) != drawn(others[1], 8)).all()
    cells = drawn(load_sweep(content(sampler="sobol", samples=8)), 32).reshape(4, 8, -1)
    assert all((a != b).all() for a, b in itertools.combinations(cells, 2))


def test_latin_hypercube_has_one_point_in_each_stratum() -> None:
    """Each of N equal parts of every quantity holds exactly one of N samples."""
    points = drawn(unit_cube(FRACTIONS, "latin_hypercube", 50), 50)
    assert (np.sort((points * 50).astype(int), axis=0) == np.arange(50)[:, None]).all()


def ishigami(points: np.ndarray) -> np.ndarray:
    """The function of Ishigami and Homma (1990), a = 7, b = 0.1, of points in the unit cube, shape (N, 3)."""
    x, y, z = math.pi * (2 * points.T - 1)
    return np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)


def test_saltelli_gives_known_sobol_indices() -> None:
    """From the walks of a `saltelli` cell, SciPy and this package find the indices of the Ishigami function."""
    sweep = unit_cube(FRACTIONS[:3], "saltelli", 1024)
    assert sweep.blocks[0].shape == (1024 * 5,)
    values = ishigami(drawn(sweep, sweep.walk_count))
    outputs = saltelli_outputs(values, 3)
    assert [outputs[key].shape for key in ("f_A", "f_B", "f_AB")] == [(1, 1024), (1, 1024), (3, 1, 1024)]
    scipy = stats.sobol_indices(func=outputs, n=1024)
    first, total = sobol_indices(outputs)
    assert first == pytest.approx(scipy.first_order, rel=1e-10, abs=1e-12)
    assert total == pytest.approx(scipy.total_order, rel=1e-10)
    assert first == pytest.approx([0.3139, 0.4424, 0.0], abs=0.1)
    assert total == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.1)


def test_failed_walks_cost_their_sample_only() -> None:
    """A walk without result takes its sample out of the indices and changes the others little."""
    sweep = unit_cube(FRACTIONS[:3], "saltelli", 512)
    values = ishigami(drawn(sweep, sweep.walk_count))
    whole = saltelli_outputs(values, 3)
    values[[0, 4, 1234]] = math.nan
    outputs = saltelli_outputs(values, 3)
    for key, result in outputs.items():
        assert (result == np.delete(whole[key], [0, 1234 // 5], axis=-1)).all()
    for index, all_of_them in zip(sobol_indices(outputs), sobol_indices(whole), strict=True):
        assert index == pytest.approx(all_of_them, abs=0.03)
    nothing = sobol_indices(saltelli_outputs(np.full(10, math.nan), 3))
    constant = sobol_indices(saltelli_outputs(np.ones(10), 3))
    assert np.isnan([*nothing, *constant]).all()
    with pytest.raises(ValueError, match="reshape"):
        saltelli_outputs(values[1:], 3)


# Digest


def digest(given: Mapping[str, Any]) -> str:
    """Digest of a sweep's content."""
    return load_sweep(given).digest()


@pytest.mark.parametrize(
    "change",
    [
        {"name": "another"},
        {"grid": {"links": {"from": 60, "to": 90, "step": 30}, "frequency": [5.0, 10.0]}},
        {"scene": {"start": "rest", "phase": None}},
        {"scene": {"start": "rest"}, "options": {}, "distributions": {"all": "table"}},
        {"options": {"method": "standard"}},
        {"parameters": {"gravity": 9.809}},
        {"sampler": "random", "record": {"series": False}, "same_samples_along": []},
        {"distributions": {"floor_friction": {"gaussian": {"sigma": 0.02}}, "phase": {"uniform": [0, 1]}}},
        {"blocks": [{"name": "x", "grid": {"links": [60, 90], "frequency": [5, 10]}}], "grid": None},
    ],
)
def test_digest_ignores_what_does_not_matter(change: dict[str, Any]) -> None:
    """Names and other ways to say the same leave the digest as it is."""
    scene = change.get("scene", {})
    change = {**change, **({"scene": {key: value for key, value in scene.items() if value is not None}})}
    assert digest(content(**change)) == digest(content())


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
        {"grid": {"links": [90, 60], "frequency": [5, 10]}},
        {"same_samples_along": ["links"]},
        {"record": {"series": True}},
        {"record": {"series": {"interval": 2e-3}}},
        {"record": {"series": {"samples": [0]}}},
        {"record": {"series": True, "frames": True}},
        {"same_samples_along": ["frequency"]},
        {"distributions": {"phase": {"uniform": [0, 0.5]}}},
        {"distributions": {"phase": "fixed"}},
        {"distributions": {"floor_friction": {"gaussian": {"mean": 0.27, "sigma": 0.021}}}},
        {"grid": {"preset": ["paper", "soft"]}, "preset": None},
        {"grid": {"preset": ["paper", "soft"]}, "preset": None, "parameters": {"gravity": 9.81}},
    ]
    assert len({digest(content(**change)) for change in changes}) == len(changes)


def test_digest_holds_the_presets_of_an_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    """If the values behind a preset's name change, so does the digest, also where the preset is an axis."""
    sweeps = [content(), content(grid={"preset": ["paper", "soft"]}, preset=None)]
    before = [digest(given) for given in sweeps]
    monkeypatch.setitem(PRESETS, "soft", preset("soft").with_values({"joint_damping": 99}))
    assert all(digest(given) != old for given, old in zip(sweeps, before, strict=True))


@pytest.mark.parametrize(
    "given",
    [
        content(),
        content(sampler="saltelli", samples=2, distributions={"floor_friction": UNIFORM}),
        content(grid={"preset": ["paper", "soft"]}, preset=None, parameters={"gravity": 10, "outer_mass": 3e-3}),
        content(record={"series": {"samples": [2, 0]}, "frames": {"samples": [2], "interval": 0.01}}),
        content(scene={"phase": 0.25}, grid={"clearance": [0.01], "floor_friction": [0.2]}),
        blocks({"scene": {"start": "ellipse"}}, {"samples": 1, "distributions": {"all": "fixed"}}),
    ],
)
def test_canonical_form(given: dict[str, Any]) -> None:
    """The canonical form is plain JSON, and the sweep of it is the same sweep."""
    sweep = load_sweep(given)
    text = json.dumps(sweep.canonical(), allow_nan=False)
    again = load_sweep(json.loads(text))
    assert again.canonical() == sweep.canonical()
    assert again.digest() == sweep.digest()
    assert [again.planned(i) for i in range(again.walk_count)] == [sweep.planned(i) for i in range(again.walk_count)]


# Shipped sweeps


@pytest.mark.parametrize(
    ("name", "shapes"),
    [
        ("quickstart", {"main": (2, 3, 4)}),
        ("figure6", {"rest": (5, 6, 12), "ellipse": (2, 6, 12)}),
        ("tolerance", {"main": (2, 2, 2, 12)}),
        ("montecarlo", {"main": (7, 8, 1800)}),
        ("steadiness", {"default": (2, 2, 16), "held": (2, 2, 16)}),
        (
            "sensitivity",
            {"ranges": (64 * 17,), "measured": (32 * 14,)} | {name: (3, 8) for name in Parameters.model_fields},
        ),
    ],
)
def test_shipped_sweeps(name: str, shapes: dict[str, tuple[int, ...]]) -> None:
    """Each shipped file loads, is named as its file and has the walks that it promises."""
    sweep = load_sweep(SWEEPS / f"{name}.yaml")
    assert sweep.name == name
    assert {block.name: block.shape for block in sweep.blocks} == shapes
    walks = sum(math.prod(shape) for shape in shapes.values())
    assert sweep.walk_count == walks
    for index in {0, walks // 2, walks - 1}:
        assert sweep.planned(index).setup.preset == ("paper" if name == "figure6" else "soft")


def test_every_shipped_sweep_is_tested() -> None:
    """No other file is in the folder."""
    names = {path.stem for path in SWEEPS.iterdir()}
    assert names == {"quickstart", "figure6", "tolerance", "montecarlo", "sensitivity", "steadiness"}


def test_figure6_follows_the_paper() -> None:
    """Figure 6: n = 60 … 180, ν = 5 … 30 Hz, 12 samples; rest everywhere, ellipses for n = 150 and 180."""
    rest, ellipse = load_sweep(SWEEPS / "figure6.yaml").blocks
    assert rest.axes == {"links": (60, 90, 120, 150, 180), "frequency": (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)}
    assert ellipse.axes == {"links": (150, 180), "frequency": rest.axes["frequency"]}
    for block, start in ((rest, "rest"), (ellipse, "ellipse")):
        assert load_sweep(SWEEPS / "figure6.yaml").planned(block.first).setup.scene.start == start
        assert block.drawn == (*TABLE_1, "phase", "clearance")


def test_tolerance_repeats_the_same_samples() -> None:
    """In `tolerance` walks that differ in the tolerance alone share everything else."""
    sweep = load_sweep(SWEEPS / "tolerance.yaml")
    for cell in range(4):
        for sample in (0, 11):
            loose, tight = (sweep.planned(24 * cell + 12 * place + sample).setup for place in (0, 1))
            assert (loose.options.tolerance, tight.options.tolerance) == (1e-6, 1e-9)
            assert (loose.scene, loose.parameters) == (tight.scene, tight.parameters)


def test_sensitivity_varies_every_quantity() -> None:
    """In `sensitivity` each parameter has a block around its Table-1 value with the same releases at every value."""
    sweep = load_sweep(SWEEPS / "sensitivity.yaml")
    by_name = {block.name: block for block in sweep.blocks}
    assert by_name["measured"].drawn == (*TABLE_1, "phase", "clearance")
    assert set(by_name["ranges"].drawn) == {
        name for name, q in Parameters.quantities().items() if q.source in ("measured", "looked up")
    } | {"phase", "clearance"}
    for name, quantity in Parameters.quantities().items():
        block = by_name[name]
        assert block.axes.keys() == {name} and block.drawn == ("phase", "clearance")
        assert getattr(preset("soft"), name) in block.axes[name]
        walks = [sweep.planned(block.first + 8 * place) for place in range(3)]
        assert len({walk.setup.scene for walk in walks}) == 1
        assert [getattr(walk.setup.parameters, name) for walk in walks] == list(block.axes[name])
        if name in by_name["ranges"].drawn:
            ends = by_name["ranges"].plan.distributions[name]
            assert isinstance(ends, Uniform)
            assert (ends.lower, ends.upper) == pytest.approx((0.8 * quantity.value, 1.2 * quantity.value))
