"""Parameters, scene and options: values and refusals."""

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from tests.support.table_1 import TABLE_1
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS, Parameters, preset
from warpchain.inputs.scene import Scene, check_scene, contact_radius, fewest_links, joint_radius
from warpchain.inputs.setup import Setup, read_setup, resolve
from warpchain.inputs.validation import InputError
from warpchain.kernels.methods.method import find_method, method_names


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
    """The table holds the paper's quantities and the circle radius, each with symbol, unit and meaning."""
    quantities = Parameters.quantities()
    assert set(quantities) == {*TABLE_1, "circle_radius"} == set(Parameters.model_fields)
    assert quantities["circle_radius"].value == 4.2e-3
    assert [name for name, q in quantities.items() if q.source == "assumed"] == ["circle_radius"]
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


@pytest.mark.parametrize("name", ["frequency", "phase", "clearance", "ellipse_aspect", "settle_time"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, True, "15", None, [15.0]])
def test_scene_numbers_strict(name: str, value: object) -> None:
    """A number of a scene is finite and no text, truth value or list; the message names its path."""
    assert refused("scene", {name: value}).startswith(f"scene.{name}: ")


@pytest.mark.parametrize("name", Parameters.model_fields)
@pytest.mark.parametrize("value", [math.nan, math.inf, True, "0.5", None])
def test_parameter_numbers_strict(name: str, value: object) -> None:
    """A parameter is finite and no text, truth value or nothing; the message names its path."""
    assert refused("parameters", {name: value}).startswith(f"parameters.{name}: ")


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
        ("scene", {3: 4}, "scene.3: unknown key; give one of " + ", ".join(Scene.model_fields)),
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
        ("options", {"method": "rodas4p"}, "options.method: 'rodas4p' was removed; give rodas5p"),
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


@pytest.mark.parametrize(("name", "value"), [(name, 0) for name in ("hold_limit", "walk_limit")])
def test_scene_positive(name: str, value: float) -> None:
    """Times that limit a phase are positive."""
    assert refused("scene", {name: value}).startswith(f"scene.{name}: 0 is not greater than 0")


@pytest.mark.parametrize("name", ["contact_step", "skin", "smallest_step", "rest_speed", "rest_time"])
def test_options_positive(name: str) -> None:
    """Steps, speeds and intervals of the options are positive."""
    assert refused("options", {name: 0}).startswith(f"options.{name}: 0 is not greater than 0")


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


def test_a_new_tableau_is_a_method() -> None:
    """What is added to the kernels' tables is taken for `method`, and named in its description and in the help."""
    program = (
        "from dataclasses import replace\n"
        "from warpchain.kernels.methods.explicit_tableaus import BS32, TABLEAUS\n"
        "TABLEAUS['new32'] = replace(BS32, name='new32', title='a new method 3(2)')\n"
        "from warpchain.cli.main import main\n"
        "from warpchain.inputs.options import Options\n"
        "print(Options(method='new32', device='cuda').method)\n"
        "print('new32: a new method 3(2)' in Options.model_fields['method'].description)\n"
        "main(['walk', '--help'])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert done.stderr == "" and done.stdout.startswith("new32\nTrue\n")
    assert "new32: a new method" in done.stdout


def test_methods_that_a_gpu_has_no_kernel_for_are_refused_there() -> None:
    """There are some, `standard` is not among the methods that are refused, and the word that is named is taken."""
    assert {"hybrid", "rodas5p"} == {name for name in method_names() if not find_method(name).runs_on_gpus}
    for word in METHODS_BY_NEED:
        assert find_method(Options(method=word, device="cuda").method).runs_on_gpus
    assert Options(device="cuda") == Options(method="explicit", device="cuda")


def test_hybrid_alone_has_the_tolerance_that_it_is_made_for() -> None:
    """1e-4 for its bursts of order 3, unless one says otherwise; other integrators 1e-6."""
    assert Options.model_validate({"method": "hybrid"}).tolerance == 1e-4
    assert Options.model_validate({"method": "hybrid", "tolerance": 1e-5}).tolerance == 1e-5
    assert Options.model_validate({"method": "os32"}).tolerance == 1e-6


@pytest.mark.parametrize("word", ["standard", "explicit"])
def test_a_tolerance_given_beside_a_word_is_that_of_soft_joints_too(word: str) -> None:
    """A word's tolerance of soft joints goes with the word's own tolerance only; one that is given stays."""
    assert Options(method=word).soft_tolerance == 3 * Options(method=word).tolerance
    assert Options(method=word, tolerance=1e-5).soft_tolerance is None
    assert Options(method=word, tolerance=1e-5, soft_tolerance=1e-4).soft_tolerance == 1e-4
    assert Options(method=word, tolerance=1e-5).soften_pile


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


def test_resolve_completes() -> None:
    """Values that are not given come from the preset and from the defaults."""
    setup = resolve("soft", scene={"links": 80}, options={"method": "dp5"}, parameters={"gravity": 1.62})
    assert setup == Setup(
        preset="soft",
        parameters=PRESETS["soft"].with_values({"gravity": 1.62}),
        scene=Scene(links=80),
        options=Options(method="dp5"),
    )


def written(folder: Path, text: str) -> Path:
    """A YAML file with the text."""
    path = folder / "walk.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def loaded(path: Path | str) -> Setup:
    """The setup of a YAML file."""
    preset, sections = read_setup(path)
    return resolve(preset, **sections)


def test_setup_of_a_file(tmp_path: Path) -> None:
    """A YAML file gives the same setup as the same values given as arguments; 1e7 is a number."""
    text = """
    preset: paper
    scene: {links: 80, frequency: 2e1, start: ellipse}
    options:
      tolerance: 1.0e-7
      step_limit: 1_000_000
      self_contact: no
    parameters:
      joint_stiffness: 1e7
      tangential_restitution: -.5
      gravity: 10
    """
    assert loaded(written(tmp_path, text)) == resolve(
        "paper",
        scene={"links": 80, "frequency": 20.0, "start": "ellipse"},
        options={"tolerance": 1e-7, "step_limit": 1_000_000, "self_contact": False},
        parameters={"joint_stiffness": 1e7, "tangential_restitution": -0.5, "gravity": 10.0},
    )


def test_setup_of_a_file_with_empty_sections(tmp_path: Path) -> None:
    """A section without values, or no section at all, leaves the defaults."""
    expected = resolve("soft", scene={}, options={}, parameters={})
    assert loaded(written(tmp_path, "preset: soft")) == expected
    assert loaded(str(written(tmp_path, "preset: soft\nscene:\noptions: {}\n"))) == expected
    assert read_setup(written(tmp_path, "scene: {links: 8}")) == (
        None,
        {"scene": {"links": 8}, "options": {}, "parameters": {}},
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("preset: paper\nscene: {links: 61}", "scene.links: 61 is odd"),
        ("preset: paper\nscene: {links: 060}", "scene.links: '060' is text; give a whole number"),
        (
            "preset: paper\nscene: {frequency: 1:30}",
            "scene.frequency: '1:30' is text; give a plain number in Hz",
        ),
        ("preset: paper\nscene: {frequency: 15 Hz}", "scene.frequency: '15 Hz' has its unit written"),
        ("preset: paper\nscene: {frequency: .nan}", "scene.frequency: nan is not finite"),
        ("preset: paper\nscene: {frequency: -.inf}", "scene.frequency: -inf is not finite"),
        ("preset: paper\nscene: {frequency: }", "scene.frequency: empty"),
        ("preset: paper\nscene: [1]", "scene: [1] is not a mapping"),
        ("preset: papr", "preset: 'papr' is unknown; presets are paper, soft"),
        ("preset: [paper]", "preset: ['paper'] is unknown"),
        ("preset: paper\nsceen: {}", "'sceen': unknown key; did you mean scene?"),
        ("preset: paper\n7: {}", "7: unknown key; give one of preset, scene, options, parameters"),
        ("preset: paper\nscene: {links: 60, links: 80}", "{path}, line 2: key 'links' is given twice"),
        ("preset: paper\nscene: {links: 60, 'links': 60}", "{path}, line 2: key 'links' is given twice"),
        ("preset: paper\npreset: soft", "{path}, line 2: key 'preset' is given twice"),
        ("preset: paper\nscene: {links: 60", "{path}, line 2: while parsing a flow mapping, expected ',' or '}'"),
        (
            "preset: paper\n---\npreset: soft",
            "{path}, line 2: expected a single document in the stream, but found another document; correct the YAML",
        ),
        ("preset: paper\nscene: {? [1, 2] : 3}", "{path}, line 2: "),
        ("preset: !!python/object:os.system x", "{path}, line 1: "),
        ("preset: !!map [a]", "{path}, line 1: "),
        ("preset: !!int abc", "{path}: "),
        ("preset: \x00", "{path}: "),
        ("[" * 5000, "{path}: "),
        ("", "{path}: no mapping at the top"),
        ("- paper", "{path}: no mapping at the top"),
    ],
)
def test_setup_of_a_file_refusals(tmp_path: Path, text: str, message: str) -> None:
    """A bad file is refused in one line that says where and why."""
    path = written(tmp_path, text)
    with pytest.raises(InputError) as caught:
        loaded(path)
    assert str(caught.value).startswith(message.replace("{path}", str(path)))
    assert "\n" not in str(caught.value)


def test_setup_of_a_file_unreadable(tmp_path: Path) -> None:
    """A missing file, a folder and a file that is no text are refused in one line."""
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\xff")
    for path in (tmp_path / "none.yaml", tmp_path, binary):
        with pytest.raises(InputError) as caught:
            loaded(path)
        assert str(caught.value).startswith(f"{path}: ")
        assert "\n" not in str(caught.value)
