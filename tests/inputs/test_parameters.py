"""Values of Table 1, presets, slips of units, and what a chain on its sprocket needs."""

import math
from collections.abc import Mapping

import pytest
from pydantic import ValidationError

import warpchain
from tests.support.table_1 import TABLE_1
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS, Parameters, preset
from warpchain.inputs.scene import Scene, check_scene, contact_radius, fewest_links, joint_radius
from warpchain.inputs.setup import resolve
from warpchain.inputs.validation import InputError


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
    with pytest.raises(InputError, match=r"^preset: 'papr' is unknown; presets are paper, soft$"):
        preset("papr")
    assert list(PRESETS) == ["paper", "soft"]
    with pytest.raises(ValidationError):
        preset("paper").link_length = 0.01
    assert repr(preset("paper").with_values({"gravity": 10}).gravity) == "10.0"


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ({"ell": 12.68, "r": 5e-3}, "link_length: 12.68 m is 1000 times Table 1's; give 0.01268"),
        ({"m_inner": 3.7}, "inner_mass: 3.7 kg is 1000 times Table 1's; give 0.0037"),
    ],
)
def test_mm_and_g_are_refused(values: Mapping[str, float], line: str) -> None:
    """A length or a mass of Table 1 in thousandths is a slip; nothing is run."""
    with pytest.raises(InputError) as caught:
        warpchain.walk(**values)
    assert str(caught.value) == f"parameters.{line}"


def test_contact_and_pitch_radius() -> None:
    """The sprocket radius is where circles touch, or one circle radius further out where joints ride."""
    parameters = preset("paper")
    contact, pitch = Scene(sprocket_radius_is="contact"), Scene(sprocket_radius_is="pitch")
    assert (contact_radius(contact, parameters), joint_radius(pitch, parameters)) == (5.56e-2, 5.56e-2)
    assert joint_radius(contact, parameters) == pytest.approx(5.98e-2, rel=1e-14)
    assert contact_radius(pitch, parameters) == pytest.approx(5.14e-2, rel=1e-14)
    small = parameters.with_values({"sprocket_radius": 4.2e-3})
    with pytest.raises(InputError, match=r"^parameters\.sprocket_radius: 0\.0042 is not greater"):
        check_scene(pitch, small)
    check_scene(contact, small)
    check_scene(Scene(sprocket_radius_is="pitch", start="ellipse"), small)


@pytest.mark.parametrize("sides", [6, 8, 30, 60])
@pytest.mark.parametrize("kind", ["contact", "pitch"])
def test_fewest_links_is_the_polygon(sides: int, kind: str) -> None:
    """A loop of n links reaches round a sprocket just inside its regular polygon, and round no larger one."""
    parameters = preset("paper").with_values({"link_length": 0.02, "circle_radius": 0.002})
    scene = Scene.model_validate({"links": sides, "sprocket_radius_is": kind})
    corner_radius = 0.02 / (2 * math.sin(math.pi / sides)) - (0.002 if kind == "contact" else 0.0)
    inside = parameters.with_values({"sprocket_radius": corner_radius * (1 - 1e-9)})
    outside = parameters.with_values({"sprocket_radius": corner_radius * (1 + 1e-9)})
    check_scene(scene, inside)
    assert (fewest_links(scene, inside), fewest_links(scene, outside)) == (sides, sides + 2)
    with pytest.raises(InputError, match=rf"^scene\.links: {sides} links .* give at least {sides + 2}$"):
        check_scene(scene, outside)
    check_scene(Scene.model_validate({**scene.model_dump(), "start": "ellipse"}), outside)


def test_the_shortest_chains() -> None:
    """30 links reach round the sprocket of Table 1, 4 round one smaller than a link."""
    assert resolve("paper", scene={"links": 30}, options={}, parameters={}).scene.links == 30
    assert fewest_links(Scene(links=4), preset("paper").with_values({"sprocket_radius": 1e-4})) == 4
