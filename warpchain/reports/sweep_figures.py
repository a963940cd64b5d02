"""Figures of sweeps: the paper's Figure 6, grids, sensitivity.

Means and standard deviations are those of the walks that came to rest. The number of walks that failed, or have not
been run yet, is on the figure.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from warpchain.inputs.arrays import AnyArray, Array
from warpchain.inputs.starts import STARTS
from warpchain.pictures import labels
from warpchain.pictures.grid_figure import draw_grid
from warpchain.pictures.labels import cell_values, quantity_name, quantity_text
from warpchain.pictures.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    LEGEND,
    LINE_COLORS,
    RED,
    InlineFigure,
    NothingToShow,
    Picture,
    columns_on,
    head,
    mark_survivors,
    panel_grid,
    survivor_handles,
    text_scale,
    tidy,
)
from warpchain.results.block_result import BlockResult
from warpchain.results.sweep_result import SweepResult
from warpchain.sweeps.designs import SAMPLERS, sobol_indices
from warpchain.walks.rows import quantity_of

_LOOKS: Final = {"rest": (RED, "o"), "ellipse": (GREEN, "D"), "spinning": (BLUE, "s")}
"""How the chain started → colour and marker; of other starts the first among `_OTHERS` that are left."""
_OTHERS: Final = (*zip((BLUE, *LINE_COLORS[3:6]), "^vP*", strict=True), *[(INK, "X")] * 100)
"""Colour and marker of further blocks of the same start."""


def figures(result: SweepResult, quantity: str = "dx", width: float | None = None) -> Iterator[Picture]:
    """Every figure that the sweep has the walks for, the paper's Figure 6 first; of a width [inches] if that is given.

    What no special figure shows has one of its grid: one for all blocks that vary one quantity, and one for each set of
    several axes. A column other than ``dx`` has just these; an `InputError` says that there is none of that name.
    """
    statistics, shown = result.cell_statistics(quantity), set[str]()
    for draw in SWEEP_FIGURES if quantity == "dx" else ():
        with suppress(NothingToShow):
            picture = draw(result, width)
            shown |= picture.blocks
            yield picture
    groups: dict[frozenset[str], list[str]] = {}
    for name in statistics:
        varied = _varied(result.blocks[name])
        if varied and name not in shown:
            groups.setdefault(frozenset(varied if len(varied) > 1 else ()), []).append(name)
    for names in groups.values():
        with suppress(NothingToShow):
            cells = {name: result.blocks[name].named_sets(statistics[name]) for name in names}
            title = result.setting(names)
            figure = draw_grid(cells, quantity_of(quantity), title=title, width=width)
            assert isinstance(figure, Figure)
            axes = list(dict.fromkeys(axis for name in names for axis in _varied(result.blocks[name])))
            over, words = f"against_{'_and_'.join(axes)}", " and ".join(map(quantity_name, axes))
            if len(axes) > len(_varied(result.blocks[names[0]])):
                over, words = "responses", "the one quantity that a block varies"
            text = quantity_name(quantity_of(quantity))
            caption = f"{text[:1].upper()}{text[1:]} against {words}: means of the walks at rest."
            yield Picture(f"{'distance' if quantity == 'dx' else quantity}_{over}", caption, figure)


def _varied(block: BlockResult) -> list[str]:
    """The axes of a block that have several values."""
    return [name for name, values in block.axes.items() if len(values) > 1]


def _is_series(block: BlockResult) -> bool:
    """Whether Figure 6 can show a block: nothing but links, frequency and start varies in it."""
    few = len(block.axes.get("links", ())) <= 6  # each has a panel; beyond, a figure of the grid is clearer
    return few and set(_varied(block)) <= {"links", "frequency", "start"} and "frequency" not in block.drawn


def figure6(result: SweepResult, width: float | None = None) -> Picture:
    """Distance walked against frequency with a panel for each number of links, as in Figure 6.

    A dot is the mean, a box the range of one standard deviation, a bar the range of two. Walks that start at rest are
    red, ellipses green. Blocks with other axes than links, frequency and start are left out. `NothingToShow`: no walk
    of the other blocks has come to rest, or none of them has several cells.
    """
    # links → label of a series → frequency, mean, deviation, whether of survivors, bound; links → numbers of walks
    cells: dict[int, dict[str, list[tuple[float, ...]]]] = defaultdict(lambda: defaultdict(list))
    lost: dict[int, list[dict[str, int]]] = defaultdict(list)
    looks: dict[str, dict[str, Any]] = {}  # label of a series → its colour and marker
    for block, given in zip(result.blocks.values(), result.sweep["blocks"], strict=True):
        found, own = block.statistics("dx"), dict[str, str]()  # start → label
        for place in np.ndindex(*block.shape[:-1]) if _is_series(block) else ():
            of_point = {name: sets[0] for name, sets in block.block.points.items()}  # there is one set at most
            values = {**given["scene"], **of_point, **cell_values(block.axes, place)}
            if values["start"] not in own:
                label, further = STARTS[values["start"]].legend, _OTHERS[max(0, len(looks) - 1)]
                color, marker = _LOOKS.get(values["start"], further)
                if label in looks:  # of another block with this start
                    label, (color, marker) = f"{block.name}, {label}", further
                own[values["start"]], looks[label] = label, {"color": color, "marker": marker}
            numbers = found.mean, found.sd, found.of_survivors, found.at_least
            row = float(values["frequency"]), *(float(each[place]) for each in numbers)
            cells[values["links"]][own[values["start"]]].append(row)
            lost[values["links"]].append({name: getattr(found, name)[place] for name in labels.COUNTS})
    rows = np.array([row for series in cells.values() for each in series.values() for row in each]).reshape(-1, 5)
    frequencies = np.unique(rows[:, 0])
    if not np.isfinite(rows[:, 1]).any() or len(cells) == len(frequencies) == 1:
        raise NothingToShow(
            "Figure 6 needs walks at rest over links and frequency; use such a block, or finish the sweep"
        )
    gap = float(np.diff(frequencies).min()) if len(frequencies) > 1 else 1.0
    columns = columns_on(width, {1: 1, 2: 2, 4: 2}.get(len(cells), 3))
    size = width or max(4.2, 3.1 * columns), 1.25 + 2.6 * text_scale() * -(-len(cells) // columns)
    figure = InlineFigure(figsize=size, layout="constrained")
    used, empty = panel_grid(figure, len(cells), columns, sharex=True)
    for (links, series), axes in zip(sorted(cells.items()), used, strict=True):
        for number, (label, each) in enumerate(series.items()):
            # Boxes of several series stand side by side about their frequency.
            frequency, mean, sd, partial, at_least = np.array(each).T
            x = frequency + gap * (number - (len(series) - 1) / 2) * 0.7 / len(series)
            color, box = looks[label]["color"], gap * min(0.36, 0.6 / len(series))
            axes.vlines(x, mean - 2 * sd, mean + 2 * sd, color=color, linewidth=1.2)
            axes.bar(x, 2 * sd, box, mean - sd, color="white", zorder=2.1)
            axes.bar(x, 2 * sd, box, mean - sd, facecolor=(color, 0.2), edgecolor=color, zorder=2.2)
            axes.plot(x, mean, linestyle="", markersize=4.5, zorder=3, **looks[label])
            mark_survivors(axes, x, mean, partial > 0, at_least, color)
        axes.set_title(f"$n$ = {links}", fontsize="medium", loc="left")
        axes.set_xlabel(labels.lost_note(lost[links]), color=RED, fontsize="small")
        tidy(axes, grid="y")
    if len(frequencies) <= 8:
        used[0].set_xticks(frequencies, [f"{frequency:g}" for frequency in frequencies])
    used[0].set_xlim(frequencies[0] - 0.6 * gap, frequencies[-1] + 0.6 * gap)
    used[0].set_ylim(bottom=min(0.0, 1.05 * float(np.nanmin(rows[:, 1] - 2 * np.nan_to_num(rows[:, 2])))))
    title = head(figure, result.setting([*result.blocks]), bool(empty))
    figure.supxlabel(labels.quantity_label("frequency"), fontsize="medium")
    figure.supylabel(f"{quantity_text('dx')} / m", fontsize="medium")
    handles: list[Any] = [Line2D([], [], linestyle="", label=label, **look) for label, look in looks.items()]
    handles += [
        Patch(facecolor=(FAINT, 0.2), edgecolor=FAINT, label="± 1 standard deviation"),
        Line2D([], [], color=FAINT, linestyle="", marker="|", markersize=13, label="± 2 standard deviations"),
    ]
    handles += survivor_handles(bool((rows[:, 3] > 0).any()), bool(np.isfinite(rows[:, 4]).any()))
    if empty:
        empty[-1].legend(handles=handles, loc="center", frameon=False)
    else:
        columns = columns_on(width, 2)
        figure.legend(handles=handles, loc="outside upper right", ncols=columns, title=title, **LEGEND)
    caption = "Distance walked against the frequency of the sprocket, as in the paper's Figure 6: mean, box of one and "
    blocks = {each.name for each in result.blocks.values() if _is_series(each) and "frequency" in _varied(each)}
    return Picture("distance", caption + "bar of two standard deviations.", figure, frozenset(blocks))


CONFIDENCE: Final = 0.95
"""Confidence level of intervals."""


class Sensitivity(NamedTuple):
    """Sobol' indices of the distance in one cell, which a text describes, for d drawn quantities of some names.

    Indices are the share of the variance that each causes by itself, and together with others, (2, d); intervals are
    theirs, (2, d, 2), NaN of one randomisation. Samples have d + 2 walks each; lost are those that are not complete.
    """

    cell: str
    names: tuple[str, ...]
    indices: Array
    intervals: Array
    samples: int
    lost: int


def sensitivities(result: SweepResult) -> list[Sensitivity]:
    """Sobol' indices of the distance in each cell that was sampled by ``saltelli``.

    The intervals are Student's, from the jackknife over the randomisations, which are independent of one another.
    `NothingToShow`: no block is sampled so, or none has a cell with two complete samples yet.
    """
    crossed = [block for block in result.blocks.values() if SAMPLERS[block.block.sampler].crosses]
    if not crossed:
        raise NothingToShow("no block is sampled for Sobol indices; use sampler: saltelli")
    found = []
    for block in crossed:
        for place in np.ndindex(*block.shape[:-1]):
            walks = SAMPLERS[block.block.sampler].walks(len(block.drawn))  # of a sample
            whole = block.values("dx")[place].reshape(-1, walks)
            is_complete = np.isfinite(whole).all(axis=1)
            complete, groups = whole[is_complete], block.block.groups[::walks][is_complete]
            samples, indices = len(complete), np.array(sobol_indices(complete))
            if samples < 2 or not np.isfinite(indices).all():
                continue
            half = _half_interval(complete, groups)
            intervals = np.stack([indices - half, indices + half], axis=-1)
            cell = labels.cell_text(cell_values(block.axes, place))
            text = ": ".join([*[block.name] * (len(crossed) > 1), *[cell] * bool(cell)]) or block.name
            is_asked = (block.is_there | block.is_missing)[place]  # until a cell has its error
            lost = int(is_asked[::walks].sum()) - samples
            found.append(Sensitivity(text, block.drawn, indices, intervals, samples, lost))
    if not found:
        raise NothingToShow("no cell has two complete samples for Sobol indices yet; resume the sweep")
    return found


def _half_interval(samples: Array, groups: AnyArray) -> Array:
    """Half width of the intervals of `sobol_indices`, (2, d), by leaving out each group of samples in turn.

    The delete-a-group jackknife: B. Efron, C. Stein, Ann. Statist. 9 (1981) 586. Indices are no means, but smooth
    functions of means, of which it gives the error without the bias of few samples in each group.
    """
    from scipy.special import stdtrit

    present = np.unique(groups)
    count = len(present)
    if count < 2:
        return np.full((2, samples.shape[1] - 2), np.nan)
    without = np.array([sobol_indices(samples[groups != group]) for group in present])
    error = np.sqrt((count - 1) * np.mean((without - without.mean(axis=0)) ** 2, axis=0))
    return np.asarray(stdtrit(count - 1, 0.5 * (1 + CONFIDENCE)) * error)


def sensitivity(result: SweepResult, width: float | None = None) -> Picture:
    """Sobol' indices of the distance with a panel for each cell; errors as of `sensitivities`.

    All panels have the quantities in the same order, by the mean of their total indices, the greatest at the top.
    """
    cells = sensitivities(result)
    totals: dict[str, list[float]] = {}
    for cell in cells:
        for name, total in zip(cell.names, cell.indices[1].tolist(), strict=True):
            totals.setdefault(name, []).append(total)
    names = sorted(totals, key=lambda name: -float(np.mean(totals[name])))
    columns = columns_on(width, min(len(cells), 3))
    size = width or max(4.2, 2.4 + 3.2 * columns), 0.9 + (0.6 + 0.36 * len(names)) * -(-len(cells) // columns)
    figure = InlineFigure(figsize=size, layout="constrained")
    used, _ = panel_grid(figure, len(cells), columns, sharex=True)
    for axes, cell in zip(used, cells, strict=True):
        places = np.array([names.index(name) for name in cell.names])
        for order, shift, color, label in ((1, -0.2, BLUE, "total"), (0, 0.2, LINE_COLORS[5], "first order")):
            axes.barh(places + shift, cell.indices[order], height=0.38, color=color, label=label)
            axes.hlines(places + shift, *cell.intervals[order].T, color=INK, linewidth=1.2)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_title(cell.cell, fontsize="medium", loc="left")
        if cell.lost:
            note = f"{cell.lost} of {cell.samples + cell.lost} samples are not complete"
            axes.set_xlabel(note, color=RED, fontsize="small")
        tidy(axes, grid="x")
    used[0].set_yticks(range(len(names)), [quantity_text(name) for name in names])
    used[0].set_ylim(len(names) - 0.4, -0.6)
    have = any(np.isfinite(cell.intervals).any() for cell in cells)
    errors = f"with {CONFIDENCE:.0%} intervals" if have else "without intervals: one randomisation"
    figure.supxlabel(f"share of the variance of $Δx$, {errors}", fontsize="medium")
    figure.legend(*used[0].get_legend_handles_labels(), loc="outside upper right", frameon=False, ncols=2)
    caption = (
        "Sobol indices: the share of the variance of the distance walked that a quantity causes by itself (first "
        f"order) and takes part in (total); lines are {CONFIDENCE:.0%} intervals, from the spread between independent "
        "randomisations. Walks are chaotic: "
        "changing anything a little scatters them, which all total indices contain alike. "
        f"Samples: {', '.join(f'{cell.samples}' for cell in cells)}."
    )
    return Picture("sensitivity", caption, figure)


SWEEP_FIGURES: Final[tuple[Callable[[SweepResult, float | None], Picture], ...]] = (figure6, sensitivity)
"""Figures of the distance walked beside those of the grid: each draws what it can, or raises `NothingToShow`."""
