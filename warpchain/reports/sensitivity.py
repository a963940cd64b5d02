"""Sobol' indices of the distance, and their figure."""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from warpchain.inputs.arrays import Array
from warpchain.inputs.distributions import random_generator
from warpchain.pictures.labels import cell_text, cell_values, quantity_text
from warpchain.pictures.style import BLUE, INK, LINE_COLORS, RED, NothingToShow, Picture, panel_grid, tidy
from warpchain.status import Status
from warpchain.store.block_result import BlockResult
from warpchain.store.sweep_result import SweepResult
from warpchain.sweeps.designs import sobol_indices, walks_per_sample

CONFIDENCE: Final = 0.95
"""Confidence level of bootstrap intervals."""
_RESAMPLES: Final = 1000


class Sensitivity(NamedTuple):
    """Sobol' indices of the distance in one cell, which a text describes, for d drawn quantities of some names.

    Indices are the share of the variance that each causes by itself, and together with others, (2, d); intervals are
    bootstrap intervals of these, (2, d, 2). Samples have d + 2 walks each; lost are those that are not complete.
    """

    cell: str
    names: tuple[str, ...]
    indices: Array
    intervals: Array
    samples: int
    lost: int


def sensitivities(result: SweepResult) -> list[Sensitivity]:
    """Sobol' indices of the distance in each cell that was sampled by ``saltelli``.

    The intervals are percentiles of 1000 bootstrap resamples of the samples, from a fixed stream of random numbers.
    `NothingToShow`: no block is sampled so, or none has a cell with two complete samples yet.
    """
    named = [given["name"] for given in result.sweep["blocks"] if given["sampler"] == "saltelli"]
    if not named:
        raise NothingToShow("no block is sampled for Sobol indices; give sampler: saltelli")
    found = [cell for name in named for cell in _sensitivities(result.blocks[name], name if len(named) > 1 else "")]
    if not found:
        raise NothingToShow("no cell has two complete samples for Sobol indices yet; let the sweep go on")
    return found


def _sensitivities(block: BlockResult, name: str) -> Iterator[Sensitivity]:
    """The cells of a block, named so, that have two complete samples of different distances."""
    for place in np.ndindex(*block.shape[:-1]):
        rested = block.columns["status"][place] == Status.AT_REST
        walks = np.where(rested, block.columns["dx"][place], np.nan)
        whole = walks.reshape(-1, walks_per_sample("saltelli", len(block.drawn)))
        complete = whole[np.isfinite(whole).all(axis=1)]
        samples, indices = len(complete), np.array(sobol_indices(complete))
        if samples < 2 or not np.isfinite(indices).all():
            continue
        rng = random_generator(0)
        draws = (rng.integers(0, samples, samples) for _ in range(_RESAMPLES))
        resampled = [sobol_indices(complete[draw]) for draw in draws]
        # The indices are NaN for a resample without variance, which repeats a single sample.
        intervals = np.nanpercentile(resampled, (50 * (1 - CONFIDENCE), 50 * (1 + CONFIDENCE)), axis=0)
        cell = cell_text(cell_values(block.axes, place))
        yield Sensitivity(
            cell=": ".join(filter(None, (name, cell))) or block.name,
            names=block.drawn,
            indices=indices,
            intervals=intervals.transpose(1, 2, 0),
            samples=samples,
            lost=len(whole) - samples,
        )


def sensitivity(result: SweepResult) -> Picture:
    """Sobol' indices of the distance with a panel for each cell; errors as of `sensitivities`.

    All panels have the quantities in the same order, by the mean of their total indices, the greatest at the top.
    """
    cells = sensitivities(result)
    totals: dict[str, list[float]] = {}
    for cell in cells:
        for name, total in zip(cell.names, cell.indices[1].tolist(), strict=True):
            totals.setdefault(name, []).append(total)
    names = sorted(totals, key=lambda name: -float(np.mean(totals[name])))
    columns = min(len(cells), 3)
    size = max(4.2, 2.4 + 3.2 * columns), 0.9 + (0.6 + 0.36 * len(names)) * -(-len(cells) // columns)
    figure = Figure(figsize=size, layout="constrained")
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
    figure.supxlabel(f"share of the variance of $Δx$, with {CONFIDENCE:.0%} intervals", fontsize="medium")
    figure.legend(*used[0].get_legend_handles_labels(), loc="outside upper right", frameon=False, ncols=2)
    caption = (
        "Sobol indices: the share of the variance of the distance walked that a quantity causes by itself (first "
        f"order) and takes part in (total); lines are {CONFIDENCE:.0%} bootstrap intervals. Walks are chaotic: "
        "changing anything a little scatters them, which all total indices contain alike. "
        f"Samples: {', '.join(f'{cell.samples}' for cell in cells)}."
    )
    return Picture("sensitivity", caption, figure)
