"""Error against cost of steps in mixed and in double precision.

    python -m tests.support.precision_costs

It writes studies/accuracy/results/precision_costs.csv, and docs/figures/error_cost.png from it. A chain of 60 links
circulates in flight for a millisecond; errors are those beside SciPy's DOP853 at 1e-12 on the NumPy model, which takes
a minute. Cost is that of a flight ten times as long: attempted steps, times the processor time of one.
"""

import itertools
import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure

from studies.common import write_rows
from tests.oracle_model import motion_equations
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.inputs.options import LEAST_MIXED, Options
from warpchain.inputs.parameters import preset
from warpchain.pictures.style import FAINT, LEGEND, LINE_COLORS, MARKERS, tidy
from warpchain.status import Status

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "studies" / "accuracy" / "results" / "precision_costs.csv"
FIGURE = ROOT / "docs" / "figures" / "error_cost.png"
LINKS, DURATION, LONGER, ROUNDS, PARAMETERS = 60, 1e-3, 10, 5, preset("paper")
METHODS, PRECISIONS = ("os32", "dp5", "bs32"), ("mixed", "double")
TOLERANCES = (1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
COSTS = (0.3, 0.5, 1, 2, 4)
"""Ticks of the figure."""


def flights() -> list[dict[str, Any]]:
    """Errors and costs of each method, precision and tolerance; also where mixed precision is refused to users."""
    start = lay_chain(ellipse(1.5), LINKS, PARAMETERS.link_length, 5.0, 0.1)
    position, velocity = motion_equations.solve_flight(*start, DURATION, PARAMETERS)
    rows = []
    for method, precision, tolerance in itertools.product(METHODS, PRECISIONS, TOLERANCES):
        options = {"method": method, "tolerance": tolerance, "precision": "double", "controller": "pi"}
        batch = Batch(1, LINKS, Options(self_contact=False, **options))
        world = batch.worlds[0]
        world.set_chain(PARAMETERS, LINKS)
        features = batch.features(fixed_body="none", is_mixed=precision == "mixed")

        def fly(duration: float, batch: Batch = batch, features: object = features) -> float:
            batch.worlds[0].load(*start, stop_time=duration, stop_status=Status.FINISHED)
            began = time.process_time()
            batch.run([0], features)
            return time.process_time() - began

        fly(DURATION / 10)  # compiles
        fly(DURATION)
        row = {"method": method, "precision": precision, "tolerance": tolerance}
        row["attempts"] = world.counts["accepted"] + world.counts["rejected"]
        row["position_error"] = np.abs(world.position - position).max()
        row["velocity_error"] = np.abs(world.velocity - velocity).max()
        seconds = statistics.median(fly(LONGER * DURATION) for _ in range(ROUNDS))
        attempts = world.counts["accepted"] + world.counts["rejected"]
        row["attempts_per_second"], row["microseconds"] = attempts / (LONGER * DURATION), 1e6 * seconds / attempts
        rows.append(row)
        print(*(f"{value:.2g}" if isinstance(value, float) else value for value in row.values()), flush=True)
    return rows


def draw() -> Figure:
    """Error against cost, from the file: a curve for each method and precision, whose steps all take equally long."""
    figure = Figure(figsize=(7, 4.4), layout="constrained")
    axes = figure.subplots()
    for (method, precision), curve in pandas.read_csv(RESULTS, comment="#").groupby(
        ["method", "precision"], sort=False
    ):
        number, is_mixed = METHODS.index(method), precision == "mixed"
        cost = 1e-6 * curve.microseconds.min() * curve.attempts_per_second  # the least disturbed
        look: dict[str, Any] = {"color": LINE_COLORS[number], "marker": MARKERS[number], "markersize": 5}
        axes.plot(
            cost, curve.position_error, "-" if is_mixed else "--", **look, linewidth=1.2, label=f"{method}, {precision}"
        )
        refused = curve.tolerance < LEAST_MIXED
        if is_mixed:
            axes.plot(cost[refused], curve.position_error[refused], **look, linestyle="", markerfacecolor="white")
    axes.plot([], [], "o", color=FAINT, markersize=5, markerfacecolor="white", label="mixed, refused")
    axes.set(xscale="log", yscale="log", xlabel="cost / processor seconds per simulated second")
    axes.set_xticks(COSTS, [f"{cost:g}" for cost in COSTS])
    axes.set_xticks([], minor=True)
    axes.set_ylabel("largest error of a position / m")
    axes.legend(**LEGEND)
    tidy(axes, grid="both")
    return figure


if __name__ == "__main__":
    write_rows(RESULTS, flights())
    draw().savefig(FIGURE, dpi=150)
