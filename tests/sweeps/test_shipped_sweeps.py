"""The sweeps that come with the project."""

import math
import re
from pathlib import Path

import pytest

from warpchain.inputs.validation import InputError
from warpchain.inputs.yaml_files import parse_yaml, read_yaml
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.sweep_file import SweepFile, shipped_sweeps, write_new_sweep

ROOT = Path(__file__).parents[2]
SWEEPS = ROOT / "sweeps"


@pytest.mark.parametrize(
    "path", sorted([*SWEEPS.iterdir(), *ROOT.glob("studies/*/sweeps/*.yaml")]), ids=lambda path: path.stem
)
def test_sweeps_of_the_repository(path: Path) -> None:
    """Each file, shipped or of a study, loads, is named as its file, and its first and last walk can be planned."""
    sweep = load_sweep(path)
    assert sweep.name == path.stem and sweep.walk_count == sum(math.prod(block.shape) for block in sweep.blocks) > 0
    for index in sweep.indices[[0, -1]].tolist():
        assert sweep.walk(index).index == index


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
        needed = {"randomisations": {"sampler": "sobol"}, "at_most": {"until": 0.01}}
        plain = read_yaml(path) | needed.get(key, {})
        changed = plain | {key: value}
        if key == "blocks":
            del changed["grid"]
        assert load_sweep(changed).digest() != load_sweep(plain).digest(), key
        keys.add(key)
    assert keys == set(SweepFile.model_fields)
