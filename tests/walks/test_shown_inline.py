"""What a notebook shows of results and figures, without pyplot and without IPython's help."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.support.made_sweeps import FIGURE_6, make_sweep
from tests.support.made_walks import make_walk
from warpchain.status import Status
from warpchain.store.sweep_result import SweepResult

PNG = b"\x89PNG\r\n\x1a\n"


def test_a_walk_is_shown_with_numbers_and_picture() -> None:
    """Rich HTML has status, distance and seed, and the picture that PNG has."""
    walk = make_walk()
    shown = walk._repr_html_()
    for text in ("at_rest", "0.64 m", "30 links at 15 Hz", str(walk.seed), "data:image/png;base64,"):
        assert text in shown
    assert walk._repr_png_().startswith(PNG)


def test_a_sweep_is_shown_with_its_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Name, walks by status and axes, escaped; the main figure if there is one."""
    result = make_sweep(tmp_path, FIGURE_6)
    assert result._repr_png_().startswith(PNG) and result.plot()._repr_png_().startswith(PNG)
    shown = result._repr_html_()
    for text in ("made &lt;up&gt; &amp; down", "at_rest", "links 60, 90", "frequency 5, 10", "samples 12", "<img"):
        assert text in shown

    def fail(self: Any) -> Figure:
        raise ValueError("nothing to show")

    monkeypatch.setattr(SweepResult, "plot", fail)
    assert result._repr_png_() is None and "<img" not in result._repr_html_()


@pytest.mark.parametrize("kind", ["height_and_speed", "film_strip", "energy"])
def test_figures_show_themselves_without_pyplot(kind: str) -> None:
    """The figure that `plot` returns has a picture for a notebook, in a process that never loads pyplot."""
    program = (
        "import sys\n"
        "from tests.support.made_walks import make_walk\n"
        f"figure = make_walk().plot({kind!r})\n"
        "print(figure._repr_png_()[1:4].decode(), 'matplotlib.pyplot' in sys.modules)\n"
    )
    folder = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8", cwd=folder)
    assert done.stdout == "PNG False\n", done.stderr


def test_energies_go_into_axes_of_the_caller() -> None:
    """`ax` of a figure or of a part of one; other kinds, and `figure` beside it, are refused."""
    walk, own = make_walk(), Figure()
    left, right = own.subfigures(1, 2)
    for axes in (left.subplots(), right.subplots()):
        assert walk.plot("energy", ax=axes) is own and len(axes.lines) == 5
    with pytest.raises(ValueError, match="ax: film_strip has several axes"):
        walk.plot("film_strip", ax=axes)
    with pytest.raises(ValueError, match="ax: given together with figure"):
        walk.plot("energy", ax=axes, figure=own)
    empty = {name: np.empty(0) for name in ("time", "kinetic_energy", "gravitational_energy", "spring_energy")}
    empty |= {name: np.empty(0) for name in ("lowest", "rms_speed")}
    pairs = {name: np.empty((0, 2)) for name in ("center", "center_velocity")}
    with pytest.raises(ValueError, match="it has no time series"):
        make_walk(**empty, **pairs, status=Status.NOT_STEADY).plot("energy")
