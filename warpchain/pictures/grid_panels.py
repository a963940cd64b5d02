"""How a grid of any number of axes becomes panels of lines or maps.

Along x runs the frequency if it has three values or more, else the longest axis of numbers. The next longest axis gives
the lines, or the rows of a map if both have many values; all other axes give panels.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.validation import InputError, shown
from warpchain.pictures.labels import COUNTS, math_symbol, short_texts, unit_text
from warpchain.pictures.style import LINE_COLORS, NothingToShow

if TYPE_CHECKING:
    from warpchain.store.cell_statistics import CellStatistics

Array = NDArray[Any]

Kind = Literal["lines", "map"]

MOST_LINES: Final = len(LINE_COLORS)
"""Greatest number of lines in a panel, unless lines are asked for."""

MOST_PANELS: Final = 24
"""Greatest number of panels of a block; of more, so many are chosen evenly."""


@dataclass(frozen=True, eq=False)
class Axis:
    """An axis of a grid: numbers in rising order, or names in the order given."""

    name: str
    values: Array

    @property
    def is_numeric(self) -> bool:
        """Whether the values are numbers."""
        return self.values.dtype.kind in "if"

    @property
    def places(self) -> Array:
        """Where the values are in a panel; names are spaced evenly."""
        return self.values if self.is_numeric else np.arange(len(self.values))

    @property
    def texts(self) -> list[str]:
        """The values, written short."""
        return short_texts(self.values)


@dataclass(frozen=True)
class Panel:
    """One panel.

    Attributes:
        kind: lines, or a map.
        across: the x axis.
        along: the axis of the lines, or the y axis of a map; None for a single line.
        title: what else the cells have in common.
        cells: their statistics; arrays of shape (values of `along`, values of `across`), of one row if it is None.
    """

    kind: Kind
    across: Axis
    along: Axis | None
    title: str
    cells: "CellStatistics"

    @property
    def counts(self) -> dict[str, Array]:
        """Numbers of walks by name."""
        return {name: getattr(self.cells, name) for name in COUNTS}

    @property
    def failed_share(self) -> Array:
        """Share of the walks of a cell that failed, of those that were run."""
        cells = self.cells
        share: Array = cells.failed / np.maximum(cells.count + cells.absent + cells.failed, 1)
        return share

    @property
    def signature(self) -> tuple[object, ...]:
        """Equal for panels that can have common axes."""
        axes = [axis for axis in (self.across, self.along) if axis is not None]
        placed = [axis for axis in axes if self.kind == "map" or (axis is self.across and not axis.is_numeric)]
        return self.kind, *(axis.name for axis in axes), *(tuple(axis.values.tolist()) for axis in placed)


def grid_panels(
    blocks: "Mapping[str, CellStatistics]", kind: Kind | None, x: str | None = None
) -> tuple[list[Panel], int]:
    """The panels of all blocks, and the number of those that are left out because there are too many.

    Args:
        blocks: name of each block → the statistics of its cells.
        kind: of all panels; None for what shows a grid best.
        x: the axis along x; None for what shows a grid best.

    Raises:
        InputError: no block has this axis.
        NothingToShow: no block has an axis of several values, or two for a map, or there is no mean.
    """
    axes = {name: [name for name, values in cells.axes.items() if len(values) > 1] for name, cells in blocks.items()}
    if x is not None and not any(x in own for own in axes.values()):
        known = ", ".join(dict.fromkeys(name for own in axes.values() for name in own))
        raise InputError(f"x: {shown(x)} is no axis of several values; give one of {known}")
    panels: list[Panel] = []
    left_out = 0
    for name, cells in blocks.items():
        if len(axes[name]) < (2 if kind == "map" else 1) or (x is not None and x not in axes[name]):
            continue
        is_named = sum(set(own) == set(axes[name]) for own in axes.values()) > 1
        found = list(_panels(cells, kind, x, name if is_named else ""))
        chosen = np.unique(np.linspace(0, len(found) - 1, MOST_PANELS).round().astype(int))
        panels += [found[number] for number in chosen]
        left_out += len(found) - len(chosen)
    if not panels:
        needed = "two axes of several values" if kind == "map" else "an axis of several values"
        raise NothingToShow(f"a figure of a grid takes a block with {needed}; give a sweep that has one")
    if not any(np.isfinite(panel.cells.mean).any() for panel in panels):
        if any(panel.cells.absent.any() for panel in panels):
            raise NothingToShow("no walk has this quantity; give another, such as quantity='walk_time'")
        raise NothingToShow("no walk has come to rest; let the sweep go on, or see the statuses in summary()")
    return panels, left_out


def line_values(panels: Iterable[Panel]) -> dict[str, Array]:
    """Each axis that gives lines → its values in all panels."""
    found: dict[str, Array] = {}
    for panel in panels:
        if panel.along is not None and panel.kind == "lines":
            earlier = found.get(panel.along.name, panel.along.values[:0])
            values = dict.fromkeys([*earlier.tolist(), *panel.along.values.tolist()])
            rising = panel.along.is_numeric and None not in values
            found[panel.along.name] = np.array(sorted(values) if rising else list(values))
    return found


def _panels(cells: "CellStatistics", kind: Kind | None, x: str | None, block: str) -> Iterator[Panel]:
    """The panels of a block; titles begin with `block`, if it is not empty."""
    given = [Axis(name, np.asarray(values)) for name, values in cells.axes.items()]
    rising = [np.argsort(axis.values) if axis.is_numeric else np.arange(len(axis.values)) for axis in given]
    axes = [Axis(axis.name, axis.values[order]) for axis, order in zip(given, rising, strict=True)]
    several = [axis for axis in axes if len(axis.values) > 1]
    chosen, across, along, others = _roles(several, kind, x)
    order = [several.index(axis) for axis in (*others, along, across) if axis is not None]

    def arranged(table: Array) -> Array:
        table = table[np.ix_(*rising)].reshape([len(axis.values) for axis in several]).transpose(order)
        return table[..., np.newaxis, :] if along is None else table

    tables = {name: arranged(getattr(cells, name)) for name in ("mean", "sd", *COUNTS)}
    for place in np.ndindex(*(len(axis.values) for axis in others)):
        values = (
            f"{math_symbol(axis.name)} = {axis.texts[number]} {unit_text(axis.name)}".rstrip()
            for axis, number in zip(others, place, strict=True)
        )
        title = ", ".join([*[block] * bool(block), *values])
        here: dict[str, Any] = {name: table[place] for name, table in tables.items()}
        yield Panel(chosen, across, along, title, replace(cells, **here))


def _roles(axes: Sequence[Axis], kind: Kind | None, x: str | None) -> tuple[Kind, Axis, Axis | None, list[Axis]]:
    """What the axes of a grid become: kind, x axis, lines or rows, panels."""

    def fit(axis: Axis) -> tuple[bool, bool, bool, int]:
        is_frequency = axis.name == "frequency" and len(axis.values) > 2
        return axis.name == x, axis.is_numeric, is_frequency, len(axis.values)

    across = max(reversed(axes), key=fit)
    others = [axis for axis in axes if axis is not across]
    others.sort(key=lambda axis: (kind == "map" and axis.is_numeric, len(axis.values)))
    along = others.pop() if others else None
    if along is not None and len(along.values) > MOST_LINES:
        is_short = len(across.values) <= MOST_LINES
        kind = kind or ("lines" if is_short else "map")
        if kind == "lines" and is_short and x is None:  # a long axis beside a short one
            across, along = along, across
    return kind or "lines", across, along, [axis for axis in axes if axis in others]
