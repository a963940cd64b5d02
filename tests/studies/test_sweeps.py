"""The sweeps of the studies."""

from pathlib import Path

import pytest

from tests.docs.code_blocks import ROOT
from warpchain.sweeps.plan import load_sweep

SWEEPS = sorted(ROOT.glob("studies/*/sweeps/*.yaml"))


@pytest.mark.parametrize("path", SWEEPS, ids=lambda path: path.stem)
def test_a_sweep_of_a_study_can_be_planned(path: Path) -> None:
    """Each file is named as its sweep; walks along an axis with the same samples share all but what stands there."""
    sweep = load_sweep(path)
    assert sweep.name == path.stem
    for block in sweep.blocks:
        first = sweep.planned(block.first).setup
        sections = ("scene", "options", "parameters")
        flat = {name: value for of in sections for name, value in getattr(first, of).model_dump().items()}
        sizes = [len(values) for values in block.axes.values()]
        for place, (name, values) in enumerate(block.axes.items()):
            step = block.samples
            for size in sizes[place + 1 :]:
                step *= size
            other = sweep.planned(block.first + step * (len(values) - 1)).setup
            found = {key: value for of in sections for key, value in getattr(other, of).model_dump().items()}
            if name in sweep.same_samples_along:
                assert {**found, name: flat[name]} == flat
                assert found[name] == values[-1]
