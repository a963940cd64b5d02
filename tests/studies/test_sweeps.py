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
