"""Sweeps: files, values, blocks and refusals."""

import copy
import itertools
import pickle
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.sweep_content import TABLE_1, UNIFORM, blocks, content
from warpchain.inputs.validation import InputError
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.sizes import CELL_LIMIT


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
    assert (first.scene.frequency, first.options.tolerance, first.options.method) == (15, 1e-7, "hybrid")
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
        (content(scene={"frequncy": 5}), "sweep.scene.frequncy: unknown name; did you mean frequency?"),
        (content(scene={"gravity": 5}), "sweep.scene.gravity: unknown name; did you mean parameters.gravity?"),
        (content(scene=[5]), "sweep.scene: [5] is not a mapping; give keys with values"),
        (content(scene={"clearance": "1 cm"}), "sweep.scene.clearance: '1 cm' has a unit written with it"),
        (content(scene={"clearance": None}), "sweep.scene.clearance: empty; give a plain number in m"),
        (
            content(options={"method": "rk4"}),
            "sweep.options.method: 'rk4' is unknown; give one of standard, explicit, reference,",
        ),
        (content(options={"method": "rodas5p"}), "sweep.options.method: 'rodas5p' was removed; give dp5"),
        (
            content(options={"device": "cuda", "method": "hybrid"}),
            "sweep.options.method: 'hybrid' runs on a CPU only; give explicit, or device: cpu",
        ),
        (
            content(options={"device": "cuda"}, grid={"method": ["os32", "hybrid"]}),
            "sweep.grid.method[1]: 'hybrid' runs on a CPU only; give explicit, or device: cpu",
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
            content(record={"series": {"interval": 10**400}}),
            "sweep.record.series.interval: 1000",
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
        (
            content(scene={"floor_frictoin": 0.3}),
            "sweep.scene.floor_frictoin: unknown name; did you mean parameters.floor_friction?",
        ),
        (
            content(parameters={"mu_fc": 0.3, "floor_friction": 0.3}),
            "sweep.parameters.floor_friction: also given as sweep.parameters.mu_fc; leave one out",
        ),
        (content(parameters={"mu_fc": 3}), "sweep.parameters.mu_fc: 3 is greater than 1; give 1 or less"),
        (content(grid={"mu": [0.3]}), "sweep.grid.mu: unknown name; did you mean mu_fc, mu_cc or mu_sc?"),
        (content(grid={"mu_fc": [0.3, 3]}), "sweep.grid.mu_fc[1]: 3 is greater than 1; give 1 or less"),
        (
            content(grid={"nu": [5]}, scene={"frequency": 5}),
            "sweep.grid.nu: also given in sweep.scene; leave one out",
        ),
        (
            content(same_samples_along=["links", "n"]),
            "sweep.same_samples_along[1]: 'n' is given twice; leave one out",
        ),
        (content(grid=[60]), "sweep.grid: [60] is not a mapping"),
        (content(grid={"lniks": [60]}), "sweep.grid.lniks: unknown name; did you mean links?"),
        (content(grid={"links": 60}), "sweep.grid.links: 60 is no list; give a list such as [60], or {from:, to:"),
        (content(grid={"links": []}), "sweep.grid.links: empty; give one item or more"),
        (content(grid={"frequency": [15, 1e200]}), "sweep.grid.frequency[1]: 1e+200 is greater than 10000 Hz"),
        (content(grid={"links": [60, 1026]}, options={"device": "cuda"}), "sweep.grid.links[1]: 1026 links are more"),
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
            content(grid={"method": ["standard", "reference"]}),
            "sweep.grid: tolerance is 0.003 in one cell and 1e-06 in another, as methods or devices have it; give",
        ),
        (
            content(grid={"method": ["rkf78", "hybrid"]}, options={}),
            "sweep.grid: tolerance is 1e-06 in one cell and 0.0001 in another, as methods or devices have it; give "
            "tolerance once for all, or each such method, and each kind of device, a block of its own",
        ),
        (
            content(grid={"device": ["cpu", "cuda"]}, options={}),
            "sweep.grid: method is 'hybrid' in one cell and 'os32' in another, as methods or devices have it; give",
        ),
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
        (
            content(distributions={"links": "fixed"}),
            "sweep.distributions.links: unknown name; give one of all, ",
        ),
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
            f"sweep.grid: 109989 cells, at most {CELL_LIMIT} are possible; give fewer values",
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
