"""Parameters, scene and options: values and refusals."""

import math
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from tests.support.table_1 import TABLE_1
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS, Parameters, preset
from warpchain.inputs.scene import Scene, check_scene, contact_radius, fewest_links, joint_radius
from warpchain.inputs.sections import SECTION_OF, SECTIONS
from warpchain.inputs.setup import resolve
from warpchain.inputs.validation import InputError
from warpchain.kernels.methods.method import find_method, method_names

NUMBERS = [
    name for model in SECTIONS.values() for name, field in model.model_fields.items() if field.annotation is float
]


def refused(section: str, values: object) -> str:
    """Message with which the door refuses the values of one section."""
    sections: dict[str, Any] = {"scene": {}, "options": {}, "parameters": {}, section: values}
    with pytest.raises(InputError) as caught:
        resolve("paper", **sections)
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("name", TABLE_1)
def test_table_1(name: str) -> None:
    """Value and uncertainty of each quantity in the paper's table are those of the preset `paper`."""
    mantissa, uncertainty, power = TABLE_1[name]
    quantity = Parameters.quantities()[name]
    assert getattr(preset("paper"), name) == quantity.value
    assert quantity.value == pytest.approx(mantissa * 10.0**power, rel=1e-14)
    assert quantity.sigma == pytest.approx(uncertainty * 10.0**power, rel=1e-14)


def test_table_complete() -> None:
    """The table holds the paper's quantities and what it leaves out, each with symbol, unit and meaning."""
    quantities = Parameters.quantities()
    assert set(quantities) == {*TABLE_1, "circle_radius", "half_width"} == set(Parameters.model_fields)
    assert quantities["circle_radius"].value == 4.2e-3 and quantities["half_width"].value == 4e-3
    assert [name for name, q in quantities.items() if q.source == "assumed"] == ["circle_radius", "half_width"]
    assert len({q.symbol for q in quantities.values()}) == len(quantities)
    assert all(q.unit and q.meaning for q in quantities.values())


def test_soft_preset_differs_in_joints_only() -> None:
    """The preset `soft` changes the joint spring and the friction smoothing and nothing else."""
    changed = {"joint_stiffness": 1e7, "joint_damping": 100.0, "friction_smoothing": 0.1}
    assert preset("soft").model_dump() == {**preset("paper").model_dump(), **changed}


def test_unknown_preset_lists_known() -> None:
    """An unknown preset is refused with the list of those that exist."""
    with pytest.raises(InputError, match="preset: 'papr' is unknown; presets are paper, soft"):
        preset("papr")
    assert list(PRESETS) == ["paper", "soft"]


def test_parameters_have_no_defaults_and_are_frozen() -> None:
    """A parameter set names every value, and none can be changed afterwards."""
    with pytest.raises(ValidationError):
        Parameters.model_validate({})
    with pytest.raises(ValidationError):
        preset("paper").link_length = 0.01


def test_whole_numbers_are_numbers() -> None:
    """An integer is taken where a number is asked for, and becomes a float."""
    changed = preset("paper").with_values({"gravity": 10})
    assert changed.gravity == 10.0
    assert isinstance(changed.gravity, float)
    assert preset("paper").gravity == 9.809


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, True, "0.5", None, [0.5]])
def test_numbers_are_strict(name: str, value: object) -> None:
    """A number is finite and no text, truth value, list or nothing; the message names its path."""
    section = SECTION_OF[name]
    assert refused(section, {name: value}).startswith(f"{section}.{name}: ")


@pytest.mark.parametrize(
    ("name", "accepted", "rejected"),
    [
        *[(name, 1e-9, 0.0) for name in ("inner_mass", "outer_mass", "inner_inertia", "outer_inertia")],
        *[(name, 1e6, 1.001e6) for name in ("inner_mass", "outer_mass", "gravity", "friction_smoothing")],
        *[(name, 1e12, 1.001e12) for name in ("inner_inertia", "outer_inertia", "joint_damping")],
        *[(name, 1e9, 1.001e9) for name in ("viscous_friction", "coulomb_friction")],
        *[(name, 1e3, 1.001e3) for name in ("link_length", "sprocket_radius")],
        ("circle_radius", 1e-9, 0.0),
        ("circle_radius", 6.339e-3, 6.34e-3),
        ("link_length", 8.41e-3, 8.4e-3),
        ("sprocket_radius", 1e-3, 0.0),
        ("joint_stiffness", 1e-9, 0.0),
        ("joint_stiffness", 1e12, 1.001e12),
        ("friction_smoothing", 1e-9, 0.0),
        *[(name, 0.0, -1e-9) for name in ("joint_damping", "viscous_friction", "coulomb_friction", "gravity")],
        *[(f"{pair}_restitution", 0.0, -0.001) for pair in ("floor", "chain", "sprocket")],
        *[(f"{pair}_restitution", 1.0, 1.001) for pair in ("floor", "chain", "sprocket")],
        *[(f"{pair}_friction", 1.0, 1.001) for pair in ("floor", "chain", "sprocket")],
        *[(f"{pair}_friction", 0.0, -0.001) for pair in ("floor", "chain", "sprocket")],
        ("tangential_restitution", -1.0, -1.001),
        ("tangential_restitution", 1.0, 1.001),
    ],
)
def test_parameter_bounds(name: str, accepted: float, rejected: float) -> None:
    """Each bound of a parameter admits the value at or inside it and refuses the one outside."""
    assert getattr(preset("paper").with_values({name: accepted}), name) == accepted
    path = "circle_radius" if (name, rejected) == ("link_length", 8.4e-3) else name
    assert refused("parameters", {name: rejected}).startswith(f"parameters.{path}: ")


@pytest.mark.parametrize(
    ("name", "greatest", "message"),
    [
        ("links", 100_000, "scene.links: 100002 is greater than 100000; give 100000 or less"),
        ("frequency", 1e4, "scene.frequency: 10001.0 is greater than 10000 Hz; give 10000 or less"),
        ("clearance", 1e6, "scene.clearance: 1000001.0 is greater than 1000000 m; give 1000000 or less"),
        *[
            (name, 1e6, f"scene.{name}: 1000001.0 is greater than 1000000 s; give 1000000 or less")
            for name in ("settle_time", "spin_up_time", "steady_time", "hold_limit", "walk_limit")
        ],
    ],
)
def test_scene_upper_bounds(name: str, greatest: float, message: str) -> None:
    """The greatest values of a scene are taken, greater ones refused with the limit in their unit."""
    assert getattr(Scene.model_validate({name: greatest}), name) == greatest
    assert refused("scene", {name: greatest + (2 if name == "links" else 1)}) == message


@pytest.mark.parametrize(
    ("section", "values", "message"),
    [
        (
            "scene",
            {"links": 61},
            "scene.links: 61 is odd; a chain alternates inner and outer links, so give an even number",
        ),
        ("scene", {"links": 2}, "scene.links: 2 is less than 4; give 4 or more"),
        ("scene", {"links": 60.0}, "scene.links: 60.0 is of type float; give a whole number"),
        ("scene", {"links": True}, "scene.links: True is of type bool; give a whole number"),
        ("scene", {"frequncy": 15.0}, "scene.frequncy: unknown key; did you mean frequency?"),
        ("scene", {"frequency": -5}, "scene.frequency: -5 is less than 0 Hz; give 0 or more"),
        (
            "scene",
            {"frequency": "15 Hz"},
            "scene.frequency: '15 Hz' has its unit written with it; give a plain number in Hz: 15",
        ),
        (
            "scene",
            {"frequency": "900 rpm"},
            "scene.frequency: '900 rpm' has a unit written with it; convert it and give a plain number in Hz",
        ),
        (
            "scene",
            {"frequency": "15"},
            "scene.frequency: '15' is text; give a plain number in Hz, without quotes or leading zeros",
        ),
        ("scene", {"frequency": "fast"}, "scene.frequency: 'fast' is text; give a plain number in Hz"),
        ("scene", {"frequency": None}, "scene.frequency: empty; give a plain number in Hz"),
        ("scene", {"frequency": math.nan}, "scene.frequency: nan is not finite; give a plain number in Hz"),
        (
            "scene",
            {"frequency": [5, 10]},
            "scene.frequency: [5, 10] is of type list; give a plain number in Hz",
        ),
        ("scene", {"phase": 1.0}, "scene.phase: 1.0 is not less than 1; give a smaller value"),
        (
            "scene",
            {"clearance": "10mm"},
            "scene.clearance: '10mm' has a unit written with it; convert it and give a plain number in m",
        ),
        ("scene", {"start": "elipse"}, "scene.start: 'elipse' is unknown; did you mean ellipse?"),
        ("scene", {"start": 7}, "scene.start: 7 is unknown; give one of rest, spinning, ellipse"),
        (
            "scene",
            {"clearance_of": "hanging", "start": "spinning"},
            "scene.clearance_of: 'hanging' needs a chain that hangs, but start is 'spinning'; "
            "give 'spinning' here, or start: rest",
        ),
        (
            "scene",
            {"frequency": -1.0, "phase": 2.0, "walk_limit": 0},
            "scene.frequency: -1.0 is less than 0 Hz; give 0 or more (and 2 more)",
        ),
        ("scene", {"spin_up_time": 0}, "scene.spin_up_time: 0 is not greater than 0 s; give a positive time"),
        (
            "scene",
            {3: 4},
            "scene.3: unknown key; give one of links, frequency, start, phase, clearance, clearance_of, "
            "sprocket_radius_is, ellipse_aspect, settle_time, spin_up_time, ...",
        ),
        ("scene", [60], "scene: [60] is not a mapping; give names with values"),
        ("scene", None, "scene: None is not a mapping; give names with values"),
        (
            "parameters",
            {"inner_mass": -0.1},
            "parameters.inner_mass: -0.1 is not greater than 0 kg; give a positive mass",
        ),
        (
            "parameters",
            {"circle_radius": 0.007},
            "parameters.circle_radius: 0.007 is not smaller than half the link length 0.00634; give a smaller radius",
        ),
        (
            "parameters",
            {"joint_stiffness": 1e13},
            "parameters.joint_stiffness: 10000000000000.0 is greater than 1e+12 N/m; give 1e+12 or less",
        ),
        (
            "parameters",
            {"floor_friction": "27 %"},
            "parameters.floor_friction: '27 %' has a unit written with it; give a plain number",
        ),
        (
            "parameters",
            {"link_lenght": 0.01},
            "parameters.link_lenght: unknown key; did you mean link_length?",
        ),
        (
            "options",
            {"method": "rk45"},
            f"options.method: 'rk45' is unknown; give one of {', '.join((*METHODS_BY_NEED, *method_names()))}",
        ),
        ("options", {"method": "rodas5p"}, "options.method: 'rodas5p' was removed; give dp5"),
        *[
            (
                "options",
                {"method": method, "device": device},
                f"options.method: {method!r} runs on a CPU only; give explicit, or device: cpu",
            )
            for method in method_names()
            if not find_method(method).runs_on_gpus
            for device in ("cuda", "cuda:1")
        ],
        ("options", {"tolerance": 1e-14}, "options.tolerance: 1e-14 is less than 1e-13; give 1e-13 or more"),
        ("options", {"tolerance": 0.2}, "options.tolerance: 0.2 is greater than 0.1; give 0.1 or less"),
        ("options", {"controller": "pid"}, "options.controller: 'pid' is unknown; did you mean pi?"),
        ("options", {"step_limit": 0}, "options.step_limit: 0 is less than 1; give 1 or more"),
        (
            "options",
            {"step_limit": 10**15 + 1},
            "options.step_limit: 1000000000000001 is greater than 1e+15; give 1e+15 or less",
        ),
        (
            "options",
            {"self_contact": "yes"},
            "options.self_contact: 'yes' is not a truth value; give true or false",
        ),
        ("options", {"self_contact": 1}, "options.self_contact: 1 is not a truth value; give true or false"),
        ("options", {"device": "gpu"}, "options.device: 'gpu' is no device; give cpu, cuda or cuda:N"),
        ("options", {"device": 0}, "options.device: 0 is not text; give a name"),
        ("options", {"skin": 0.0}, "options.skin: 0.0 is not greater than 0 m; give a positive skin"),
        (
            "options",
            {"contact_step": 1e-13},
            "options.smallest_step: 1e-12 is not smaller than contact_step 1e-13 s; give a smaller step",
        ),
    ],
)
def test_refusals(section: str, values: object, message: str) -> None:
    """Each bad input is refused in one line with the field's path, the problem and the remedy."""
    assert refused(section, values) == message


@pytest.mark.parametrize(
    "name",
    ["spin_up_time", "hold_limit", "walk_limit", "contact_step", "skin", "smallest_step", "rest_speed", "rest_time"],
)
def test_positive_numbers(name: str) -> None:
    """Times that limit a phase, steps and speeds are positive."""
    section = SECTION_OF[name]
    assert refused(section, {name: 0}).startswith(f"{section}.{name}: 0 is not greater than 0")


def test_long_values_are_cut() -> None:
    """A huge or many-line value does not make the message long or break its line."""
    assert len(refused("scene", {"start": "a\n" * 1000})) < 200
    assert len(refused("scene", {"x\ny" * 1000: 1})) < 400


@pytest.mark.parametrize("model", [Scene, Options])
def test_fields_described(model: type[BaseModel]) -> None:
    """Every field of scene and options has a description, and every number a unit."""
    for name, field in model.model_fields.items():
        assert field.description, name
        if field.annotation in (int, float):
            assert isinstance(field.json_schema_extra, dict)
            assert field.json_schema_extra["unit"], name


def test_contact_and_pitch_radius() -> None:
    """The sprocket radius is where circles touch, or one circle radius further out where joints ride."""
    parameters = preset("paper")
    contact, pitch = Scene(sprocket_radius_is="contact"), Scene(sprocket_radius_is="pitch")
    assert contact_radius(contact, parameters) == 5.56e-2
    assert joint_radius(contact, parameters) == pytest.approx(5.98e-2, rel=1e-14)
    assert contact_radius(pitch, parameters) == pytest.approx(5.14e-2, rel=1e-14)
    assert joint_radius(pitch, parameters) == 5.56e-2


def test_pitch_needs_a_sprocket_larger_than_a_circle() -> None:
    """With the radius of the joints, a sprocket no larger than a circle is refused; otherwise it is not."""
    small = preset("paper").with_values({"sprocket_radius": 4.2e-3})
    with pytest.raises(InputError, match=r"^parameters\.sprocket_radius: 0\.0042 is not greater"):
        check_scene(Scene(sprocket_radius_is="pitch"), small)
    check_scene(Scene(sprocket_radius_is="contact"), small)
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
    assert fewest_links(scene, inside) == sides
    assert fewest_links(scene, outside) == sides + 2
    with pytest.raises(InputError, match=rf"^scene\.links: {sides} links .* give at least {sides + 2}$"):
        check_scene(scene, outside)
    check_scene(Scene.model_validate({**scene.model_dump(), "start": "ellipse"}), outside)


def test_fewest_links_of_a_tiny_sprocket() -> None:
    """Round a sprocket smaller than a link goes the shortest chain there is."""
    parameters = preset("paper").with_values({"sprocket_radius": 1e-4})
    assert fewest_links(Scene(links=4), parameters) == 4


def test_chain_too_short_is_refused_at_the_door() -> None:
    """With the values of Table 1 a chain needs 30 links to reach round the sprocket."""
    assert refused("scene", {"links": 28}).endswith("give at least 30")
    assert resolve("paper", scene={"links": 30}, options={}, parameters={}).scene.links == 30
