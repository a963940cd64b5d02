"""Figures of a distance against a third quantity."""

from pathlib import Path
from typing import Any

import numpy as np

from tests.support.made_sweeps import distance, make_sweep
from warpchain.reports.panels import panels, third_axis, third_quantities
from warpchain.reports.sweep_figures import figures
from warpchain.status import Status
from warpchain.sweeps.plan import PlannedWalk

GRID: dict[str, Any] = {"links": [60, 120], "frequency": [10, 20, 30], "floor_friction": [0.1, 0.2, 0.4, 0.6]}
SWEEP: dict[str, Any] = {
    "version": 1,
    "name": "panels",
    "seed": 1,
    "preset": "soft",
    "samples": 3,
    "distributions": {"floor_friction": "fixed"},
    "blocks": [
        {"name": "rest", "grid": GRID},
        {"name": "spinning", "scene": {"start": "spinning"}, "grid": GRID},
        {"name": "others", "grid": {"links": [60], "frequency": [10, 20]}},
    ],
}


def test_a_panel_for_each_frequency_and_a_line_for_each_number_of_links_and_block(tmp_path: Path) -> None:
    """Lines pass through the means of the cells; blocks with other axes are left out."""
    result = make_sweep(tmp_path, SWEEP)
    assert third_quantities(result) == ["floor_friction"]
    figure = panels(result, "floor_friction").figure
    assert figure.get_supxlabel() == "floor friction $μ_\\mathrm{fc}$"
    assert [axes.get_title(loc="left") for axes in figure.axes] == [f"$ν$ = {f} Hz" for f in (10, 20, 30)]
    means = result.blocks["rest"].statistics().mean
    for column, axes in enumerate(figure.axes):
        lines = [container[0] for container in axes.containers]
        assert len(lines) == 4
        for row, line in enumerate(lines[:2]):
            np.testing.assert_array_equal(line.get_xdata(), GRID["floor_friction"])
            np.testing.assert_array_equal(line.get_ydata(), means[row, column])
        assert [line.get_linestyle() for line in lines] == ["-", "-", "--", "--"]
    assert "against_floor_friction" in [picture.name for picture in figures(result)]


def test_lost_walks_are_counted_on_panels(tmp_path: Path) -> None:
    """Walks that failed are not in a mean, and the figure says how many they are."""

    def flawed(walk: PlannedWalk) -> float | Status:
        return Status.TIME_LIMIT if walk.index == 0 else distance(walk)

    figure = panels(make_sweep(tmp_path, SWEEP, flawed), "floor_friction").figure
    assert "1 of 144 walks failed" in figure.get_supxlabel()


def test_what_is_no_third_quantity(tmp_path: Path) -> None:
    """Names, tolerances, which have a figure of their own, and a fourth axis make no panels."""
    grids = (
        {"links": [60, 120], "frequency": [10, 20], "start": ["rest", "spinning"]},
        {"links": [60, 120], "frequency": [10, 20], "tolerance": [1e-6, 1e-9]},
        {"links": [60], "frequency": [10], "floor_friction": [0.1, 0.2], "gravity": [9, 10]},
        {"links": [60, 90], "floor_friction": [0.1, 0.2]},
    )
    blocks = [{"name": f"b{number}", "grid": grid} for number, grid in enumerate(grids)]
    result = make_sweep(tmp_path, SWEEP | {"blocks": blocks, "distributions": {"all": "fixed", "phase": "table"}})
    assert [third_axis(block) for block in result.blocks.values()] == [None] * 4
    assert third_quantities(result) == []
