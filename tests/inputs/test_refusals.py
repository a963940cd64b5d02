"""What is refused, and how: in one short printable line that begins with the field, at little cost."""

import datetime
import math
import pickle
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.setups import setup_walk
from warpchain.chain.resolution import resolve
from warpchain.inputs.distributions import DRAWABLE
from warpchain.inputs.fields import SECTION_OF, SECTIONS
from warpchain.inputs.validation import (
    LONGEST_LINE,
    InputError,
    field_bounds,
    field_limits,
    validated,
    with_numbers,
)
from warpchain.inputs.yaml_files import LARGEST_FILE, read_yaml
from warpchain.kernels.methods.method import find_method, method_names
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.sweep_file import read_walk_file

SWEEP = {"version": 1, "name": "x", "seed": 1, "samples": 1, "preset": "soft"}
FIELDS = {name: field for model in SECTIONS.values() for name, field in model.model_fields.items()}
LIMITS = [(name, limit, value) for name, field in FIELDS.items() for limit, value in field_limits(field).items()]


def refusal(call: Callable[[], object]) -> str:
    """The text with which a call is refused within a few seconds."""
    begun = time.process_time()
    with pytest.raises(InputError) as caught:
        call()
    assert time.process_time() - begun < 10  # hanging would be minutes; a busy machine takes 2 to 6 s for the slowest
    for line in caught.value.args:
        assert line.isprintable() and 0 < len(line) <= LONGEST_LINE
    return str(caught.value)


def refused(name: str, value: object) -> str:
    """How the value of a field is refused."""
    sections: dict[str, Any] = {section: {} for section in SECTIONS}
    sections[SECTION_OF[name]] = {name: value}
    message = refusal(lambda: resolve("paper", **sections))
    assert "\n" not in message
    return message


@pytest.mark.parametrize(("name", "limit", "value"), LIMITS)
def test_each_bound_is_refused_by_name(name: str, limit: str, value: float) -> None:
    """What lies just beyond a bound, or on one that is excluded."""
    beyond = math.nextafter(value, math.inf if limit.startswith("l") else -math.inf) if limit in ("ge", "le") else value
    if FIELDS[name].annotation is int:
        beyond = round(value) + (1 if limit == "le" else -1)
    assert refused(name, beyond).startswith(f"{SECTION_OF[name]}.{name}: expected ")


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("value", [math.nan, math.inf, "0.5", "15 Hz", [0.5], {}, 1j, b"60", datetime.date(2020, 1, 1)])
def test_what_is_no_value_is_refused_by_name(name: str, value: object) -> None:
    """A number is finite and no text, list or date; a word is one of those that there are."""
    assert re.match(rf"{SECTION_OF[name]}\.{name}(\[0\])?: ", refused(name, value))


STEP = [[-1, 0], [0.5, 0], [0.5, -0.1], [1, -0.1]]
STILL = [0.1, 0, 0, 0]
"""A row of a motion of the sprocket."""


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"links": 60.5}, "scene.links: expected an integer, got 60.5"),
        ({"plane": "tiltng"}, "scene.plane: expected 'fixed' or 'tilting', got 'tiltng'"),
        ({"floor": "hilly"}, "scene.floor: expected flat or points, got 'hilly'; use e.g. [[0, 0], [1, 0.1]]"),
        ({"floor": [[0, 0], [1]]}, "scene.floor[1][1]: missing; set a value"),
        ({"floor": [[0, 0, 0.1], [1, 0]]}, "scene.floor[0][3]: missing; set a value"),
        ({"floor": [[0, 0, 1.1, 0.1], [1, 0]]}, "scene.floor[0][2]: expected at most 1"),
        (
            {"floor": [[0, 0], [1, 0, 0.1, 0.1]]},
            "scene.floor: the last point starts no segment, so it has no e and μ; use ",
        ),
        ({"floor": [[0, 0]]}, "scene.floor: expected at least 2 points; use e.g. [[0, 0], [1, 0], "),
        ({"floor": [[0, 0], [1, 0], [0.9, 1]]}, "scene.floor: point 2 lies behind the point before it; let x increase"),
        ({"floor": [[0, 0], [1, 0], [1, 1e-6], [2, 0]]}, "scene.floor: point 2 is less than 1e-05 m from the point "),
        (
            {"floor": [[0, 0], [0, 1], [1, 1]]},
            "scene.floor: the first and last segments are infinite, so they cannot be vertical; let x",
        ),
        (
            {"floor": [[0, 0], [1, 0], [1, 1], [1, 0.5], [2, 0]]},
            "scene.floor: point 3 is the third on one vertical line; ",
        ),
        ({"slope": 5.0, "floor": STEP}, "scene.slope: not possible with a profile; use slope: 0, or floor: flat"),
        ({"slope": 5.0, "plane": "tilting"}, "scene.plane: 'tilting' needs a flat floor; use plane: fixed, or "),
        ({"floor": STEP, "plane": "tilting"}, "scene.plane: 'tilting' needs a flat floor; use plane: fixed, or "),
        ({"method": "hybrid", "plane": "tilting"}, "options.method: 'hybrid' cannot tilt the plane; use "),
        ({"method": "hybird"}, "options.method: unknown method 'hybird'; did you mean hybrid?"),
        ({"device": "gpu"}, "options.device: expected cpu, cuda or cuda:N, got 'gpu'; use one of them"),
        (
            {"soften_drive": True, "record_interval": 5e-3},
            "options.soften_drive: joints stiffen at each record_interval, and 0.005 s is too long for that; use at "
            "most 0.002 s, or ",
        ),
        ({"contact_step": 1e-13}, "options.smallest_step: expected less than contact_step, got 1e-12 s; use less"),
        (
            {"circle_radius": 0.007},
            "parameters.circle_radius: expected less than half a link, 0.00634, got 0.007; use less",
        ),
        # values in other units
        ({"ell": 12.7}, "parameters.link_length: 12.7 m is 1000 times Table 1's; did you mean 0.0127 (12.7 mm)? Else "),
        ({"ell": 1.27}, "parameters.link_length: 1.27 m is 100 times Table 1's; did you mean 0.0127 (1.27 cm)? Else "),
        ({"ell": 0.5}, "parameters.link_length: 0.5 m is 39.4 times Table 1's; did you mean 0.0127 (0.5 inches)? "),
        ({"R": 55.6}, "parameters.sprocket_radius: 55.6 m is 1000 times Table 1's; did you mean 0.0556 (55.6 mm)? "),
        ({"m_inner": 3.7}, "parameters.inner_mass: 3.7 kg is 1000 times Table 1's; did you mean 0.0037 (3.7 g)? Else "),
        ({"m_outer": 3e-6}, "parameters.outer_mass: 3e-6 kg is 0.000953 times Table 1's; use kg, or set "),
        (
            {"I_inner": 169},
            "parameters.inner_inertia: 169 kg m² is 1e9 times Table 1's; did you mean 1.69e-7 (169 g mm²)",
        ),
        ({"g": 981}, "parameters.gravity: 981 m/s² is 100 times Table 1's; did you mean 9.81 (981 cm/s²)? Else set "),
        (
            {"link_masses": [3.7] * 60},
            "scene.link_masses: 3.7 kg is 1000 times Table 1's; did you mean 0.0037 (3.7 g)?",
        ),
        ({"charm_radius": 4.5}, "scene.charm_radius: 4.5 m is 1070 times Table 1's; did you mean 0.0045 (4.5 mm)? "),
        # links that are unlike
        ({"links": 61}, "scene.links: expected an even number, got 61; use one, or set link_masses and "),
        (
            {"links": 61, "start": "ellipse"},
            "scene.links: expected an even number, got 61; use one, or set link_masses and ",
        ),
        ({"charm_link": 60}, "scene.charm_link: expected 0 to 59, the links of the chain, got 60; use"),
        ({"stiff_joint": 60}, "scene.stiff_joint: expected 0 to 59, the links of the chain, got 60; use"),
        ({"link_masses": [1.0, 2.0]}, "scene.link_masses: expected 60 numbers, one per link, got 2"),
        ({"link_masses": [0.0] * 60}, "scene.link_masses[0]: expected more than 0, got 0; use more"),
        (
            {"link_radii": [4e-3] * 59 + [0.02]},
            "scene.link_radii[59]: expected less than half a link, 0.00634, got 0.02; use ",
        ),
        (
            {"charm_radius": 0.02, "start": "ellipse"},
            "scene.charm_radius: expected less than half a link, 0.00634, got 0.02; ",
        ),
        ({"link_inertias": {7: 1e-7}}, "scene.link_inertias: expected a list in kg m², got "),
        ({"coulomb_frictions": [-1.0] * 60}, "scene.coulomb_frictions[0]: expected at least 0"),
        ({"mass_gradient": 1.0}, "scene.mass_gradient: expected less than 1, got 1.0"),
        ({"charm_mass": 0.02, "load_factor": 9.0}, "scene.load_factor: 9 is too much for links with such a small "),
        # names of development versions
        ({"walk_until": 1.0}, "'walk_until': unknown name; use stop_time, its new name"),
        ({"further_hold": 1.0}, "'further_hold': unknown name; use extra_hold, its new name"),
        ({"stiff_joint_factor": 2}, "'stiff_joint_factor': unknown name; use joint_friction_factor, its new name"),
        ({"record_loads": True}, "'record_loads': unknown name; use record_joint_forces, its new name"),
        # motions of the sprocket
        (
            {"release": [STILL], "start": "ellipse"},
            "scene.release: a motion of the sprocket is not possible with start: ellipse",
        ),
        (
            {"release": [STILL], "plane": "tilting"},
            "scene.release: a motion of the sprocket is not possible with plane: tilting",
        ),
        ({"release": [STILL[:3]]}, "scene.release[0][3]: missing"),
        ({"release": [STILL, STILL]}, "scene.release: row 1: expected a time after 0.1 s, got 0.1 s"),
        ({"release": [[0.0, 0, 0, 0]]}, "scene.release: row 0: expected a time after 0 s, got 0 s"),
        ({"release": [[0.1, 1e9, 0, 0]]}, "scene.release[0][1]: expected at most 10000"),
        ({"release": []}, "scene.release: expected at least one row"),
        ({"release": "lift"}, "scene.release: "),
    ],
)
def test_refusals_say_what_to_give(settings: dict[str, Any], message: str) -> None:
    """The field's path, what it should be with its unit, and what was given."""
    text = refusal(lambda: setup_walk("paper", settings))
    assert text.startswith(message) and "\n" not in text


@pytest.mark.parametrize("method", [name for name in method_names() if find_method(name).has_rigid_flight])
def test_methods_that_a_gpu_has_no_kernel_for_are_refused_there(method: str) -> None:
    """With what to give instead."""
    text = refusal(lambda: setup_walk("soft", {"method": method, "device": "cuda:1"}))
    assert text == f"options.method: {method!r} runs only on a CPU; use explicit, or device: cpu"


def test_several_problems_and_what_is_no_section() -> None:
    """The first is described, the others are counted; of a sweep each has a line, up to 20."""
    several = {"frequency": -1.0, "phase": 2.0, "walk_limit": 0}
    assert refusal(lambda: resolve("paper", scene=several, options={}, parameters={})).endswith(" (and 2 more)")
    for scene in ({3: 4}, {"x\ny" * 1000: 1}):
        assert refusal(lambda scene=scene: resolve("paper", scene=scene, options={}, parameters={})).startswith("scene")
    with pytest.raises(InputError) as caught:
        warpchain.sweep(grid={"frequency": [-1 - i for i in range(1000)]}, out="x")
    assert len(caught.value.args) == 21 and caught.value.args[-1] == "980 more problems; correct these first"


# Hostile values


class Mute:
    """An object that cannot be shown."""

    def __repr__(self) -> str:
        """Fails."""
        raise RuntimeError("no text")


def nested(depth: int) -> list[Any]:
    """Lists inside of one another; of depth 0 one that contains itself."""
    items: list[Any] = []
    if depth == 0:
        items.append(items)
    for _ in range(depth):
        items = [items]
    return items


HOSTILE: dict[str, Callable[[], Any]] = {
    "mute": Mute,
    "endless": lambda: nested(0),
    "deep": lambda: nested(100_000),
    "long number": lambda: 10**5000,
    "long text": lambda: "x" * 10**6,
    "array": lambda: np.zeros(10**7),
    "mapping": lambda: {Mute(): 1},
    "large": lambda: {"a": [{"b": ["\x1b"] * 1000}] * 1000},
}
"""What `tests/test_fuzz.py` does not make."""


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_value_is_refused_in_short_lines(kind: str) -> None:
    """Numbers, words and truth values, given by keyword; every key of a sweep, given from Python."""
    value = HOSTILE[kind]()
    for name in ("links", "frequency", "start", "device", "method", "self_contact"):
        assert refusal(lambda name=name: setup_walk("soft", {name: value}))
    for key in ("seed", "samples", "sampler", "preset", "scene", "grid", "distributions", "record", "blocks"):
        assert refusal(lambda key=key: load_sweep({**SWEEP, key: value})).startswith("sweep")


def test_a_refusal_keeps_its_lines() -> None:
    """Several problems have a line each, also on the other side of a pickle, and no value adds one."""
    error = InputError("links: 3 is odd", "name: 'a\nb\u2028c\x1b' is no name")
    assert str(error).splitlines() == ["links: 3 is odd", "name: 'a b c\\x1b' is no name"]
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    long = str(InputError(f"scene.{'x' * 10**6}: is not a name; use another"))
    assert (
        long.startswith("scene.xxx") and long.endswith("xxx: is not a name; use another") and len(long) == LONGEST_LINE
    )


# Hostile files


LEVELS = ("ab", "bc", "cd", "de", "ef", "fg")
"""Names of anchors, each with that of what it repeats before it."""


@pytest.mark.parametrize(
    "text",
    [
        "",
        "- paper",
        "preset: {a: 1, a: 1}",
        "preset: {a: 1, 'a': 1}",
        "preset: soft\nscene: {links: 60",
        "preset: soft\n---\npreset: soft",
        "scene: {? [1, 2] : 3}",
        *(f"preset: {tag} x" for tag in ("!!int", "!!float", "!!bool", "!!timestamp", "!!binary", "!!map", "!!merge")),
        "preset: !!python/object:os.system x",
        "preset: !!set {a}",
        "scene: {links: 060}",
        "scene: {frequency: 1:30}",
        "scene: {frequency: 2020-01-01}",
        "scene: {links: " + "1" * 5000 + "}",
        'preset: "\\Uffffffff"',
        "%YAML " + "9" * 5000 + ".1\n---\na",
        "preset: \0",
        "[" * 100_000,
        "- " * 50_000,
        "&a [*a]",
        "x: &a {y: [*a]}",
        "[&a [x,x,x,x,x,x,x,x,x]" + "".join(f",&{b} [{f'*{a},' * 9}]" for a, b in LEVELS) + "]",
        "&a {x: 1, <<: [" + "{y: 1}," * 1000 + "]}",
        "[" + "a," * (LARGEST_FILE // 2 - 1) + "]",
        "#" * (LARGEST_FILE + 1),
        "preset: soft\nscene: [1]",
        "preset: papr",
        "preset: [paper]",
        "sceen: {}",
        "7: {}",
    ],
)  # fmt: skip
def test_a_hostile_file_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    """Repeated keys, tags, bombs, depths, sizes and what versions of YAML read differently."""
    path = tmp_path / "x"
    path.write_text(text, encoding="utf-8")

    refusal(lambda: read_walk_file(path))


@pytest.mark.parametrize("path", ["a\0b", "\ud800", "/dev/zero", "x" * 300, "x/" * 3000, "none.yaml", "/"])
def test_what_is_no_regular_file_is_refused(path: str) -> None:
    """NULs, halves of characters, devices, folders and names that no file can have, of sweeps and of walks."""
    for read in (read_walk_file, load_sweep):
        refusal(lambda read=read: read(path))


def test_numbers_aliases_and_dates_mean_what_they_say(tmp_path: Path) -> None:
    """`1e9` is a number, an alias repeats a value, and a date is a text; a file that is no text is refused."""
    path = tmp_path / "x"
    path.write_text("{a: &b [1e3, -.5], c: *b, d: 1_000, e: 2020-01-01, f: no, g: .inf, <<: 1}")
    assert read_yaml(path) == {
        "a": [1e3, -0.5], "c": [1e3, -0.5], "d": 1000, "e": "2020-01-01", "f": False, "g": math.inf, "<<": 1
    }  # fmt: skip
    path.write_bytes(b"\xff\xfe\xff")
    assert refusal(lambda: read_yaml(path)).startswith(str(path))


@pytest.mark.parametrize("name", DRAWABLE)
def test_drawn_values_are_checked_as_given_ones(name: str) -> None:
    """Within, at and beyond its bounds, and not a number: what is drawn is taken, or refused, as if it were given."""
    setup = setup_walk("paper", {"links": 60, "start": "ellipse"})
    section, model = SECTION_OF[name], SECTIONS[SECTION_OF[name]]
    usual, (least, most) = getattr(setup, section), field_bounds(FIELDS[name])

    def taken(check: Callable[[], object]) -> object:
        try:
            return vars(check())
        except InputError as error:
            return str(error)

    for value in (least, most, math.nextafter(least, -math.inf), math.nextafter(most, math.inf), math.nan, math.inf):
        drawn = taken(lambda value=value: with_numbers(usual, {name: value}, section))  # type: ignore[misc]
        given = taken(lambda value=value: validated(model, vars(usual) | {name: value}, section))  # type: ignore[misc]
        assert drawn == given, value
