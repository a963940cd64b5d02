"""Figures of a quantity over the grids of a sweep: whatever varies, and has no figure of its own."""

from collections.abc import Iterator
from contextlib import suppress

from matplotlib.figure import Figure

from warpchain.pictures.grid_figure import draw_grid
from warpchain.pictures.labels import quantity_name
from warpchain.pictures.style import NothingToShow, Picture
from warpchain.reports.statistics import tolerance_agreement
from warpchain.store.block_result import BlockResult
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.rows import quantity_of

_SERIES = {"links", "frequency", "start"}
"""What may vary in blocks that Figure 6 shows."""
_MOST_PANELS = 6
"""Up to so many panels, one for each number of links, Figure 6 shows all at a glance; beyond a map does."""


def grid_pictures(result: SweepResult, quantity: str = "dx") -> Iterator[Picture]:
    """The figures: a map of the distance, one for all blocks that vary one quantity, one for each set of several axes.

    Of the distance there are none of blocks that other figures show: Figure 6, tolerances.

    Raises:
        InputError: there is no such column.
    """
    compared = False
    with suppress(NothingToShow):
        compared = bool(tolerance_agreement(result).cells)
    groups: dict[frozenset[str], list[str]] = {}
    maps = []
    for name in result.cell_statistics(quantity):
        varied = several(result.blocks[name])
        own = quantity == "dx" and (has_series(result.blocks[name]) and "frequency" in varied)
        if own and len(result.blocks[name].axes.get("links", ())) > _MOST_PANELS:
            maps.append(name)
        if varied and not own and not (quantity == "dx" and compared and "tolerance" in varied):
            groups.setdefault(frozenset(varied) if len(varied) > 1 else frozenset(), []).append(name)
    with suppress(NothingToShow):
        if maps:
            figure = draw_grid({name: result.blocks[name].statistics("dx") for name in maps}, kind="map")
            yield _picture("distance_map", "Distance walked over links and frequency", figure)
    for names in groups.values():
        with suppress(NothingToShow):
            yield grid_picture(result, quantity, names)


def grid_picture(result: SweepResult, quantity: str, blocks: list[str]) -> Picture:
    """A quantity over the axes of some blocks.

    Raises:
        InputError: there is no such column.
        NothingToShow: no walk at rest has the quantity in them.
    """
    statistics = result.cell_statistics(quantity)
    figure = draw_grid({name: statistics[name] for name in blocks}, quantity_of(quantity))
    axes = {name: None for block in blocks for name, values in result.blocks[block].axes.items() if len(values) > 1}
    over, words = f"against_{'_and_'.join(axes)}", " and ".join(map(quantity_name, axes))
    if axes.keys() != several(result.blocks[blocks[0]]):
        over, words = "responses", "the one quantity that a block varies"
    text = quantity_name(quantity_of(quantity))
    name = f"{'distance' if quantity == 'dx' else quantity}_{over}"
    return _picture(name, f"{text[:1].upper()}{text[1:]} against {words}", figure)


def _picture(name: str, words: str, figure: object) -> Picture:
    """A figure of means."""
    assert isinstance(figure, Figure)
    return Picture(name, f"{words}: means of the walks at rest.", figure)


def several(block: BlockResult) -> set[str]:
    """The axes of a block that have several values."""
    return {name for name, values in block.axes.items() if len(values) > 1}


def has_series(block: BlockResult) -> bool:
    """Whether nothing but links, frequency and start varies in a block."""
    return several(block) <= _SERIES and "frequency" not in block.drawn
