"""The sweeps that come with the project."""

import math
import re
from pathlib import Path

import pytest

from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError
from warpchain.inputs.yaml_files import parse_yaml, read_yaml
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.shipped import shipped_sweeps, write_new_sweep
from warpchain.sweeps.sweep_file import SweepFile

SWEEPS = Path(__file__).parents[2] / "sweeps"


PLANAR = [name for name in Parameters.model_fields if name != "half_width"]
"""Parameters that matter to a chain whose plane is fixed."""


@pytest.mark.parametrize(
    ("name", "shapes"),
    [
        ("quickstart", {"main": (2, 3, 4)}),
        ("figure6", {"rest": (5, 6, 12), "ellipse": (2, 6, 12)}),
        ("tolerance", {"main": (2, 2, 2, 12)}),
        ("montecarlo", {"main": (7, 8, 1800)}),
        ("tilt", {"fixed": (5, 5, 200), "tilted": (5, 5, 4, 200)}),
        (
            "sensitivity",
            {"ranges": (64 * 17,), "measured": (32 * 14,)} | {name: (3, 8) for name in PLANAR},
        ),
    ],
)
def test_shipped_sweeps(name: str, shapes: dict[str, tuple[int, ...]]) -> None:
    """Each shipped file loads, is named as its file and has the walks that it promises."""
    sweep = load_sweep(SWEEPS / f"{name}.yaml")
    assert sweep.name == name
    assert {block.name: block.shape for block in sweep.blocks} == shapes
    assert sweep.walk_count == sum(math.prod(shape) for shape in shapes.values())
    preset = "paper" if name in ("figure6", "quickstart", "tilt") else "soft"
    for index in sweep.indices[[0, sweep.walk_count // 2, -1]].tolist():
        assert sweep.planned(index).setup.preset == preset


def test_shipped_sweeps_have_bare_names() -> None:
    """The package finds every one of them by its name, whatever the folder; what has a suffix is a path."""
    names = ["figure6", "montecarlo", "quickstart", "sensitivity", "tilt", "tolerance"]
    assert shipped_sweeps() == sorted(path.stem for path in SWEEPS.iterdir()) == names
    for name in shipped_sweeps():
        assert load_sweep(name).digest() == load_sweep(SWEEPS / f"{name}.yaml").digest()
    for missing in ("figure", "figure6.yaml", "sweeps/figure"):
        with pytest.raises(InputError, match=f"^{missing}: "):
            load_sweep(missing)


def test_the_examples_of_a_new_sweep_are_possible(tmp_path: Path) -> None:
    """Each example that a new sweep has as a comment can be taken into the file; together they name every key."""
    path = tmp_path / "new.yaml"
    write_new_sweep(path)
    text = path.read_text(encoding="utf-8")
    examples = re.findall(r"(?:^#(?=\w).*\n(?:^#  .*\n)*)", text, re.MULTILINE)
    keys = set(read_yaml(path))
    for example in examples:
        (key, value), *_ = parse_yaml(re.sub("^#", "", example, flags=re.MULTILINE), "example").items()
        changed = read_yaml(path) | {key: value}
        if key == "blocks":
            del changed["grid"]
        assert load_sweep(changed).digest() != load_sweep(path).digest(), key
        keys.add(key)
    assert keys == set(SweepFile.model_fields)
