"""What the walks of a sweep draw: random numbers, distributions, designed samples."""

import math
import re
import time
import tracemalloc
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tests.support.setups import setup_walk
from tests.support.sweep_content import TABLE_1, UNIFORM, blocks, content, drawn
from warpchain.chain.resolution import resolve
from warpchain.inputs.distributions import TABLE, Gaussian, Uniform, draw, random_generator
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError
from warpchain.sweeps.designs import RANDOMISATIONS, design_points, sobol_indices
from warpchain.sweeps.plan import load_sweep

# Random numbers


@pytest.mark.parametrize("sampler", ["random", "sobol", "latin_hypercube", "saltelli"])
def test_walks_depend_on_their_index_only(sampler: str) -> None:
    """A planned walk is the same whatever was planned before it, and all walks differ."""
    given = content(sampler=sampler, samples=4)
    sweep = load_sweep(given)
    walks = [sweep.walk(index) for index in sweep.indices.tolist()]
    order = np.random.default_rng(1).permutation(sweep.indices).tolist()
    design_points.cache_clear()
    other = load_sweep(given)
    assert {index: other.walk(index) for index in order} == {walk.index: walk for walk in walks}
    assert len({tuple(walk.draws.values()) for walk in walks}) == len(walks)


def test_an_index_stays_when_samples_are_added() -> None:
    """The walk of an index is the same in a sweep with more samples, of any block; new samples have new indices."""
    grid = {"links": [60, 90]}
    few = load_sweep(blocks({"grid": grid}, {"samples": 2}, {"sampler": "saltelli", "samples": 2}))
    many = load_sweep(blocks({"grid": grid, "samples": 5}, {"samples": 8}, {"sampler": "saltelli", "samples": 4}))
    for index in few.indices.tolist():
        one, other = (
            (walk.block, walk.cell, walk.sample, walk.setup.scene) for walk in (few.walk(index), many.walk(index))
        )
        assert one == other
    assert len(set(many.indices.tolist())) == many.walk_count


def test_first_sample_is_that_of_a_single_walk() -> None:
    """Sample 0 of cell 0 is what a single walk draws from the same seed; the others follow the same rule."""
    settings = {"links": 90, "frequency": 12.0, "floor_friction": 0.1}
    for seed in (0, 7, 2**127):
        parts = {"scene": {"links": 90, "frequency": 12.0}, "parameters": {"floor_friction": 0.1}}
        sweep = load_sweep(content(seed=seed, **parts, grid={"tolerance": [1e-3, 1e-7]}))
        assert sweep.walk(0).setup == setup_walk("soft", settings | {"tolerance": 1e-3}, seed)
        base = resolve("soft", **parts, options={"tolerance": 1e-7})
        laws = base.placed({name: law for name, law in TABLE.items() if name != "floor_friction"})
        sample = base.with_drawn(draw(laws, random_generator(seed, 1, 2)))
        assert sweep.walk(sweep.indices[5]).setup == sample


def test_large_sweeps_cost_nothing() -> None:
    """A sweep of 10⁷ walks is loaded and its walks are planned in little time and memory, wherever they are."""
    load_sweep(content()).walk(0)
    tracemalloc.start()
    try:
        sweep = load_sweep(content(samples=2**17, grid={"frequency": {"from": 1, "to": 100, "step": 1}}))
        assert sweep.walk_count == 100 * 2**17
        for index in (0, 10**6, sweep.walk_count - 1):
            assert sweep.walk(index).sample == index // 100
        assert tracemalloc.get_traced_memory()[1] < 2e6
    finally:
        tracemalloc.stop()
    began = time.process_time()
    for index in range(0, sweep.walk_count, sweep.walk_count // 200):
        sweep.walk(index)
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


@pytest.mark.parametrize("sampler", ["random", "sobol", "saltelli"])
def test_what_is_independent_differs_along_such_axes(sampler: str) -> None:
    """All but the independent quantities are as without them; these differ in all cells and samples."""
    given = content(sampler=sampler, samples=4, same_samples_along=["links", "frequency"])
    tied, own = load_sweep(given), load_sweep(given | {"independent": ["clearance", "mu_fc"]})
    names = list(own.walk(0).draws)
    alone = [names.index(name) for name in ("floor_friction", "clearance")]
    before, after = drawn(tied, tied.walk_count), drawn(own, own.walk_count)
    shared = [k for k in range(len(names)) if k not in alone]
    if sampler != "saltelli":  # which changes them one by one, too
        assert (before[:, shared] == after[:, shared]).all()
        assert all(len(set(column)) == own.walk_count for column in after[:, alone].T)
    cells = after.reshape(4, -1, len(names))
    assert (cells[:, :, shared] == cells[:1, :, shared]).all() and not (cells[0] == cells[1])[:, alone].any()
    assert load_sweep(own.canonical()).digest() == own.digest() != tied.digest()


@pytest.mark.parametrize(
    ("names", "problem"),
    [
        (["frequency"], "sweep.independent: 'frequency' is not sampled; use one of clearance"),
        (["clearence"], "sweep.independent: 'clearence' is not sampled; did you mean clearance?"),
        ("clearance", "sweep.independent: expected a list"),
    ],
)
def test_only_drawn_quantities_are_independent(names: Any, problem: str) -> None:
    """Others are refused by name."""
    with pytest.raises(InputError, match=re.escape(problem)):
        load_sweep(content(independent=names))


# Distributions


@pytest.mark.parametrize("name", TABLE_1)
@pytest.mark.parametrize("others", [{}, {"all": "table"}])
def test_values_on_an_axis_are_exact_unless_scatter_is_asked_for(name: str, others: dict[str, Any]) -> None:
    """Every walk has the very value of its cell, and all else is drawn; the name with `table` draws about the value."""
    value = Parameters.quantities()[name].value
    given = content(samples=20, grid={name: [1.1 * value, 1.2 * value]})
    exact = load_sweep(given | {"distributions": others})
    found = [getattr(exact.walk(index).setup.parameters, name) for index in exact.indices[:40].tolist()]
    assert found == [1.1 * value] * 20 + [1.2 * value] * 20
    assert list(exact.blocks[0].drawn) == [*(other for other in TABLE_1 if other != name), "phase", "clearance"]
    scattered = load_sweep(given | {"distributions": {**others, name: "table"}})
    assert scattered.blocks[0].drawn == (*TABLE_1, "phase", "clearance") and scattered.digest() != exact.digest()
    values = {getattr(scattered.walk(index).setup.parameters, name) for index in scattered.indices[:40].tolist()}
    assert len(values) == 40


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({}, [*TABLE_1, "phase", "clearance"]),
        ({"scene": {"phase": 0.5}}, [*TABLE_1, "clearance"]),
        ({"grid": {"link_length": [0.013]}}, [*TABLE_1[1:], "phase", "clearance"]),
        ({"parameters": {"link_length": 0.013}}, [*TABLE_1[1:], "phase", "clearance"]),
        ({"distributions": {"all": "fixed", "phase": "table"}}, ["phase"]),
        ({"distributions": {"all": "fixed"}, "samples": 1}, []),
        (
            {"distributions": {"all": "fixed", "frequency": UNIFORM, "g": UNIFORM}, "grid": None},
            ["gravity", "frequency"],
        ),
        ({"distributions": dict.fromkeys(TABLE_1, "fixed"), "parameters": {"mu_fc": 0.3}}, ["phase", "clearance"]),
    ],
)
def test_what_is_drawn(changes: dict[str, Any], names: list[str]) -> None:
    """Table 1, phase and clearance unless said otherwise; an axis and a set phase stay, a set parameter is a mean."""
    sweep = load_sweep(content(**changes))
    assert list(sweep.blocks[0].drawn) == names == list(sweep.walk(0).draws)
    setup = sweep.walk(0).setup
    assert "phase" in names or setup.scene.phase == changes.get("scene", {}).get("phase", 0.0)
    expected = changes.get("parameters", {}).get("mu_fc", 0.27)
    assert "floor_friction" in names or setup.parameters.floor_friction == expected


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
    together = sweep.with_draws([*sweep.undrawn(range(samples))])  # of which some are drawn again
    assert np.array_equal([[*walk.draws.values()] for walk in together], np.transpose([*values.values()]))
    assert set(values) == set(CASES)
    for name, (_, whole, lower, upper) in CASES.items():
        low, high = whole.cdf(lower), whole.cdf(upper)
        result = stats.kstest(values[name], lambda x, w=whole, a=low, b=high: (w.cdf(x) - a) / (b - a))
        assert result.pvalue > 1e-3, name
        assert lower < values[name].min() and values[name].max() < upper, name
        # Each of 8 randomisations has a point in every N/8-th; the distance of random points is about 0.87/√N.
        assert sampler == "random" or result.statistic < RANDOMISATIONS / samples, name
    correlation = np.corrcoef(np.array(list(values.values()))) - np.eye(len(values))
    assert np.abs(correlation).max() < 5 / math.sqrt(samples)


@pytest.mark.parametrize("ends", [(0.0, 1.0), (-math.inf, 0.5), (0.3, math.inf), (6.0, 7.0), (-40.0, -7.0), (9.0, 9.1)])
def test_quantiles_of_truncated_gaussians(ends: tuple[float, float]) -> None:
    """Quantiles agree with SciPy's truncated Gaussian, far in both tails too."""
    gaussian = Gaussian(0.25, 0.5, (0.25 + 0.5 * ends[0], 0.25 + 0.5 * ends[1]))
    for fraction in (1e-12, 1e-3, 0.3, 0.5, 0.9, 1 - 1e-9):
        expected = stats.truncnorm(*ends, loc=0.25, scale=0.5).ppf(fraction)
        assert gaussian.quantile(fraction) == pytest.approx(expected, rel=1e-8, abs=1e-12)


@pytest.mark.parametrize("sampler", ["random", "sobol", "latin_hypercube", "saltelli"])
def test_every_planned_walk_is_possible(sampler: str) -> None:
    """A sample whose chain does not reach round its sprocket is drawn again as a whole, the d + 2 walks together."""
    radius = 0.0602  # 32 links reach round 64.68 mm, where the joints ride if the radius is 60.48 mm
    base = resolve("soft", scene={"links": 32}, options={}, parameters={"sprocket_radius": radius})
    assert base.fewest_links == 32
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
    walks = [sweep.walk(index) for index in sweep.indices.tolist()]
    assert sweep.with_draws([*sweep.undrawn(sweep.indices.tolist())]) == walks
    for walk in walks:
        walk.setup.checked()
    per_sample = 4 if sampler == "saltelli" else 1
    values = drawn(sweep, sweep.walk_count).reshape(2, 64, per_sample, 2)
    redrawn = (values[0] != values[1]).any(axis=(1, 2))
    assert 5 < redrawn.sum() < 60
    longest = max(walk.setup.parameters.sprocket_radius for walk in walks[: len(walks) // 2])
    impossible = (values[1, :, :, 0] > longest).any(axis=1)
    assert (redrawn == impossible).all()


def test_samples_that_are_never_possible_are_refused() -> None:
    """One line names what is drawn, whether one quantity alone or all of them together are never physical."""
    never = Uniform(2.0, 3.0, (0.0, 1.0))
    with pytest.raises(InputError, match=r"^scene\.phase: 1000 samples of .*2\.0, 3\.0.* were all out of bounds"):
        draw({"gravity": Uniform(0.0, 1.0, (0.0, 1.0)), "phase": never}, np.random.default_rng(0))
    too_large = {"all": "fixed", "sprocket_radius": {"uniform": [0.061, 0.07]}}
    problem = r"^sweep\.distributions: none of 1000 samples makes a possible walk; the last: scene\.links: 32 links "
    for sampler in ("random", "sobol"):
        with pytest.raises(InputError, match=problem):
            load_sweep(content(grid=None, scene={"links": 32}, samples=4, sampler=sampler, distributions=too_large))


@pytest.mark.parametrize("name", ["circle_radius", "charm_radius"])
def test_a_seed_draws_what_is_physical(name: str) -> None:
    """Circles, of all links or of one, almost as wide as the mean link cut its Gaussian off: no seed is refused."""
    setups = [setup_walk("soft", {name: 6.3399e-3, "start": "ellipse"}, seed) for seed in range(16)]
    assert min(setup.parameters.link_length for setup in setups) > 2 * 6.3399e-3


# Designed samples


def test_no_variance_has_no_sobol_indices() -> None:
    """Equal results, or none, have NaN for indices."""
    assert np.isnan([*sobol_indices(np.ones((2, 5))), *sobol_indices(np.ones((0, 5)))]).all()
