"""Figures of a quantity over any grid."""

import json
import math
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tests.support.command_line import Command
from tests.support.made_sweeps import distance, make_sweep
from warpchain.inputs.validation import InputError
from warpchain.pictures.grid_figure import MOST_PANELS
from warpchain.pictures.style import NothingToShow
from warpchain.reports.sweep_figures import figures
from warpchain.reports.sweep_page import write_report
from warpchain.results.sweep_result import load, merge
from warpchain.status import Status
from warpchain.sweeps.plan import PlannedWalk

FRICTION = [0.4, 0.1, 0.2, 0.6]
"""Not in order, as a sweep may give its values."""
GRAVITY = [1.6, 3.7, 9.8]
STARTS = ["rest", "spinning", "ellipse"]
EIGHT = [5, 6, 7, 8, 9, 10, 11, 12]
NINE = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]


def sweep(grid: dict[str, Any] | None = None, **keys: Any) -> dict[str, Any]:
    """A sweep that draws nothing but the phase; of one block, if a grid is given."""
    content = {"version": 1, "name": "grids", "seed": 1, "preset": "soft", "samples": 3}
    content |= {"distributions": {"all": "fixed", "phase": "table"}}
    return content | ({} if grid is None else {"grid": grid}) | keys


def flawed(walk: PlannedWalk) -> float | Status:
    """All three walks of the second cell fail, one of the third."""
    return Status.TIME_LIMIT if walk.index in (3, 4, 5, 8) else distance(walk)


def panels(figure: Any) -> dict[str, Axes]:
    """Title → panel."""
    return {
        axes.get_title(loc="left"): axes for axes in figure.axes if axes.axison and axes.get_label() != "<colorbar>"
    }


def lines(axes: Axes) -> list[tuple[np.ndarray, np.ndarray]]:
    """Places and means of the lines of a panel."""
    return [(np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in drawn_lines(axes)]


def drawn_lines(axes: Axes) -> list[Any]:
    """The lines of a panel, without the crosses of failures and the marks of survivors."""
    return [line for line in axes.lines if line.get_marker() != "x" and line.get_label() != "_mark"]


def legend_texts(figure: Any) -> list[str]:
    """Title and entries of the legend of a figure."""
    (legend,) = figure.legends
    return [legend.get_title().get_text(), *(text.get_text() for text in legend.get_texts())]


# Lines


def test_one_axis_is_a_line_with_bars_and_failures(tmp_path: Path) -> None:
    """The line passes through the means by value, with bars of error and deviation; crosses say where walks failed."""
    result = make_sweep(tmp_path, sweep({"links": [60], "floor_friction": FRICTION}), flawed)
    figure = result.plot()
    (axes,) = panels(figure).values()
    found, order = result.statistics(), np.argsort(FRICTION)
    mean, sd, error = (table[0, order] for table in (found.mean, found.sd, found.standard_error))
    np.testing.assert_array_equal(lines(axes), [(np.sort(FRICTION), mean)])
    assert np.isnan(mean).tolist() == [True, False, False, False]
    for bars, half in zip(axes.collections, (sd, error), strict=True):
        ends = np.array([bar.vertices[:, 1] for bar in bars.get_paths()])  # type: ignore[index]
        np.testing.assert_allclose(ends, np.stack([mean - half, mean + half], axis=1))
    (crosses,) = [line for line in axes.lines if line.get_marker() == "x"]
    assert np.asarray(crosses.get_xdata()).tolist() == [0.1, 0.2]
    assert axes.get_xlabel() == "floor friction $μ_\\mathrm{fc}$\n4 of 12 walks failed"
    assert axes.get_ylabel() == "distance walked $Δx$ / m" and "walks failed" in legend_texts(figure)


@pytest.mark.parametrize(
    ("grid", "along", "across", "legend"),
    [
        ({"floor_friction": FRICTION, "gravity": GRAVITY}, "gravity", "floor_friction", "$g$ / m/s²|1.6|3.7|9.8"),
        ({"start": STARTS, "floor_friction": [0.2, 0.1]}, "start", "floor_friction", "start|rest|spinning|ellipse"),
        (
            {"soften_drive": [True, False], "frequency": [10, 20]},
            "soften_drive",
            "frequency",
            "soften drive|true|false",
        ),
        ({"links": [60, 90, 120], "frequency": [10, 20]}, "frequency", "links", "$ν$ / Hz|10|20"),
    ],
)
def test_two_axes_are_lines(tmp_path: Path, grid: dict[str, Any], along: str, across: str, legend: str) -> None:
    """The shorter axis gives the lines, names always do; the legend has symbol, unit and short values."""
    result = make_sweep(tmp_path, sweep(grid), flawed)
    figure = result.plot()
    (axes,) = panels(figure).values()
    table = result.statistics().mean.squeeze()
    table = table.T if list(grid).index(across) < list(grid).index(along) else table
    expected = [(np.sort(grid[across]), mean[np.argsort(grid[across])]) for mean in table]
    np.testing.assert_array_equal(lines(axes), expected)
    assert "|".join(legend_texts(figure)).startswith(legend)
    handles = figure.legends[0].legend_handles
    colors = [line.get_color() for line in drawn_lines(axes)]
    assert [handle.get_color() for handle in handles[: len(colors)]] == colors


@pytest.mark.parametrize(("outcome", "low", "high"), [(2.0, 0.0, 2.1), (-2.0, -2.1, 0.0)])
def test_zero_is_on_the_axis(tmp_path: Path, outcome: float, low: float, high: float) -> None:
    """Of distances alike, forwards and, up a slope, backwards."""
    result = make_sweep(tmp_path, sweep({"floor_friction": FRICTION}), lambda walk: outcome)
    (axes,) = panels(result.plot()).values()
    assert axes.get_ylim() == pytest.approx((low, high), abs=0.02)


def test_further_axes_are_panels(tmp_path: Path) -> None:
    """Four axes give a panel for each pair of values of two of them; of very many, the first are shown and counted."""
    grid = {"links": [60, 90], "start": ["rest", "ellipse"], "gravity": GRAVITY, "floor_friction": FRICTION}
    drawn = panels(make_sweep(tmp_path / "four", sweep(grid)).plot())
    assert list(drawn) == [f"$n$ = {n}, start = {start}" for n in (60, 90) for start in ("rest", "ellipse")]
    counts = {"gravity": 6, "settle_time": 5, "extra_hold": 7, "walk_limit": 8}
    grid = {name: list(range(1, 1 + count)) for name, count in counts.items()}
    figure = make_sweep(tmp_path / "many", sweep(grid, samples=1), lambda walk: 1.0 + walk.index).plot()
    assert len(panels(figure)) == MOST_PANELS
    assert isinstance(figure, Figure) and figure.get_suptitle().endswith(f"{MOST_PANELS} of 30 panels")


# Maps


def test_two_long_axes_are_a_map(tmp_path: Path) -> None:
    """The longer axis runs along x; cells without walks are empty; dots and the legend tell of failures."""
    result = make_sweep(tmp_path, sweep({"gravity": EIGHT, "floor_friction": NINE}), flawed)
    figure = result.plot()
    (axes,) = panels(figure).values()
    found = result.statistics()
    np.testing.assert_array_equal(np.ma.filled(axes.images[0].get_array(), np.nan), found.mean)
    assert np.isnan(found.mean[0, 1])
    (dots,) = axes.collections
    np.testing.assert_array_equal(dots.get_offsets(), [[1, 0], [2, 0]])
    areas = dots.get_sizes()  # type: ignore[attr-defined]
    assert areas[1] / areas[0] == pytest.approx(1 / 3)


# Blocks, quantities, places to draw


def test_blocks_are_panels(tmp_path: Path) -> None:
    """Blocks of the same axes are named and have common colours, others are told apart by their axes."""
    blocks = [
        {"name": "rest", "grid": {"links": [60, 90], "frequency": [10, 20, 30]}},
        {"name": "ellipse", "scene": {"start": "ellipse"}, "grid": {"links": [90], "frequency": [10, 20, 30]}},
        {"name": "spinning", "scene": {"start": "spinning"}, "grid": {"links": [90, 120], "frequency": [10, 20, 30]}},
        {"name": "one_cell"},
    ]
    result = make_sweep(tmp_path, sweep(blocks=blocks))
    figure = result.plot()
    drawn = panels(figure)
    assert list(drawn) == ["rest", "", "spinning"]
    for name, axes in (("rest", drawn["rest"]), ("spinning", drawn["spinning"])):
        np.testing.assert_array_equal([mean for _, mean in lines(axes)], result.blocks[name].statistics().mean)
    assert drawn["rest"].lines[1].get_color() == drawn["spinning"].lines[0].get_color()


def test_any_column_of_numbers(tmp_path: Path, command: Command) -> None:
    """Columns are drawn in their units; what is drawn has its symbol; the command names its figure by the column."""
    content = sweep({"gravity": GRAVITY}, distributions={"all": "fixed", "floor_friction": "table"})
    result = make_sweep(tmp_path, content)
    for quantity, label in (
        ("walk_time", "walk time / s"),
        ("bounces", "bounces"),
        ("floor_friction_drawn", "floor friction $μ_\\mathrm{fc}$"),
    ):
        figure = result.plot(quantity=quantity)
        assert figure.axes[0].get_ylabel() == label
        ((_, drawn),) = lines(*panels(figure).values())
        np.testing.assert_array_equal(drawn, result.statistics(quantity).mean)
    for name in ("status", "index", "gravity", "walk_tim"):
        with pytest.raises(InputError, match=rf"^quantity: '{name}' is not a column of numbers; "):
            result.plot(quantity=name)
    assert command("plot", ".", "-o", "drawn", "--quantity", "walk_time").out == "drawn/walk_time_against_gravity.png\n"
    assert command("plot", ".", "-o", "none", "--quantity", "walk_tim").status == 2 and not Path("none").exists()


def test_a_figure_may_be_given(tmp_path: Path) -> None:
    """It is drawn into, also if it is a part of another."""
    result = make_sweep(tmp_path, sweep({"gravity": GRAVITY, "floor_friction": FRICTION}))
    left, right = Figure(layout="constrained").subfigures(1, 2)
    assert result.plot(figure=right) is right and not left.axes
    (axes,) = panels(right).values()
    assert len(lines(axes)) == 3 and legend_texts(right)[0] == "$g$ / m/s²"


def test_what_a_walk_does_not_have_is_in_no_mean(tmp_path: Path, command: Command) -> None:
    """−1 and NaN of walks without a quantity are not averaged; figures say how many have none."""

    def columns(walk: PlannedWalk) -> dict[str, float]:
        """All walks of the first cell collapse, one of the second and of the third, and no ellipse has a hold."""
        bounces = walk.sample if walk.index < 3 else 4 if walk.index in (4, 7) else -1
        collapsed_at = 0.25 * bounces if bounces >= 0 else np.nan
        return {"bounces_before_collapse": bounces, "collapsed_at": collapsed_at, "hold_time": np.nan}

    content = sweep({"frequency": [10, 20, 30, 40]}, scene={"start": "ellipse"})
    failing = {5: Status.TIME_LIMIT}
    result = make_sweep(tmp_path, content, lambda walk: failing.get(walk.index, distance(walk)), columns)
    for quantity, each in (("bounces_before_collapse", 1.0), ("collapsed_at", 0.25)):
        found = result.cell_statistics(quantity)["main"]
        np.testing.assert_array_equal(found.mean, [1 * each, 4 * each, 4 * each, np.nan])
        np.testing.assert_array_equal(found.sd, [each, np.nan, np.nan, np.nan])
        assert found.count.tolist() == [3, 1, 1, 0] and found.absent.tolist() == [0, 1, 2, 3]
        assert found.failed.tolist() == [0, 1, 0, 0]
        assert result.plot(quantity=quantity).axes[0].get_xlabel().endswith("\n1 of 12 walks failed, 6 of 12 have none")
    assert result.statistics().count.tolist() == [3, 2, 3, 3] and not result.statistics().absent.any()
    with pytest.raises(NothingToShow, match="no walk has this quantity; use another"):
        result.plot(quantity="hold_time")
    answer = command("plot", ".", "--quantity", "hold_time")
    assert answer.status == 2 and answer.err.startswith("error: --quantity: hold_time: no walk at rest has a value")


# All figures of a sweep


@pytest.mark.parametrize(
    ("grid", "names"),
    [
        ({"gravity": GRAVITY}, ["distance_against_gravity"]),
        ({"links": [60, 90]}, ["distance", "distance_against_links"]),
        ({"tolerance": [1e-6, 1e-9]}, ["distance_against_tolerance"]),
        ({"links": list(range(40, 200, 20)), "frequency": [10, 20]}, ["distance_against_links_and_frequency"]),
        ({"links": [60, 90], "floor_friction": FRICTION}, ["distance_against_links_and_floor_friction"]),
        ({"gravity": EIGHT, "floor_friction": NINE}, ["distance_against_gravity_and_floor_friction"]),
    ],
)
def test_every_grid_has_a_figure(tmp_path: Path, grid: dict[str, Any], names: list[str]) -> None:
    """What no special figure shows has a figure of its grid; all can be drawn."""
    pictures = list(figures(make_sweep(tmp_path, sweep(grid), flawed)))
    assert [picture.name for picture in pictures if picture.name.startswith("distance")] == names
    for picture in pictures:
        picture.figure.savefig(tmp_path / "picture.png", dpi=40)


def test_responses_are_panels_of_all_blocks_that_vary_one_quantity(tmp_path: Path) -> None:
    """A panel for each such block, numbers or names, with its own x axis and its own lost walks."""
    blocks = [
        {"name": "friction", "grid": {"floor_friction": [0.135, 0.27, 0.54]}},
        {"name": "stiffness", "grid": {"joint_stiffness": [1e6, 1e7]}},
        {"name": "preset", "grid": {"preset": ["soft", "paper"]}},
        {"name": "figure6", "grid": {"frequency": [10, 20]}},
    ]

    def outcome(walk: PlannedWalk) -> float | Status | None:
        return {9: Status.NOT_FINITE, 10: None}.get(walk.index, distance(walk))

    result = make_sweep(tmp_path, sweep(blocks=blocks), outcome)
    (picture,) = [picture for picture in figures(result) if picture.name == "distance_responses"]
    friction, stiffness, presets = picture.figure.axes
    label = " ".join(stiffness.get_xlabel().split())
    assert label == "joint stiffness $k$ / N/m 1 of 6 walks failed, 1 of 6 not run yet"
    assert [text.get_text() for text in presets.get_xticklabels()] == ["soft", "paper"]
    np.testing.assert_array_equal(lines(friction)[0][1], result.blocks["friction"].statistics().mean)


def test_the_axis_along_x_may_be_chosen(tmp_path: Path) -> None:
    """Three frequencies or more run along x, else the longest axis; x= names another one, or is refused."""
    grid = {"links": [60, 120], "frequency": [10, 20, 30], "floor_friction": FRICTION}
    result = make_sweep(tmp_path, sweep(grid))
    assert "frequency" in result.plot().axes[0].get_xlabel()
    drawn = panels(result.plot(x="floor_friction"))
    assert list(drawn) == ["$n$ = 60", "$n$ = 120"]
    means = result.statistics().mean[..., np.argsort(FRICTION)]
    for row, axes in enumerate(drawn.values()):
        np.testing.assert_array_equal([mean for _, mean in lines(axes)], means[row])
    with pytest.raises(InputError, match=r"^x: 'gravity' is not an axis with several values; use one of links, freq"):
        result.plot(x="gravity")


# Means of survivors


def slid_away(walk: PlannedWalk) -> float | Status:
    """On the slope of 15° two of three walks go on without end, on that of 20° all."""
    if walk.setup.scene.slope == 20 or (walk.setup.scene.slope == 15 and walk.sample):
        return Status.DISTANCE_LIMIT
    return 2.0


def test_means_of_survivors_are_marked_and_bounded(tmp_path: Path, command: Command) -> None:
    """Figure, table, JSON and page mark a mean that leaves out walks, and bound that of all walks where one can."""
    content = sweep({"slope": [0, 15, 20]}, scene={"distance_limit": 20.0})
    result = make_sweep(tmp_path / "slope", content, slid_away)
    cells = result.statistics()
    assert cells.of_survivors.tolist() == [False, True, False] and cells.absent.tolist() == [0, 2, 3]
    np.testing.assert_allclose(cells.at_least, [np.nan, (2.0 + 2 * 20.0) / 3, 20.0])
    figure = result.plot()
    (axes,) = panels(figure).values()
    marks = {line.get_marker(): line.get_xydata().tolist() for line in axes.lines if line.get_label() == "_mark"}
    assert marks == {"o": [[15.0, 2.0]], "^": [[15.0, pytest.approx(14.0)], [20.0, 20.0]]}
    assert {"mean of survivors only", "at least, of all walks"} <= set(legend_texts(figure))
    text = command("info", str(tmp_path / "slope")).out
    assert "2.0000*" in text and "14.0000" in text and "* mean of the walks that came to rest only" in text
    (block,) = json.loads(command("info", str(tmp_path / "slope"), "--json").out)["blocks"].values()
    assert block["dx"]["at_least"] == [None, 14.0, 20.0]
    write_report(tmp_path / "slope", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "2.0000*" in page and "mean of the walks that came to rest only" in page


@pytest.mark.parametrize(
    ("keys", "bound"),
    [
        ({"scene": {"distance_limit": 20.0}}, 14.0),
        ({"scene": {"distance_limit": 20.0, "floor": [[-1, 0], [0, 0], [0, -0.1], [1, -0.1]]}}, 14.0),
        ({"scene": {"distance_limit": 20.0, "floor": [[0, 0], [0.5, -0.1], [1, 0.2]]}}, math.nan),
        ({"scene": {"distance_limit": 20.0, "slope": -10}}, math.nan),
    ],
)
def test_a_bound_needs_a_floor_that_does_not_rise(tmp_path: Path, keys: dict[str, Any], bound: float) -> None:
    """Where a chain may slide back, how far it was says nothing of Δx; the mean is marked all the same."""
    content = sweep({"frequency": [10, 20]}, **keys)
    ended = make_sweep(tmp_path, content, lambda walk: Status.DISTANCE_LIMIT if walk.sample else 2.0)
    np.testing.assert_allclose(ended.statistics().at_least, [bound, bound])
    assert ended.statistics().of_survivors.all()
    assert np.isnan(ended.statistics("walk_time").at_least).all()


def test_a_figure_of_one_randomisation_says_that_it_has_no_errors(tmp_path: Path, command: Command) -> None:
    """Legend, table and page say why no bars are there; eight randomisations have bars."""
    for count, text in ((1, "one randomisation: no standard error"), (8, "± standard error")):
        content = sweep({"frequency": [5, 10, 15]}, sampler="sobol", samples=16, randomisations=count)
        result = make_sweep(tmp_path / str(count), content)
        assert text in legend_texts(result.plot()) and len(legend_texts(result.plot())) == 3
        told = command("info", str(tmp_path / str(count))).out
        assert ("gives no standard error; use randomisations: 8" in told) == (count == 1)
        assert result.to_xarray().randomisation.values.tolist() == [k % count for k in range(16)]
    merge(tmp_path / "8", tmp_path / "8.h5")
    np.testing.assert_array_equal(
        load(tmp_path / "8.h5").statistics().standard_error, result.statistics().standard_error
    )


@pytest.mark.parametrize("width", [60, 85, 120, 180])
def test_names_below_panels_on_paper_stay_apart(tmp_path: Path, width: float) -> None:
    """Long names of axes and notes are neither cut by the paper nor touch those of the next panel."""
    grid = {"links": [60, 120], "frequency": [10, 20], "floor_friction": [0.2, 0.3]}
    result = make_sweep(tmp_path, sweep(grid), flawed)
    for x in ("frequency", "floor_friction"):
        figure = result.plot(x=x, width=width)
        assert isinstance(figure, Figure)
        figure.draw_without_rendering()
        shown = [axes.xaxis.label for axes in panels(figure).values() if axes.get_xlabel()]
        boxes = [text.get_window_extent() for text in shown]
        assert all(figure.bbox.padded(1.0).contains(*corner) for box in boxes for corner in (box.min, box.max))
        assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


def test_the_title_says_how_many_walks_cells_have(tmp_path: Path) -> None:
    """Of a sweep that runs until its errors are reached these are the walks so far, not all that there might be."""
    asked = sweep({"frequency": [10, 20]}, samples=8, at_most=16, until=1e-6)
    result = make_sweep(tmp_path, asked, lambda walk: None if walk.index >= 21 else distance(walk))
    assert result.setting(["main"]).endswith("5–8 samples in each cell")
