"""Figures of ``warpchain bench accuracy``: work–precision diagrams, ensembles by method, the table of hard cases."""

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from warpchain.kernels.methods.method import method_names
from warpchain.pictures.style import DASHES, FAINT, GROUND, INK, LINE_COLORS, Picture, tidy
from warpchain.status import Status

Row = dict[str, Any]

_DASHED: Final[dict[str, Any]] = {"color": FAINT, "linewidth": 0.9, "linestyle": DASHES}
_SCIPY: Final = {"DOP853 (SciPy)": "s", "Radau (SciPy)": "^"}
"""Solvers of SciPy, all in black, and their markers."""
_COLORS: Final = {
    **dict(zip(method_names(), itertools.cycle((*LINE_COLORS[:-1], FAINT)), strict=False)),
    **dict.fromkeys(_SCIPY, LINE_COLORS[-1]),
}
"""Colour of each method in every figure."""
_MARKERS: Final = dict(zip(method_names(), itertools.cycle("osDvP*Xp"), strict=False)) | _SCIPY

_TITLES: Final = {
    "flight": "Free flight: a circulating ellipse, thrown",
    "impact": "Impact: a circulating ellipse hits the floor at 2 m/s",
    "sprocket": "One turn of the sprocket at 15 Hz",
}
_ERRORS: Final = {
    "flight": {"position_error": "error of positions / m", "velocity_error": "error of velocities / (m/s)"},
    "impact": {"position_error": "error of positions / m", "momentum_error": "relative error of the impulse"},
    "sprocket": {"position_error": "error of positions / m", "momentum_error": "rel. error of angular momentum"},
}
"""Errors that are drawn; single links' velocities after contacts depend on the steps and do not converge."""
_ON_FIGURE: Final = {
    "impact": "velocities of single links after impacts depend on the steps and are not drawn: the impulse converges",
    "sprocket": "velocities of single links depend on the steps and are not drawn: the angular momentum converges",
}
_NOTES: Final = {
    "impact": " Over {starts} impacts of {milliseconds:g} ms that differ in where the links are: greatest error of a "
    "position, rms error of the floor's impulse. Contacts are looked for after each step, so it is the length of "
    "the steps near the floor, more than the tolerance, that sets these errors; velocities of single links just after "
    "an impact depend on the steps and do not converge.",
    "sprocket": " Links rattle on the sprocket's surface: their velocities depend on the steps and do not converge; "
    "positions and the angular momentum about the sprocket's centre do.",
}


def figures(document: dict[str, Any]) -> Iterator[Picture]:
    """Every figure that the document has something for."""
    for true in document["references"]:
        rows = [row for row in document["points"] if (row["problem"], row["links"]) == (true["problem"], true["links"])]
        note = _NOTES.get(true["problem"], "").format(starts=true["starts"], milliseconds=1e3 * true["duration"])
        caption = (
            f"{_TITLES[true['problem']]}, {true['links']} links, {1e3 * true['duration']:.3g} ms at Table 1's values: "
            "greatest error over the links against rkf78 at 1e-12, by processor time and by evaluations of the "
            "chain's equations (without an implicit method's Jacobians and linear systems). "
            "Small numbers are decimal exponents of the tolerance. The dashed line is how "
            f"far dp5 at 1e-11 is from that reference: nothing below it is certain.{note}"
        )
        yield Picture(f"work_precision_{true['problem']}_{true['links']}", caption, work_precision(true, rows))
    if document["reversals"]:
        caption = (
            "Flights of 1 ms in which joints reverse, 40 links: greatest error of a link's angular velocity, median of "
            "8 starts, by the tolerance asked for. Struck: a turning loop just after it hit the floor. Reversing: one "
            "whose links turn at different speeds. At Table 1's ω_c, 0.001 rad/s, joints reverse within a fraction of "
            "a step, which Fehlberg's error estimate does not see. The dashed line is how far two references are "
            "apart: nothing below it is certain. Along the thin line the error falls as the tolerance."
        )
        yield Picture("reversals", caption, reversals(document["reversals"]))
    for links in dict.fromkeys(row["links"] for row in document["walks"]):
        rows = [row for row in document["walks"] if row["links"] == links]
        caption = (
            f"Walks of {links} links at Table 1's values, started as an ellipse: processor time of one core from the "
            "release to rest, single walks (dots) and their median (bar), how many times less than rkf78 at 1e-6 "
            "takes in the same run, and what the energy ledger leaves open, of the energy at release (median)."
        )
        yield Picture(f"walks_{links}", caption, walk_costs(rows))
    for row in document["ensembles"]:
        caption = (
            f"Δx of {row['title']}, by method and tolerance: single walks (dots), mean with its 95 % bootstrap "
            "interval (bar) and one standard deviation (box), the mean of rkf78 at 1e-6 with its interval (shaded) and "
            "± 1 % (dotted); beside it what a walk costs."
        )
        yield Picture(f"ensemble_{row['name']}", caption, ensemble(row))
    if document["hard_cases"]:
        caption = (
            "Hard cases by method: seconds of one core, and what the energy ledger leaves open as a fraction of the "
            "energy; the status where it is neither at rest nor finished. Blue: status, result and energy are such as "
            "the case may have."
        )
        yield Picture("hard_cases", caption, hard_cases(document["hard_cases"]))


def work_precision(true: Row, rows: Sequence[Row]) -> Figure:
    """Two errors of a problem against wall time and against evaluations, a line for each method.

    Args:
        true: row of the reference.
        rows: points of the same problem and number of links.
    """
    shown = _ERRORS[true["problem"]]
    chosen = list(dict.fromkeys(row["method"] for row in rows))
    figure = Figure(figsize=(9.0, 6.2), layout="constrained")
    grid = figure.subplots(2, 2, sharex="col", sharey="row")
    for line, (error, label) in enumerate(shown.items()):
        for axes, cost in zip(grid[line], ("seconds", "evaluations"), strict=True):
            for method in chosen:
                drawn = [
                    (row[cost] / row["simulated"], row[error], row["tolerance"])
                    for row in sorted(rows, key=lambda row: -row["tolerance"])
                    if row["method"] == method and row[cost] is not None and row[error]
                ]
                if drawn:
                    _draw_line(axes, np.array(drawn), method)
            if true[error]:
                axes.axhline(true[error], zorder=0.4, **_DASHED)
            axes.set_xscale("log")
            axes.set_yscale("log")
            for axis in (axes.xaxis, axes.yaxis):
                _thin_out(axis)
            tidy(axes, grid="both")
        grid[line, 0].set_ylabel(label)
    grid[1, 0].set_xlabel("seconds of one core per simulated second")
    grid[1, 1].set_xlabel("evaluations per simulated second")
    handles = [
        Line2D([], [], color=_COLORS[method], marker=_MARKERS[method], markersize=4.5, label=method)
        for method in chosen
    ]
    handles.append(Line2D([], [], label="references\ndiffer by this", **_DASHED))
    figure.legend(handles=handles, loc="outside right center", frameon=False)
    if true["problem"] in _ON_FIGURE:
        figure.supxlabel(_ON_FIGURE[true["problem"]], fontsize="small", color=FAINT)
    figure.suptitle(f"{_TITLES[true['problem']]}, $n$ = {true['links']}", fontsize="medium", x=0.01, ha="left")
    return figure


def reversals(rows: Sequence[Row]) -> Figure:
    """Error against tolerance: a row of diagrams for each start, a column for each ω_c, a line for each method."""
    starts, smoothings, chosen = (
        list(dict.fromkeys(row[key] for row in rows)) for key in ("start", "friction_smoothing", "method")
    )
    figure = Figure(figsize=(9.0, 1.2 + 2.6 * len(starts)), layout="constrained")
    grid = figure.subplots(len(starts), len(smoothings), sharex=True, sharey=True, squeeze=False)
    for axes, (start, smoothing) in zip(grid.flat, itertools.product(starts, smoothings), strict=True):
        here = [row for row in rows if (row["start"], row["friction_smoothing"]) == (start, smoothing)]
        for method in chosen:
            points = sorted((row["tolerance"], row["error"]) for row in here if row["method"] == method)
            if points:
                axes.plot(*zip(*points, strict=True), color=_COLORS[method], marker=_MARKERS[method], markersize=4.5)
        if here:
            axes.axhline(here[0]["trust"], zorder=0.4, **_DASHED)
            tolerances = np.array([min(row["tolerance"] for row in here), max(row["tolerance"] for row in here)])
            axes.plot(tolerances, 100 * tolerances, color=FAINT, linewidth=0.6, zorder=0.4)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(1e-10, 1e-2)
        tidy(axes, grid="both")
        axes.set_title(f"{start}, $ω_c$ = {smoothing:g} rad/s", fontsize="medium", loc="left")
    grid[0, 0].invert_xaxis()
    for axes in grid[:, 0]:
        axes.set_ylabel("error of $ω$ / (rad/s)")
    for axes in grid[-1]:
        axes.set_xlabel("tolerance")
    handles = [
        Line2D([], [], color=_COLORS[method], marker=_MARKERS[method], markersize=4.5, label=method)
        for method in chosen
    ]
    handles.append(Line2D([], [], label="references\ndiffer by this", **_DASHED))
    handles.append(Line2D([], [], color=FAINT, linewidth=0.6, label="error ∝ tolerance"))
    figure.legend(handles=handles, loc="outside right center", frameon=False)
    return figure


def walk_costs(rows: Sequence[Row]) -> Figure:
    """Cost of single walks of one number of links by method, and how their ledgers close."""
    figure = Figure(figsize=(9.0, 1.4 + 0.42 * len(rows)), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(2.0, 1.0), sharey=True)
    ordered = sorted(rows, key=lambda row: -math.inf if row["seconds"] is None else -row["seconds"])
    for place, row in enumerate(ordered):
        color = _COLORS[row["method"]]
        left.plot(row["each"], [place] * len(row["each"]), "o", color=(color, 0.45), markersize=5, markeredgewidth=0)
        if row["seconds"] is not None:
            left.plot([row["seconds"]], [place], "|", color=INK, markersize=14, markeredgewidth=1.6, zorder=5)
            times = f"{row['seconds']:.2g} s" + (
                f", {row['reference_seconds'] / row['seconds']:.2g}×" if row["reference_seconds"] else ""
            )
            left.annotate(times, (max(row["each"]), place), (8, 0), textcoords="offset points", va="center", color=INK)
        if row["ledger"]:
            right.plot([row["ledger"]], [place], "o", color=color, markersize=6)
    left.set_yticks(range(len(ordered)), _setting_texts(figure, ordered))
    left.set_ylim(len(ordered) - 0.4, -0.6)
    for axes in (left, right):
        axes.set_xscale("log")
        tidy(axes, grid="x")
        _thin_out(axes.xaxis)
    left.set_xlim(right=3.5 * left.get_xlim()[1])
    right.tick_params(left=False)
    left.set_xlabel("seconds of one core from the release to rest")
    right.set_xlabel("error of the energy ledger")
    first = rows[0]
    title = f"{first['links']} links, {first['frequency']:g} Hz, {first['preset']}, ellipse"
    left.set_title(title, fontsize="medium", loc="left")
    return figure


def ensemble(row: Row) -> Figure:
    """Distances of one ensemble by method and tolerance, and the cost of a walk."""
    rows = row["methods"]
    figure = Figure(figsize=(9.0, 1.7 + 0.5 * len(rows)), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(2.4, 1.0), sharey=True)
    true = rows[0]
    if None not in true["mean_interval"]:
        left.axvspan(*true["mean_interval"], color=GROUND, zorder=0)
    if true["mean"] is not None:
        for factor in (0.99, 1.01):
            left.axvline(factor * true["mean"], color=FAINT, linewidth=0.9, linestyle=(0, (1, 2)), zorder=0.4)
    on_gpu = row["device"].startswith("cuda")
    cost = "walks_per_second" if on_gpu else "seconds_per_walk"
    for place, one in enumerate(rows):
        color = _COLORS[one["method"]]
        spread = np.random.default_rng(place).uniform(-0.3, 0.3, len(one["dx"]))
        left.plot(one["dx"], place + spread, ".", color=(color, 0.35), markersize=3.5, markeredgewidth=0, zorder=2)
        if one["sd"] is not None:
            corner = one["mean"] - one["sd"], place - 0.2
            left.add_patch(Rectangle(corner, 2 * one["sd"], 0.4, facecolor=(color, 0.15), edgecolor=color, zorder=3))
        if None not in one["mean_interval"]:
            left.plot(one["mean_interval"], [place] * 2, color=color, linewidth=5, solid_capstyle="butt", zorder=4)
        if one["mean"] is not None:
            left.plot([one["mean"]], [place], "|", color=INK, markersize=12, zorder=5)
        if one[cost] is not None:
            right.barh(place, one[cost], 0.5, color=color)
            right.text(one[cost], place, f" {one[cost]:.3g}", va="center", color=INK)
    left.set_yticks(range(len(rows)), _setting_texts(figure, rows))
    left.set_ylim(len(rows) - 0.4, -0.6)
    left.set_xlabel("distance walked $Δx$ / m")
    right.set_xlabel("walks per second" if on_gpu else "seconds of one core per walk")
    right.set_xlim(0, 1.25 * max([one[cost] for one in rows if one[cost] is not None], default=1.0))
    left.set_title(row["title"], fontsize="medium", loc="left")
    tidy(left, grid="x")
    tidy(right)
    return figure


def hard_cases(rows: Sequence[Row]) -> Figure:
    """Cases by methods: colour says whether the outcome is sound, numbers what it cost and how the energy closes."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    chosen = list(dict.fromkeys(row["method"] for row in rows))
    figure = Figure(figsize=(3.4 + 1.75 * len(chosen), 1.3 + 0.34 * len(cases)), layout="constrained")
    axes = figure.subplots()
    for row in rows:
        x, y = chosen.index(row["method"]), cases.index(row["case"])
        color = LINE_COLORS[0] if row["sound"] else LINE_COLORS[1]
        axes.add_patch(Rectangle((x - 0.48, y - 0.45), 0.96, 0.9, facecolor=(color, 0.25), edgecolor=color))
        numbers = [f"{row['seconds']:.2g} s"] * (row["attempts"] > 0)
        numbers += [] if row["energy_error"] is None else [f"{row['energy_error']:.0e}"]
        expected = row["sound"] and numbers and row["status"] in (Status.AT_REST.label, Status.FINISHED.label)
        text = "   ".join([*([] if expected else [row["status"].replace("_", " ")]), *numbers])
        axes.text(x, y, text, ha="center", va="center", color=INK, fontsize="small")
    axes.set_xlim(-0.55, len(chosen) - 0.45)
    axes.set_ylim(len(cases) - 0.4, -0.6)
    axes.set_xticks(range(len(chosen)), chosen)
    axes.set_yticks(range(len(cases)), [case.replace("-", " ") for case in cases])
    axes.xaxis.tick_top()
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    handles = [
        Patch(facecolor=(color, 0.25), edgecolor=color, label=label)
        for color, label in zip(LINE_COLORS[:2], ("sound", "not sound"), strict=True)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _thin_out(axis: Axis) -> None:
    """Number 1, 2 and 5 of each decade of a short logarithmic axis, every decade or second one of a long one."""
    lower, upper = axis.get_view_interval()
    decades = math.log10(upper / lower)
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2 else (1.0,), numticks=8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _decimal(value)))
    axis.set_minor_formatter(NullFormatter())


def _decimal(value: float) -> str:
    """A number with one digit that matters, such as 0.05 or 5·10⁻⁶."""
    if 0.01 <= value < 1e4:
        return f"{value:g}"
    digit, exponent = f"{value:.0e}".split("e")
    return f"$10^{{{int(exponent)}}}$" if digit == "1" else f"${digit}\\cdot 10^{{{int(exponent)}}}$"


def _draw_line(axes: Axes, drawn: Any, method: str) -> None:
    """One method: cost, error and tolerance in rows (p, 3); the first and the last tolerance are written beside it."""
    color = _COLORS[method]
    axes.plot(drawn[:, 0], drawn[:, 1], color=color, marker=_MARKERS[method], markersize=4.5, linewidth=1.3, zorder=3)
    for cost, error, tolerance in {tuple(drawn[0]), tuple(drawn[-1])}:
        text = f"{math.log10(tolerance):.3g}".replace("-", "−")
        beside: dict[str, Any] = {"xytext": (4, 3), "textcoords": "offset points", "fontsize": "x-small", "zorder": 4}
        axes.annotate(text, (cost, error), color=color, **beside)


def _setting_texts(figure: Figure, rows: Sequence[Row]) -> list[str]:
    """Title of each method_setting, its settings in a line of their own, and how many of its walks are not drawn.

    The most common settings are written below the figure, and a star stands for them.
    """
    split = [row["title"].partition(", ") for row in rows]
    counts = Counter(settings for _, _, settings in split if settings)
    common = max(counts, key=counts.__getitem__, default="")
    if common:
        figure.supxlabel(f"* with {common}", fontsize="small", x=0.01, ha="left")
    texts = []
    for row, (method, _, settings) in zip(rows, split, strict=True):
        failed = sum(row["failed"].values()) if "failed" in row else row["walks"] - row["at_rest"]
        missing = row.get("missing", 0)
        notes = [settings] * (settings not in ("", common))
        notes += [f"{failed} failed"] * (failed > 0) + [f"{missing} missing"] * (missing > 0)
        texts.append("\n".join([method + " *" * (settings == common != ""), *notes]))
    return texts
