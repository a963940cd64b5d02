"""Error against cost of steps in mixed and in double precision.

    python -m tests.support.precision_costs

It writes studies/accuracy/results/precision_costs.csv, and docs/figures/error_cost.png from it. A chain of 60 links
circulates in flight for a millisecond; errors are those beside SciPy's DOP853 at 1e-12 on the NumPy model, which takes
a minute. Cost is processor time of a flight ten times as long, and the number of attempted steps.
"""

import itertools
import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from studies.common import write_rows
from tests.oracle_model import motion_equations
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.inputs.options import LEAST_MIXED, Options
from warpchain.inputs.parameters import preset
from warpchain.pictures.style import INK, LEGEND, LINE_COLORS, MARKERS, save_figure, tidy
from warpchain.status import Status

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "studies" / "accuracy" / "results" / "precision_costs.csv"
FIGURE = ROOT / "docs" / "figures" / "error_cost.png"
LINKS, DURATION, LONGER, ROUNDS, PARAMETERS = 60, 1e-3, 10, 5, preset("paper")
METHODS, PRECISIONS = ("os32", "dp5", "bs32", "rkf78"), ("mixed", "double")
TOLERANCES = (1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)


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
        rows.append(row | {"seconds_per_second": seconds / (LONGER * DURATION)})
        print(*row.values(), f"{rows[-1]['seconds_per_second']:.3g} s of a processor per simulated second", flush=True)
    return rows


def draw() -> Figure:
    """Error against cost, from the file: a curve for each method and precision."""
    figure = Figure(figsize=(7, 4.4), layout="constrained")
    axes = figure.subplots()
    rows = pandas.read_csv(RESULTS, comment="#")
    for (method, precision), curve in rows.groupby(["method", "precision"], sort=False):
        number = METHODS.index(method)
        look: dict[str, Any] = {"color": LINE_COLORS[number], "marker": MARKERS[number], "markersize": 5}
        is_refused = (precision == "mixed") & (curve.tolerance < LEAST_MIXED)
        axes.plot(
            curve.seconds_per_second,
            curve.position_error,
            linestyle="-" if precision == "mixed" else "--",
            linewidth=1.2,
            **look,
            label=method if precision == "mixed" else None,
        )
        refused = curve[is_refused]
        axes.plot(
            refused.seconds_per_second, refused.position_error, linestyle="", zorder=3, **look, markerfacecolor="white"
        )
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("cost: processor seconds per simulated second")
    axes.set_ylabel("largest error of a position / m")
    tidy(axes, grid="both")
    styles = [
        Line2D([], [], color=INK, linestyle="-", label="mixed"),
        Line2D([], [], color=INK, linestyle="--", label="double"),
        Line2D([], [], color=INK, linestyle="", marker="o", markerfacecolor="white", label="mixed, refused"),
    ]
    axes.legend(handles=[*axes.get_legend_handles_labels()[0], *styles], loc="upper right", **LEGEND)
    return figure


if __name__ == "__main__":
    write_rows(RESULTS, flights())
    save_figure(draw(), FIGURE)
