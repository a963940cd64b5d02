"""Values of Table 1, presets, slips of units, and what a chain on its sprocket needs."""

import math
from dataclasses import replace

import pytest
from pydantic import ValidationError

from warpchain.chain.setup import Setup
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS, Parameters, preset
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import InputError

TABLE_1 = {
    "link_length": (1.268, 0.001, -2),
    "sprocket_radius": (5.56, 0.05, -2),
    "inner_mass": (3.700, 0.002, -3),
    "inner_inertia": (1.69, 0.01, -7),
    "outer_mass": (3.147, 0.002, -3),
    "outer_inertia": (1.292, 0.009, -7),
    "viscous_friction": (9, 1, -5),
    "coulomb_friction": (1.10, 0.09, -4),
    "floor_restitution": (0.018, 0.004, 0),
    "floor_friction": (0.27, 0.02, 0),
    "gravity": (9.809, 0, 0),
    "chain_restitution": (0.80, 0, 0),
    "chain_friction": (0.62, 0, 0),
    "joint_stiffness": (1, 0, 9),
    "joint_damping": (1, 0, 3),
    "friction_smoothing": (1, 0, -3),
    "tangential_restitution": (0, 0, 0),
    "sprocket_restitution": (0.01, 0, 0),
    "sprocket_friction": (0.99, 0, 0),
}
"""Mantissa, uncertainty, power of ten: typed from the paper."""


@pytest.mark.parametrize("name", TABLE_1)
def test_table_1(name: str) -> None:
    """Value and uncertainty of each quantity in the paper's table are those of the preset `paper`."""
    mantissa, uncertainty, power = TABLE_1[name]
    quantity = Parameters.quantities()[name]
    assert getattr(preset("paper"), name) == quantity.value
    assert quantity.value == pytest.approx(mantissa * 10.0**power, rel=1e-14)
    assert quantity.sigma == pytest.approx(uncertainty * 10.0**power, rel=1e-14)


def test_table_complete() -> None:
    """The table holds the paper's quantities and what it leaves out; every field says what it is."""
    quantities = Parameters.quantities()
    assert set(quantities) == {*TABLE_1, "circle_radius", "half_width"} == set(Parameters.model_fields)
    assert [name for name, q in quantities.items() if q.source == "chosen here"] == ["circle_radius", "half_width"]
    for model in (Parameters, Scene, Options):
        for field in model.model_fields.values():
            assert field.description
            assert field.annotation not in (int, float) or field.json_schema_extra["unit"]  # type: ignore[call-overload, index]


def test_presets() -> None:
    """`soft` changes joints only; another name is refused with those that exist; none can be changed."""
    changed = {"joint_stiffness": 1e7, "joint_damping": 100.0, "friction_smoothing": 0.1}
    assert preset("soft").model_dump() == {**preset("paper").model_dump(), **changed}
    with pytest.raises(InputError, match=r"^preset: unknown preset 'papr'; use one of paper, soft$"):
        preset("papr")
    assert list(PRESETS) == ["paper", "soft"]
    with pytest.raises(ValidationError):
        preset("paper").link_length = 0.01
    assert repr(preset("paper").with_values({"gravity": 10}).gravity) == "10.0"


def setup_of(scene: Scene, parameters: Parameters) -> Setup:
    """The setup of a walk with usual options, unchecked."""
    return Setup("paper", parameters, scene, Options())


def test_contact_and_pitch_radius() -> None:
    """The sprocket radius is where circles touch, or one circle radius further out where joints ride."""
    parameters = preset("paper")
    contact, pitch = (setup_of(Scene(sprocket_radius_is=kind), parameters) for kind in ("contact", "pitch"))
    assert (contact.contact_radius, pitch.joint_radius) == (5.56e-2, 5.56e-2)
    assert contact.joint_radius == pytest.approx(5.98e-2, rel=1e-14)
    assert pitch.contact_radius == pytest.approx(5.14e-2, rel=1e-14)
    small = parameters.with_values({"sprocket_radius": 4.2e-3})
    with pytest.raises(InputError, match=r"^parameters\.sprocket_radius: 0\.0042 is too small"):
        replace(pitch, parameters=small).checked(asks_units=False)
    replace(contact, parameters=small).checked(asks_units=False)
    setup_of(Scene(sprocket_radius_is="pitch", start="ellipse"), small).checked(asks_units=False)


@pytest.mark.parametrize("sides", [6, 8, 30, 60])
@pytest.mark.parametrize("kind", ["contact", "pitch"])
def test_fewest_links_is_the_polygon(sides: int, kind: str) -> None:
    """A loop of n links reaches round a sprocket just inside its regular polygon, and round no larger one."""
    parameters = preset("paper").with_values({"link_length": 0.02, "circle_radius": 0.002})
    scene = Scene.model_validate({"links": sides, "sprocket_radius_is": kind})
    corner_radius = 0.02 / (2 * math.sin(math.pi / sides)) - (0.002 if kind == "contact" else 0.0)
    inside = parameters.with_values({"sprocket_radius": corner_radius * (1 - 1e-9)})
    outside = parameters.with_values({"sprocket_radius": corner_radius * (1 + 1e-9)})
    reaches, is_short = setup_of(scene, inside).checked(), setup_of(scene, outside)
    assert (reaches.fewest_links, is_short.fewest_links) == (sides, sides + 2)
    with pytest.raises(InputError, match=rf"^scene\.links: {sides} links .* use at least {sides + 2}$"):
        is_short.checked()
    setup_of(Scene.model_validate({**scene.model_dump(), "start": "ellipse"}), outside).checked()
