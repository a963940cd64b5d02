"""Arguments of another kind than wanted: one line with the name of the argument, and the right name for a wrong one."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import pytest

import warpchain
from tests.support.command_line import Command
from tests.support.made_sweeps import make_sweep
from tests.support.made_walks import make_walk
from tests.support.presets import SOFT
from tests.support.sweep_content import content
from warpchain import video
from warpchain.inputs.validation import InputError
from warpchain.reports.sweep_figures import figures as sweep_figures

SHORT: dict[str, Any] = {"start": "ellipse", "stop_time": 0.02, "links": 40, "preset": "soft"}


def joined() -> tuple[Any, Any]:
    """Positions and velocities of four links."""
    half = SOFT.link_length / 2
    turns = [(0.0, -1.0, 0.0), (1.0, 0.0, 0.5), (0.0, 1.0, 1.0), (-1.0, 0.0, 1.5)]
    return [[x * half, 0.1 + y * half, 3.14159265358979 * turn] for x, y, turn in turns], [[0.0] * 3] * 4


def saved_walk() -> warpchain.WalkResult:
    """A walk that was read from its file."""
    with tempfile.TemporaryDirectory() as folder:
        make_walk().save(f"{folder}/walk.h5")
        return warpchain.load_walk(f"{folder}/walk.h5")


@pytest.mark.parametrize(
    ("call", "problem"),
    [
        (lambda: warpchain.sweep(links=[40], out="never", executor=3), "executor: expected one with submit, such as "),
        (lambda: video.video_of(3), "walk: expected a WalkResult, got 3"),  # type: ignore[arg-type]
        (
            lambda: warpchain.sweep(points={"mu": [0.1]}, out="never"),
            "sweep.points.mu: unknown name; did you mean mu_fc, ",
        ),
        (lambda: warpchain.walk(sed=1), "'sed': unknown name; did you mean seed?"),
        (lambda: warpchain.sweep(links=[20, 30], sampels=3, out="x"), "'sampels': unknown name; did you mean samples?"),
        (lambda: warpchain.sweep(links=[20, 30], worker=3, out="x"), "'worker': unknown name; did you mean workers?"),
        (lambda: warpchain.walk(mu=0.1), "'mu': unknown name; did you mean mu_fc, mu_cc or mu_sc?"),
        (lambda: warpchain.walk(μ=0.1), "'μ': unknown name; did you mean mu_fc, mu_cc or mu_sc?"),
        (lambda: warpchain.walk(tau=0.1), "'tau': unknown name; did you mean tau_c?"),
        (
            lambda: warpchain.walk(links=[40, 60]),
            "scene.links: expected one value for a walk, got [40, 60]; use warpc",
        ),  # type: ignore[arg-type]
        (
            lambda: warpchain.walk(mu_fc=[0.1, 0.2]),
            "parameters.floor_friction: expected one value for a walk, got [0.1, ",
        ),
        (
            lambda: warpchain.simulate("soft", *joined()),
            "duration: missing; set it in s, or set times",
        ),
        (
            lambda: make_walk().energy["potental_at_end"],
            "'potental_at_end': unknown name; did you mean potential_at_end?",
        ),
        (lambda: saved_walk().release["hight"], "'hight': unknown name; did you mean height?"),
        (
            lambda: warpchain.simulate("soft", *joined(), times=[0.0]).losses["flor"],
            "'flor': unknown name; did you mean floor?",
        ),
        (lambda: warpchain.load(None), "path: expected a path, got None; pass it as text"),  # type: ignore[arg-type]
        (lambda: warpchain.load(""), "path: expected a path, got ''; pass it as text"),
        (lambda: warpchain.load([]), "path: expected folders of a sweep, got an empty list"),
        (lambda: warpchain.load_walk(None), "path: expected a path, got None; pass it as text"),  # type: ignore[arg-type]
        (lambda: warpchain.load_walk(0), "path: expected a path, got 0; pass it as text"),  # type: ignore[arg-type]
    ],
)
def test_one_line_has_the_right_name(call: Callable[[], object], problem: str) -> None:
    """No error of another library, and nothing written."""
    with pytest.raises(InputError) as caught:
        call()
    assert str(caught.value).startswith(problem) and "\n" not in str(caught.value)
    assert not Path("never").exists()


def test_the_command_line_knows_too(command: Command) -> None:
    """`--set mu=0.1` and `--links "[40, 60]"` are answered as keyword arguments are."""
    assert "did you mean mu_fc, mu_cc or mu_sc?" in command("walk", "--set", "mu=0.1").err
    answer = command("walk", "--links", "[40, 60]")
    assert answer.status == 2 and "use warpchain.sweep or a sweep file for a grid" in answer.err


def test_instants_are_enough_for_a_flight() -> None:
    """Without a duration a flight lasts until the last of its instants."""
    position, velocity = joined()
    by_times = warpchain.simulate("soft", position, velocity, times=[0.0, 1e-4])
    both = warpchain.simulate("soft", position, velocity, 1e-4, times=[0.0, 1e-4])
    assert by_times.status is warpchain.Status.FINISHED and (by_times.position == both.position).all()


@pytest.fixture(scope="module")
def walk() -> Any:
    """The first moments of a walk, with frames."""
    return warpchain.walk(**SHORT)


def test_what_is_drawn_into_is_checked(walk: Any, tmp_path: Path) -> None:
    """`ax` and `figure` of another kind are refused by name, of walks and of sweeps."""
    result = make_sweep(tmp_path, content())
    for draw, name in (
        (lambda: walk.plot("energy", ax=3), "ax: expected matplotlib Axes, got 3"),
        (lambda: walk.plot("energy", figure=3), "figure: expected an empty matplotlib Figure or SubFigure, got 3"),
        (lambda: walk.plot("film_strip", figure="x"), "figure: expected an empty matplotlib Figure"),
        (lambda: result.plot(figure=3), "figure: expected an empty matplotlib Figure or SubFigure, got 3"),
    ):
        with pytest.raises(InputError, match=f"^{name}"):
            draw()


def test_figures_need_no_latex(walk: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With `text.usetex` and no LaTeX all figures of walks and sweeps are drawn, and the film."""
    monkeypatch.setenv("PATH", "")
    result = make_sweep(tmp_path / "sweep", content())
    with matplotlib.rc_context({"text.usetex": True}):
        figures = [*(walk.plot(kind) for kind in ("film_strip", "height_and_speed", "energy")), result.plot()]
        figures += [picture.figure for picture in sweep_figures(result)]
        assert len(figures) == 5
        for number, figure in enumerate(figures):
            figure.savefig(tmp_path / f"{number}.png", dpi=40)
        walk.animate(tmp_path / "walk.gif")
    assert (tmp_path / "walk.gif").stat().st_size > 1000


def test_figures_need_no_backend(tmp_path: Path) -> None:
    """An unknown MPLBACKEND is told in one line, and the figures are drawn."""
    make_sweep(tmp_path / "sweep", content())
    done = subprocess.run(
        [sys.executable, "-m", "warpchain", "plot", "sweep"],
        cwd=tmp_path,
        env=os.environ | {"MPLBACKEND": "nonsense", "PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0 and (tmp_path / "sweep/distance.png").exists()
    assert (
        done.stderr == "warning: MPLBACKEND: 'nonsense' is not a backend of matplotlib; figures are drawn without it\n"
    )
