"""Figures of a quantity over the grids of a sweep: whatever varies, and has no figure of its own."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial

from matplotlib.figure import Figure

from warpchain.pictures.grid_figure import draw_grid
from warpchain.pictures.labels import quantity_name
from warpchain.pictures.style import NothingToShow, Picture
from warpchain.reports.statistics import tolerance_agreement
from warpchain.reports.sweep_series import has_series, several
from warpchain.store.block_result import BlockResult
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.rows import quantity_of


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
    return Picture(named(name, quantity), caption, figure)


def named(name: str, quantity: str) -> str:
    """Name of a picture; that of another quantity than the distance ends with it."""
    return name if quantity == "dx" else f"{name}_{quantity}"


def _has_own_figure(block: BlockResult, *, compared: bool) -> bool:
    """Whether a figure that only the distance has shows a block; `compared`: whether tolerances are."""
    varied = several(block)
    return (has_series(block) and "frequency" in varied) or (compared and "tolerance" in varied)
