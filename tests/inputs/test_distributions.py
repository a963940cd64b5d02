"""Random samples of parameters and scenes: bounds, distributions, the order of draws."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    assert Parameters.model_validate(drawn.model_dump()) == drawn
    for name in Parameters.model_fields:
        assert (getattr(drawn, name) != getattr(base, name)) == bool(Parameters.quantities()[name].sigma)
    assert drawn.circle_radius < drawn.link_length / 2


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**128 - 1), radius=st.floats(6.3e-3, 6.3399e-3))
def test_a_drawn_link_has_room_for_circles_of_one_link(seed: int, radius: float) -> None:
    """Lengths that a wide charm leaves no room for are drawn again; no sample of a sound scene is refused."""
    scene = Scene(charm_radius=radius, start="ellipse")
    drawn = sampled(Setup("paper", preset("paper"), scene, Options()), random_generator(seed)).parameters
    assert drawn.link_length > 2 * radius


def test_hopeless_draw_is_an_error() -> None:
    """A mean far outside the bounds ends in a clear error after a limited number of draws."""
    base = Parameters.model_construct(**{**preset("paper").model_dump(), "inner_mass": -1.0})
    with pytest.raises(InputError, match=rf"^parameters\.inner_mass: {DRAW_LIMIT} draws about -1\.0 "):
        sample_parameters(base, random_generator(0))
