"""The cells of a sweep that a figure shows together, with their colour and marker."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from warpchain.pictures.labels import cell_values
from warpchain.pictures.style import BLUE, GREEN, INK, LINE_COLORS, RED
from warpchain.store.block_result import BlockResult
from warpchain.store.sweep_result import SweepResult

Array = NDArray[np.float64]

_STARTS: Final = {
    "rest": ("started at rest", RED, "o"),
    "ellipse": ("started as an ellipse", GREEN, "D"),
    "spinning": ("started spinning", BLUE, "s"),
}
"""How the chain started → legend, colour, marker."""

_OTHER_COLORS: Final = (BLUE, *LINE_COLORS[3:6], INK)
_OTHER_MARKERS: Final = "s^vP*X"
"""For further blocks of the same start."""


@dataclass(frozen=True)
class Cell:
    """Statistics of one cell, see `warpchain.store.cell_statistics.CellStatistics`."""

    mean: float
    sd: float
    count: int
    absent: int
    failed: int
    missing: int


@dataclass(frozen=True)
class Series:
    """The cells of one block and start, by links and frequency [Hz]."""

    label: str
    color: str
    marker: str
    unit: str
    cells: dict[tuple[int, float], Cell]

    @property
    def is_map(self) -> bool:
        """Whether it has several numbers of links and several frequencies."""
        return all(len(set(values)) > 1 for values in zip(*self.cells, strict=True))

    def table(self, name: str, links: Sequence[int], frequencies: Sequence[float]) -> Array:
        """A statistic, NaN where there is no cell, shape (links, frequencies)."""
        empty = Cell(np.nan, np.nan, 0, 0, 0, 0)
        cells = [[self.cells.get((number, frequency), empty) for frequency in frequencies] for number in links]
        return np.array([[getattr(cell, name) for cell in row] for row in cells])


def several(block: BlockResult) -> set[str]:
    """The axes of a block that have several values."""
    return {name for name, values in block.axes.items() if len(values) > 1}


def has_series(block: BlockResult) -> bool:
    """Whether nothing but links, frequency and start varies in a block."""
    return several(block) <= {"links", "frequency", "start"} and "frequency" not in block.drawn


def all_series(result: SweepResult, quantity: str = "dx") -> list[Series]:
    """The series of every block in which nothing but links, frequency and start varies.

    Raises:
        InputError: there is no such column of numbers.
    """
    statistics = result.cell_statistics(quantity)
    series: list[Series] = []
    for block, given in zip(result.blocks.values(), result.sweep["blocks"], strict=True):
        if block.name not in statistics or not has_series(block):
            continue
        found = statistics[block.name]
        by_start: dict[str, dict[tuple[int, float], Cell]] = {}
        for place in np.ndindex(*block.shape[:-1]):
            at = given["scene"] | cell_values(block.axes, place)
            cells = by_start.setdefault(str(at["start"]), {})
            cells[int(at["links"]), float(at["frequency"])] = Cell(
                mean=float(found.mean[place]),
                sd=float(found.sd[place]),
                count=int(found.count[place]),
                absent=int(found.absent[place]),
                failed=int(found.failed[place]),
                missing=int(found.missing[place]),
            )
        for start, cells in by_start.items():
            label, color, marker = _STARTS[start]
            if any(item.color == color for item in series):
                # Another block has this start: this one gets its name in the legend, another colour and marker.
                label, number = f"{block.name}, {label}", len(series)
                marker = _OTHER_MARKERS[number % len(_OTHER_MARKERS)]
                color = next((other for other in _OTHER_COLORS if all(other != item.color for item in series)), INK)
            series.append(Series(label, color, marker, found.unit, cells))
    return series
