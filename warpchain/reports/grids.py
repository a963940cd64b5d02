"""Figures of a quantity over the grids of a sweep: whatever varies, and has no figure of its own."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from warpchain.pictures.grid_figure import draw_grid
from warpchain.pictures.labels import quantity_name
from warpchain.pictures.style import NothingToShow, Picture
from warpchain.reports.statistics import tolerance_agreement
from warpchain.store.block_result import BlockResult
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.rows import quantity_of

_SERIES = {"links", "frequency", "start"}
"""What may vary in blocks that Figure 6 and maps show."""


def grid_pictures(result: SweepResult, quantity: str = "dx") -> Iterator[Callable[[SweepResult], Picture]]:
    """What draws the figures: one for all blocks that vary one quantity, one for each set of several axes.

    Of the distance there are none of blocks that other figures show: Figure 6, tolerances.

    Raises:
        InputError: there is no such column.
    """
    compared = False
    with suppress(NothingToShow):
        compared = bool(tolerance_agreement(result).cells)
    groups: dict[frozenset[str], list[str]] = {}
    for name in result.cell_statistics(quantity):
        block = result.blocks[name]
        varied = several(block)
        if varied and not (quantity == "dx" and _has_own_figure(block, compared=compared)):
            groups.setdefault(frozenset(varied) if len(varied) > 1 else frozenset(), []).append(name)
    for names in groups.values():
        yield partial(grid_picture, quantity=quantity, blocks=names)


def grid_picture(result: SweepResult, quantity: str, blocks: list[str]) -> Picture:
    """A quantity over the axes of some blocks.

    Raises:
        InputError: there is no such column.
        NothingToShow: no walk at rest has the quantity in them.
    """
    statistics = result.cell_statistics(quantity)
    varied = [name for name in result.blocks[blocks[0]].axes if name in several(result.blocks[blocks[0]])]
    figure = draw_grid({name: statistics[name] for name in blocks}, quantity_of(quantity))
    assert isinstance(figure, Figure)
    *words, last = map(quantity_name, varied)
    name, over = "against_" + "_and_".join(varied), f"{', '.join(words)} and {last}"
    if len(varied) == 1:
        name, over = "responses", "the one quantity that a block varies"
    third = [each for each in varied if each not in ("links", "frequency")]
    if len(varied) == 3 and len(third) == 1 and result.blocks[blocks[0]].axes[third[0]].dtype.kind in "if":
        name, over = f"against_{third[0]}", f"{quantity_name(third[0])}, by links and frequency"
    text = quantity_name(quantity_of(quantity))
    those = "" if quantity == "dx" else " that have it"
    caption = f"{text[:1].upper()}{text[1:]} against {over}: means of the walks at rest{those}."
    return Picture(_named(name, quantity), caption, figure)


def heat_map(result: SweepResult, quantity: str = "dx") -> Picture:
    """Mean and standard deviation of a quantity over links and frequency, two maps for each block and start.

    Args:
        result: a sweep.
        quantity: a column, such as ``dx``, ``walk_time`` or ``bounces``.

    Raises:
        InputError: there is no such column.
        NothingToShow: no walk at rest has the quantity in a block that has several links and frequencies, and no other
            axes.
    """
    blocks = {name for name, block in result.blocks.items() if {"links", "frequency"} <= several(block) <= _SERIES}
    shown = {name: cells for name, cells in result.cell_statistics(quantity).items() if name in blocks}
    if not any(cells.count.any() for cells in shown.values()):
        raise NothingToShow(
            "a map takes walks at rest in a block with several links and frequencies, and no other axes"
        )
    name, symbol = ("distance walked", "$Δx$") if quantity == "dx" else (quantity_name(quantity_of(quantity)),) * 2
    rows, columns = (max(len(cells.axes[axis]) for cells in shown.values()) for axis in ("links", "frequency"))
    maps = sum(len(cells.axes.get("start", "-")) for cells in shown.values())
    width, height = max(3.6, 0.8 + 0.6 * min(20, columns)), max(2.8, 1.0 + 0.4 * min(20, rows))
    figure = Figure(figsize=(1.2 + width * min(3, maps), 2 * height), layout="constrained")
    upper, lower = np.asarray(figure.subfigures(2, 1))
    draw_grid(shown, kind="map", figure=upper, label=f"mean {symbol}")
    spread = {label: replace(cells, mean=cells.sd) for label, cells in shown.items()}
    draw_grid(spread, kind="map", figure=lower, label=f"standard deviation of {symbol}")
    over = "the walks at rest" if quantity == "dx" else "the walks at rest that have it"
    caption = f"Mean and standard deviation of the {name}, over {over} in each cell."
    return Picture(_named("heat_map", quantity), caption, figure)


def several(block: BlockResult) -> set[str]:
    """The axes of a block that have several values."""
    return {name for name, values in block.axes.items() if len(values) > 1}


def has_series(block: BlockResult) -> bool:
    """Whether nothing but links, frequency and start varies in a block."""
    return several(block) <= _SERIES and "frequency" not in block.drawn


def _named(name: str, quantity: str) -> str:
    """Name of a picture; that of another quantity than the distance ends with it."""
    return name if quantity == "dx" else f"{name}_{quantity}"


def _has_own_figure(block: BlockResult, *, compared: bool) -> bool:
    """Whether a figure that only the distance has shows a block; `compared`: whether tolerances are."""
    varied = several(block)
    return (has_series(block) and "frequency" in varied) or (compared and "tolerance" in varied)
