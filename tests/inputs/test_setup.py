"""The setup of a walk: completed values, and YAML files."""

from pathlib import Path

import pytest

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS
from warpchain.inputs.scene import Scene
from warpchain.inputs.setup import Setup, read_setup, resolve
from warpchain.inputs.validation import InputError


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
        ("preset: !!int abc", "{path}, line 1: 'abc' is no number"),
        ("preset: \x00", "{path}: "),
        ("[" * 5000, "{path}, line 1: more than 20 lists or mappings inside of one another"),
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
