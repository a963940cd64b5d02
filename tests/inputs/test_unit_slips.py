"""Values far from Table 1's, which are probably in another unit: who means them says so."""

from typing import Any

import pytest

from tests.support.sweep_content import content
from warpchain.chain.resolution import resolve
from warpchain.inputs.fields import SECTION_OF
from warpchain.inputs.unit_slips import USUAL
from warpchain.inputs.validation import InputError
from warpchain.sweeps.plan import load_sweep


def setup_with(options: dict[str, Any], **parameters: float) -> Any:
    """A setup with these parameters."""
    return resolve("paper", scene={}, options=options, parameters=parameters)


@pytest.mark.parametrize("name", [name for name in USUAL if SECTION_OF[name] == "parameters"])
def test_ten_times_a_value_is_taken_and_more_is_asked_about(name: str) -> None:
    """Each length, mass, inertia and gravity by itself, within what other checks leave to it."""
    value, _ = USUAL[name]
    smallest = [5e-324] if name != "gravity" else []  # a float's; a product with it may be 0
    for wrong in (1001 * value, 1e308, *smallest):
        with pytest.raises(InputError, match=rf"^parameters\.{name}: "):
            setup_with({}, **{name: wrong})
    if name not in ("circle_radius", "sprocket_radius", "link_length"):  # others refuse what does not fit together
        assert getattr(setup_with({}, **{name: 10 * value}).parameters, name) == 10 * value


def test_who_insists_gets_the_value() -> None:
    """A chain of another size, all of it, is taken with `unusual_values`, in a walk and in a sweep."""
    large = {
        "link_length": 0.254,
        "sprocket_radius": 1.1,
        "circle_radius": 0.084,
        "inner_mass": 30.0,
        "outer_mass": 25.0,
    }
    with pytest.raises(InputError, match=r"options\.unusual_values: true to insist$"):
        setup_with({}, **large)
    assert setup_with({"unusual_values": True}, **large).parameters.inner_mass == 30.0
    grid = {"links": [60], "inner_mass": [30.0]}
    with pytest.raises(InputError, match=r"^sweep\.grid\.inner_mass\[0\]: 30 kg is 8110 times Table 1's; "):
        load_sweep(content(grid=grid))
    assert load_sweep(content(grid=grid, options={"unusual_values": True})).walk(0).setup.parameters.inner_mass == 30


def test_distributions_are_asked_about_too() -> None:
    """A law in another unit is refused where it was given; what is drawn about a fixed value goes with that."""
    for law in ({"uniform": [12.6, 12.7]}, {"gaussian": {"mean": 12.65, "sigma": 0.1}}):
        with pytest.raises(
            InputError, match=r"^sweep\.distributions\.link_length: 12\.65 m is 998 times Table 1's; did"
        ):
            load_sweep(content(distributions={"link_length": law}))


def test_no_gravity_and_thin_links_are_usual() -> None:
    """Zero is nobody's mistake of a unit, and little gravity is that of an asteroid."""
    assert setup_with({}, gravity=0.0, half_width=0.0).parameters.gravity == 0
    assert setup_with({}, gravity=0.006).parameters.gravity == 0.006
