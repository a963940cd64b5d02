"""The comparison of two sweeps in studies/accuracy."""

from pathlib import Path

import pytest
import yaml

import warpchain
from studies.accuracy.run import main

CONTENT = {
    "version": 1,
    "name": "pairs",
    "seed": 3,
    "preset": "soft",
    "samples": 6,
    "scene": {"start": "ellipse", "links": 20},
    "grid": {"frequency": [6.0, 8.0]},
}


def swept(folder: Path, **options: float) -> str:
    """Folder of a sweep of these walks with other options."""
    source = folder.with_suffix(".yaml")
    source.write_text(yaml.safe_dump(CONTENT | {"options": options}, sort_keys=False))
    warpchain.sweep(source, folder)
    return str(folder)


def test_walks_are_compared_in_pairs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A sweep does not differ from itself; with other steps its walks do, and their steps and errors are shown."""
    coarse = swept(tmp_path / "coarse")
    main(coarse, coarse)
    shown = capsys.readouterr().out
    assert shown.count("+0.00 ± 0.00 % (6 pairs)") == 2
    main(coarse, swept(tmp_path / "fine", tolerance=1e-5))
    shown = capsys.readouterr().out
    assert shown.count("(6 pairs)") == 2 and shown.count("attempted steps") == 2
    assert "main, frequency 6: +0.00 ± 0.00 %" not in shown


def test_sweeps_of_other_cells_are_refused(tmp_path: Path) -> None:
    """Cells are compared with themselves only."""
    one = swept(tmp_path / "one")
    other = {**CONTENT, "grid": {"frequency": [6.0]}}
    (tmp_path / "other.yaml").write_text(yaml.safe_dump(other, sort_keys=False))
    warpchain.sweep(tmp_path / "other.yaml", tmp_path / "other")
    with pytest.raises(warpchain.InputError, match="other cells"):
        main(one, str(tmp_path / "other"))
