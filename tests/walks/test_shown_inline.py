"""What a notebook shows of results and figures, without pyplot and without IPython's help."""

from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from tests.support.made_sweeps import FIGURE_6, make_sweep
from tests.support.made_walks import make_unreleased, make_walk
from warpchain.results.sweep_result import SweepResult

PNG = b"\x89PNG\r\n\x1a\n"


def test_a_walk_is_shown_with_numbers_and_picture() -> None:
    """Rich HTML has status, distance and chain, and the picture that PNG has."""
    walk = make_walk()
    shown = walk._repr_html_()
    for text in ("at_rest", "0.64 m", "30 links at 15 Hz", "data:image/png;base64,"):
        assert text in shown
    assert walk._repr_png_().startswith(PNG)


def test_a_sweep_is_shown_with_its_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Name, walks by status and axes, escaped; the main figure if there is one."""
    result = make_sweep(tmp_path, FIGURE_6)
    assert result._repr_png_().startswith(PNG) and result.plot()._repr_png_().startswith(PNG)
    shown = result._repr_html_()
    for text in ("made &lt;up&gt; &amp; down", "at_rest", "links: 5", "sample: 12", "<img"):
        assert text in shown

    def fail(self: Any) -> Figure:
        raise ValueError("nothing to show")

    monkeypatch.setattr(SweepResult, "plot", fail)
    assert result._repr_png_() is None and "<img" not in result._repr_html_()


def test_energies_go_into_axes_of_the_caller() -> None:
    """`ax` of a figure or of a part of one; other kinds, and `figure` beside it, are refused."""
    walk, own = make_walk(), Figure()
    left, right = own.subfigures(1, 2)
    for axes in (left.subplots(), right.subplots()):
        assert walk.plot("energy", ax=axes) is own and len(axes.lines) == 5
    with pytest.raises(ValueError, match="ax: film_strip has several axes"):
        walk.plot("film_strip", ax=axes)
    with pytest.raises(ValueError, match="ax: not possible with figure"):
        walk.plot("energy", ax=axes, figure=own)
    with pytest.raises(ValueError, match="it has no time series"):
        make_unreleased().plot("energy")
