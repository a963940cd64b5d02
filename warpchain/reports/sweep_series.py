"""The cells of a sweep over links and frequency, by block and start, with their colour and marker."""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from warpchain.pictures.labels import COUNTS
from warpchain.pictures.style import BLUE, GREEN, INK, LINE_COLORS, RED
from warpchain.store.block_result import BlockResult
from warpchain.store.cell_statistics import CellStatistics
from warpchain.store.sweep_result import SweepResult

_AXES: Final = ("start", "links", "frequency")

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
class Series:
    """The cells of one block and start.

    Attributes:
        label: for the legend.
        color: of its marks.
        marker: of its means.
        cells: tables of shape (links, frequencies).
    """

    label: str
    color: str
    marker: str
    cells: CellStatistics

    @property
    def has(self) -> Any:
        """Whether the block has a cell, shape (links, frequencies)."""
        return sum(getattr(self.cells, name) for name in COUNTS) > 0

    @property
    def is_map(self) -> bool:
        """Whether it has several numbers of links and several frequencies."""
        return bool(min(self.has.any(axis=axis).sum() for axis in (0, 1)) > 1)


def several(block: BlockResult) -> set[str]:
    """The axes of a block that have several values."""
    return {name for name, values in block.axes.items() if len(values) > 1}


def has_series(block: BlockResult) -> bool:
    """Whether nothing but links, frequency and start varies in a block."""
    return several(block) <= {"links", "frequency", "start"} and "frequency" not in block.drawn


def all_series(result: SweepResult, quantity: str = "dx") -> list[Series]:
    """The series of every block in which nothing but links, frequency and start varies, all over the same axes.

    Where a block has no cell, means are NaN and counts 0.

    Raises:
        InputError: there is no such column of numbers.
    """
    statistics = result.cell_statistics(quantity)
    found = []
    for block, given in zip(result.blocks.values(), result.sweep["blocks"], strict=True):
        if block.name in statistics and has_series(block):
            fixed = {name: np.array([value]) for name, value in given["scene"].items()}
            axes = {name: block.axes[name] if name in block.axes else fixed[name] for name in _AXES}
            found.append((block, axes))
    union = {name: np.unique([value for _, axes in found for value in axes[name]]) for name in ("links", "frequency")}
    series: list[Series] = []
    for block, axes in found:
        own = list(block.axes)
        order = sorted(range(len(own)), key=lambda axis: _AXES.index(own[axis]) if own[axis] in _AXES else len(_AXES))
        place = np.ix_(*(np.searchsorted(union[name], axes[name]) for name in union))
        for number, start in enumerate(axes["start"]):
            tables: dict[str, Any] = {}
            for name in ("mean", "sd", *COUNTS):
                table = getattr(statistics[block.name], name).transpose(order)
                tables[name] = np.full([len(values) for values in union.values()], 0 if name in COUNTS else np.nan)
                tables[name][place] = table.reshape([len(axes[each]) for each in _AXES])[number]
            label, color, marker = _STARTS[str(start)]
            if any(item.color == color for item in series):
                # Another block has this start: this one gets its name in the legend, another colour and marker.
                label, marker = f"{block.name}, {label}", _OTHER_MARKERS[len(series) % len(_OTHER_MARKERS)]
                color = next((other for other in _OTHER_COLORS if all(other != item.color for item in series)), INK)
            series.append(Series(label, color, marker, replace(statistics[block.name], axes=union, **tables)))
    return series
