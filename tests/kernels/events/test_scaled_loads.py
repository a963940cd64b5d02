"""Multiplied loads: what they are made of, which waves they follow from, and that the loop is the same under them."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
import warp as wp
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from tests.support.driven_loops import hold, released_loop
from warpchain import preset
from warpchain.engine.devices import start_device
from warpchain.inputs.parameters import Parameters
from warpchain.kernels import layout
from warpchain.kernels.physics.scaled_loads import crossing_time, drag_shape, under_load, write_inertias
from warpchain.kernels.types import Chain

Array = NDArray[np.float64]

PAPER, SOFT = preset("paper"), preset("soft")
FIELDS = tuple(Chain.vars)
CPU = start_device("cpu").warp


# --- what is multiplied ---


@wp.kernel(module="unique", enable_backward=False)
def _load(chains: wp.array(dtype=Chain), factors: wp.array(dtype=wp.float64), inertias: wp.array3d(dtype=wp.float64)):
    i = wp.tid()
    chains[i] = under_load(chains[i], factors[i])
    write_inertias(inertias[i], chains[i])


def loaded(parameters: Parameters, factor: float, links: int = 4) -> tuple[dict[str, float], Array]:
    """A chain `under_load` by the names of its fields, and the rows (2, n) of inertias and their inverses."""
    chain = Chain()
    for name in FIELDS:
        if hasattr(parameters, name):
            setattr(chain, name, getattr(parameters, name))
    chain.link_count, chain.half_length = links, parameters.link_length / 2
    chain.inverse_smoothing = 1 / parameters.friction_smoothing
    chains = wp.array([chain], dtype=Chain, device=CPU)
    rows = wp.full((1, layout.INVERSE_INERTIA + 1, links), np.nan, dtype=wp.float64, device=CPU)
    wp.launch(_load, dim=1, inputs=[chains, wp.array([factor], dtype=wp.float64, device=CPU), rows], device=CPU)
    after = chains.numpy()[0]
    return {name: after[name].item() for name in FIELDS}, rows.numpy()[0, [layout.INERTIA, layout.INVERSE_INERTIA]]


UNEQUAL = PAPER.with_values({"inner_inertia": 4.4e-8, "outer_inertia": 1.1e-7})
"""Links of two kinds, one with less and one with more rotary inertia than m ℓ²/6."""


def test_a_factor_of_one_changes_no_bit() -> None:
    """Under its own loads a chain is what it is, to the bit, and so are the rows of its inertias."""
    for parameters in (PAPER, SOFT, UNEQUAL):
        after, rows = loaded(parameters, 1.0)
        for name in FIELDS:
            if hasattr(parameters, name):
                assert after[name] == getattr(parameters, name), name
        assert after["half_length"] == parameters.link_length / 2
        inertia = np.array([parameters.inner_inertia, parameters.outer_inertia] * 2)
        assert_array_equal(rows, [inertia, 1 / inertia])


@pytest.mark.parametrize("factor", [1.5, 15.0, 100.0])
def test_loads_are_multiplied(factor: float) -> None:
    """g, β and τ_c are λ times as great, and so is I − m ℓ²/6 of either kind of link; all else is as before."""
    own, _ = loaded(UNEQUAL, 1.0)
    after, rows = loaded(UNEQUAL, factor)
    kinds = {"inner_inertia": UNEQUAL.inner_mass, "outer_inertia": UNEQUAL.outer_mass}
    loads = ("gravity", "viscous_friction", "coulomb_friction")
    for name in loads:
        assert after[name] == pytest.approx(factor * own[name], rel=1e-15)
    for name, mass in kinds.items():
        apparent = mass * UNEQUAL.link_length**2 / 6
        assert after[name] - apparent == pytest.approx(factor * (own[name] - apparent), rel=1e-12)
    assert after["inner_inertia"] < own["inner_inertia"] and after["outer_inertia"] > own["outer_inertia"]
    assert {n: after[n] for n in FIELDS if n not in (*loads, *kinds)} == {
        n: own[n] for n in FIELDS if n not in (*loads, *kinds)
    }
    inertia = [after["inner_inertia"], after["outer_inertia"]] * 2
    assert_array_equal(rows, [inertia, np.reciprocal(inertia)])


# --- the loop stays ---


def test_a_stationary_loop_stays_as_it_is_under_load() -> None:
    """Under loads that are 15 times as great, drag and all, it keeps height, width and curvature."""
    loop = released_loop(links=60, frequency=20.0, start="spinning")
    own, loaded = hold(loop, SOFT, 0.5), hold(loop, SOFT, 1.0, load_factor=15.0)
    height, width, curvature = own[[0, 1, 4]]
    change = np.abs(loaded - own) / [height, width, width, height, curvature]
    assert np.all(change < [0.002, 0.005, 0.003, 0.002, 0.01]), change


# --- drag ---


@wp.kernel(module="unique", enable_backward=False)
def _drag(chains: wp.array(dtype=Chain), blocks: wp.array3d(dtype=wp.float64), left: wp.array(dtype=wp.float64)):
    i = wp.tid()
    drag_shape(blocks[i], chains[i], left[i])


def dragged(angle: Array, velocity: Array, left: float) -> Array:
    """Velocities (n, 2) after `drag_shape`, of links at angles (n,) with velocities (n, 2)."""
    chain = Chain()
    chain.link_count = len(angle)
    block = np.full((1, layout.SINE + 1, len(angle)), np.nan)
    block[0, [layout.COSINE, layout.SINE]] = np.cos(angle), np.sin(angle)
    block[0, [layout.U, layout.V]] = velocity.T
    blocks = wp.array(block, dtype=wp.float64, device=CPU)
    parts = wp.array([left], dtype=wp.float64, device=CPU)
    wp.launch(_drag, dim=1, inputs=[wp.array([chain], dtype=Chain, device=CPU), blocks, parts], device=CPU)
    after = blocks.numpy()[0]
    given_rows = [layout.COSINE, layout.SINE]
    assert_array_equal(after[given_rows], block[0, given_rows])
    return after[[layout.U, layout.V]].T


@pytest.mark.parametrize("left", [0.01, 0.5, 0.99])
@pytest.mark.parametrize(("links", "sense"), [(4, 1), (60, -1), (181, 1)])
def test_drag_leaves_a_turning_polygon_alone(links: int, sense: int, left: float) -> None:
    """Links that all move along one circle keep their velocities to rounding, whichever way round it is."""
    angle = 0.3 + sense * 2 * np.pi * np.arange(links) / links
    velocity = 7.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for speed in (velocity, -velocity):
        assert_allclose(dragged(angle, speed, left), speed, atol=1e-12 * 7.5)


@pytest.mark.parametrize("left", [0.0, 0.3, 1.0])
def test_drag_multiplies_the_velocity_across_the_path(left: float) -> None:
    """Across a straight row of links this part is left of their velocity; what is along the row stays."""
    angle = np.full(20, 0.7)
    along, across = np.array([np.cos(0.7), np.sin(0.7)]), np.array([-np.sin(0.7), np.cos(0.7)])
    after = dragged(angle, np.tile(3.0 * along - 2.0 * across, (20, 1)), left)
    assert_allclose(after, np.tile(3.0 * along - left * 2.0 * across, (20, 1)), rtol=1e-14)


# --- how long slow waves take ---


def crossing_times(cases: Sequence[tuple[float, float, float, float]]) -> Array:
    """`crossing_time` of many loops: speed, gravity, sprocket's radius, height."""
    columns = [wp.array(column, dtype=wp.float64, device=CPU) for column in zip(*cases, strict=True)]
    return wp.map(crossing_time, *columns).numpy()


@pytest.mark.parametrize("speed", [0.0, 0.1, 2.0, 7.5, 30.0])
@pytest.mark.parametrize("gravity", [9.81, 490.0])
@pytest.mark.parametrize("height", [0.1, 1.1])
def test_crossing_time_is_the_integral_of_the_slow_waves_slowness(speed: float, gravity: float, height: float) -> None:
    """2 ∫ dy / (√(v² + g (y + ρ/2)) − v) over the loop's height, by Gauss and Legendre in 200 points."""
    radius = 0.06
    nodes, weights = np.polynomial.legendre.leggauss(200)
    y = height / 2 * (nodes + 1)
    pull = gravity * (y + radius / 2)
    slow = pull / (np.sqrt(speed**2 + pull) + speed)
    expected = 2 * height / 2 * float(weights @ (1 / slow))
    assert crossing_times([(speed, gravity, radius, height)])[0] == pytest.approx(expected, rel=1e-6)


def test_nothing_crosses_without_weight() -> None:
    """Slow waves stand still in a loop without weight, or on a sprocket that turns too fast for it to matter."""
    times = crossing_times([(7.5, 0.0, 0.06, 1.0), (0.0, 0.0, 0.06, 1.0), (1e6, 9.81, 0.06, 1.0)])
    assert np.all(times >= 1e9) and np.all(np.isfinite(times))
    assert math.isfinite(crossing_times([(100.0, 9.81, 0.06, 1.0)])[0])
