"""The sweep files of studies."""

from pathlib import Path

import pytest

from tests.docs.code_blocks import ROOT
from warpchain.sweeps.plan import load_sweep


@pytest.mark.parametrize("path", sorted(ROOT.glob("studies/*/sweeps/*.yaml")), ids=lambda path: path.stem)
def test_a_sweep_of_a_study_loads(path: Path) -> None:
    """Each file is a sweep of its own name."""
    sweep = load_sweep(path)
    assert sweep.name == path.stem and sweep.walk_count > 0


@pytest.mark.parametrize("name", ["paper_claims", "paper_joints", "paper_tolerance"])
def test_sweeps_of_the_paper_have_its_cells(name: str) -> None:
    """Each block has the paper's 30 cells, and the same samples along its further axis."""
    sweep = load_sweep(ROOT / f"studies/paper/sweeps/{name}.yaml")
    for block in sweep.blocks:
        links, frequency, *others = block.axes
        assert block.axes[links] == (60, 90, 120, 150, 180) and block.axes[frequency] == (5, 10, 15, 20, 25, 30)
        assert all(other in sweep.same_samples_along and other not in block.drawn for other in others)
