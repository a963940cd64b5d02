"""What a figure of a sweep shows: the cells of a block and a start, how they look, and which walks are not in them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.pictures.walk_figures import INK, LINE_COLORS

if TYPE_CHECKING:
    from warpchain.store.sweep_result import SweepResult

Array = NDArray[np.float64]

BLUE, RED, GREEN = LINE_COLORS[:3]
"""A red and a green that people with any kind of colour vision can tell apart; markers differ as well."""

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
    """Statistics of one cell, see `warpchain.store.sweep_result.CellStatistics`."""

    mean: float
    sd: float
    count: int
    failed: int
    missing: int


@dataclass(frozen=True)
class Series:
    """Cells that belong together in a figure: those of one block and start, by links and frequency [Hz]."""

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
        empty = Cell(np.nan, np.nan, 0, 0, 0)
        cells = [[self.cells.get((number, frequency), empty) for frequency in frequencies] for number in links]
        return np.array([[getattr(cell, name) for cell in row] for row in cells])


def all_series(result: "SweepResult", quantity: str = "dx") -> list[Series]:
    """Every block that has nothing but links, frequency and start as axes of several values, by its starts."""
    series: list[Series] = []
    for block, given in zip(result.blocks.values(), result.sweep["blocks"], strict=True):
        several = {name for name, values in block.axes.items() if len(values) > 1}
        if not several <= {"links", "frequency", "start"} or "frequency" in block.drawn:
            continue
        found = block.statistics(quantity)
        by_start: dict[str, dict[tuple[int, float], Cell]] = {}
        for place in np.ndindex(*block.shape[:-1]):
            at = given["scene"] | {name: block.axes[name][i] for name, i in zip(block.axes, place, strict=True)}
            cells = by_start.setdefault(str(at["start"]), {})
            cells[int(at["links"]), float(at["frequency"])] = Cell(
                mean=float(found.mean[place]),
                sd=float(found.sd[place]),
                count=int(found.count[place]),
                failed=int(found.failed[place]),
                missing=int(found.missing[place]),
            )
        for start, cells in by_start.items():
            label, color, marker = _STARTS[start]
            if any(item.color == color for item in series):
                # A start that has been drawn already: the name of the block, and a look that is still free.
                label, number = f"{block.name}, {label}", len(series)
                marker = _OTHER_MARKERS[number % len(_OTHER_MARKERS)]
                color = next((other for other in _OTHER_COLORS if all(other != item.color for item in series)), INK)
            series.append(Series(label, color, marker, found.unit, cells))
    return series


def lost_note(cells: Sequence[Cell]) -> str:
    """How many walks are not in the means; empty if all are."""
    walks = sum(cell.count + cell.failed + cell.missing for cell in cells)
    failed, missing = sum(cell.failed for cell in cells), sum(cell.missing for cell in cells)
    parts = [f"{failed} of {walks} walks failed"] * (failed > 0)
    parts += [f"{missing} of {walks} not run yet"] * (missing > 0)
    return ", ".join(parts)
