"""Random samples of parameters and scenes: bounds, distributions, the order of draws."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.table_1 import UNCERTAIN
from warpchain.inputs.distributions import DRAW_LIMIT, random_generator, sampled
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import Scene
from warpchain.inputs.setup import Setup
from warpchain.inputs.validation import InputError


def sample_parameters(base: Parameters, rng: np.random.Generator) -> Parameters:
    """What a sample draws about these parameters."""
    return sampled(Setup("paper", base, Scene(), Options()), rng).parameters


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**128 - 1),
    cell=st.integers(0, 2**32 - 1),
    restitution=st.floats(0, 1),
    friction=st.floats(0, 1),
    mass=st.floats(1e-9, 1e-2),
    radius=st.floats(6.3e-3, 6.3399e-3),
)
def test_samples_are_physical(
    seed: int, cell: int, restitution: float, friction: float, mass: float, radius: float
) -> None:
    """Samples about any physical values stay physical, and what has no uncertainty stays as it is."""
    base = preset("paper").with_values(
        {
            "floor_restitution": restitution,
            "floor_friction": friction,
            "inner_mass": mass,
            "viscous_friction": 0.0,
            "circle_radius": radius,
        }
    )
    drawn = sample_parameters(base, random_generator(seed, cell))
    for name, quantity in Parameters.quantities().items():
        assert quantity.bounds.admit(getattr(drawn, name))
        assert (getattr(drawn, name) != getattr(base, name)) == (name in UNCERTAIN)
    assert drawn.circle_radius < drawn.link_length / 2


def test_draw_order() -> None:
    """Quantities are drawn in the order of the table, one Gaussian each while none is out of bounds."""
    base = preset("paper")
    drawn = sample_parameters(base, random_generator(3, 1, 2))
    rng = np.random.default_rng(np.random.SeedSequence(3, spawn_key=(1, 2)))
    for name, quantity in Parameters.quantities().items():
        if quantity.sigma:
            assert getattr(drawn, name) == rng.normal(quantity.value, quantity.sigma), name


def test_hopeless_draw_is_an_error() -> None:
    """A mean far outside the bounds ends in a clear error after a limited number of draws."""
    base = Parameters.model_construct(**{**preset("paper").model_dump(), "inner_mass": -1.0})
    with pytest.raises(InputError, match=rf"^parameters\.inner_mass: {DRAW_LIMIT} draws about -1\.0 "):
        sample_parameters(base, random_generator(0))


def test_samples_depend_on_their_name_only() -> None:
    """The same (seed, cell, sample) gives the same sample in any order; another name gives another."""
    base = preset("paper")
    names = [(seed, cell, sample) for seed in (0, 7) for cell in (0, 1) for sample in (0, 1, 2)]
    forwards = {name: sample_parameters(base, random_generator(*name)) for name in names}
    backwards = {name: sample_parameters(base, random_generator(*name)) for name in reversed(names)}
    assert forwards == backwards
    assert len({tuple(p.model_dump().values()) for p in forwards.values()}) == len(names)


@pytest.mark.parametrize("name", [(-1,), (2**128,), (True,), (0, -1), (0, 2**32), (0, 0, -1)])
def test_generator_refusals(name: tuple[Any, ...]) -> None:
    """A seed or index that would not name one stream is refused by its name."""
    with pytest.raises(InputError, match=r"^(seed|cell|sample): Input should be "):
        random_generator(*name)
