"""Style of all figures: colours, axes and resolution; captions; and figures in notebooks, without pyplot."""

import base64
import html
import io
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from warpchain.files import write_whole
from warpchain.inputs.validation import InputError, shown

AnyFigure = Figure | SubFigure
LINE_COLORS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours that people with any kind of colour vision can tell apart (Okabe and Ito, 2008)."""
BLUE, RED, GREEN = LINE_COLORS[:3]

INK: Final = "#222222"
"""Text and lines."""
FAINT: Final = "#777777"
"""Lines in the background."""
GROUND: Final = "#E3E3E3"
"""The floor, and shaded areas."""

DASHES: Final[Any] = (0, (4, 3))
DOTS: Final[Any] = (0, (1, 1.5))
"""A dashed and a dotted line, as matplotlib takes them."""


class NothingToShow(InputError):  # noqa: N818 - no error of the program: the sweep was made for something else
    """A sweep lacks the blocks, or does not have the walks yet, that a figure or a number needs."""


class Picture(NamedTuple):
    """A figure with its caption, and a short name, used as the name of a file.

    `blocks` are names of those blocks of a sweep that need no figure of the grid beside it.
    """

    name: str
    caption: str
    figure: Figure
    blocks: frozenset[str] = frozenset()

    def save(self, folder: Path) -> Path:
        """Write the figure into a folder as a PNG named after it, and return its path; errors as of `save_figure`."""
        path = folder / f"{self.name}.png"
        save_figure(self.figure, path)
        return path


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as a PNG, whole or not at all; an `OSError` if it cannot be written."""
    write_whole(path, png(figure, dpi=200))


def tidy(axes: Axes, *, grid: Literal["x", "y", "both"] | None = None) -> None:
    """Leave out the upper and right border; draw a faint grid across one axis or both."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(color=FAINT)
    if grid is not None:
        axes.grid(axis=grid, color="#E6E6E6", linewidth=0.6)
        axes.set_axisbelow(True)


_OPEN: Final[Any] = {"linestyle": "", "markerfacecolor": "white", "markersize": 5.0}


def mark_survivors(axes: Axes, x: Any, mean: Any, partial: Any, at_least: Any, color: Any) -> None:
    """Open symbols over means that leave out walks, and triangles at lower bounds of the whole mean, NaN for none."""
    bounded = np.isfinite(at_least)
    for marker, y, chosen in (("o", mean, partial), ("^", at_least, bounded)):
        if chosen.any():
            axes.plot(x[chosen], y[chosen], marker=marker, color=color, zorder=3.5, label="_mark", **_OPEN)


def survivor_handles(partial: bool, bounded: bool) -> list[Line2D]:
    """What a legend says of the marks of `mark_survivors`, of those that there are."""
    texts = [("o", "mean of survivors only")] * partial + [("^", "at least, of all walks")] * bounded
    return [Line2D([], [], color=FAINT, marker=marker, label=text, **_OPEN) for marker, text in texts]


def checked_figure(figure: Any) -> AnyFigure:
    """A figure that was given to draw into; an `InputError` if it is none."""
    if not isinstance(figure, Figure | SubFigure):
        raise InputError(f"figure: expected an empty matplotlib Figure or SubFigure, got {shown(figure)}")
    return figure


def panel_grid(
    figure: AnyFigure, count: int, columns: int, *, sharex: bool, sharey: bool = True
) -> tuple[list[Axes], list[Axes]]:
    """Put panels into an empty figure, by rows: the panels, and the axes that stay empty, which show nothing.

    A common x axis has numbers below the lowest panel of each column.
    """
    grid = list(figure.subplots(-(-count // columns), columns, sharex=sharex, sharey=sharey, squeeze=False).flat)
    for axes in grid[count:]:
        axes.set_axis_off()
    for axes in grid[count - columns : count]:
        axes.tick_params(labelbottom=True)
    return grid[:count], grid[count:]


class InlineFigure(Figure):
    """A figure that a notebook shows when it is the value of a cell.

    Its texts are matplotlib's own in any case: with `text.usetex` names with an underscore would be errors of LaTeX,
    which need not be there.
    """

    def draw(self, renderer: Any) -> None:
        """Draw everything without LaTeX."""
        with rc_context({"text.usetex": False}):
            for text in self.findobj(Text):
                text.set_usetex(False)
            super().draw(renderer)

    def _repr_png_(self) -> bytes:
        """The figure as a PNG."""
        return png(self)


def png(figure: Figure, dpi: float = 100) -> bytes:
    """A figure as the bytes of a PNG file, by default as a notebook shows it.

    It is painted directly, which takes half the time of `savefig`: that draws everything once more beforehand.
    """
    given, content = figure.dpi, io.BytesIO()
    figure.set_dpi(dpi)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.print_png(content, metadata={"Software": None}, pil_kwargs={"compress_level": 3})
    figure.set_dpi(given)
    return content.getvalue()


def first_png(draws: Iterable[Callable[[], Any]]) -> bytes | None:
    """The first figure that can be drawn, as a PNG; None if none can be, whatever the reason."""
    for draw in draws:
        try:
            return png(draw())
        except Exception:  # a result must be shown in any case, without its picture if need be
            continue
    return None


def fragment(text: str, picture: bytes | None) -> str:
    """A fragment of HTML: lines of text, and a picture (PNG) if there is one."""
    shown = "" if picture is None else image(picture, text.partition("\n")[0])
    return f"<div><pre>{html.escape(text)}</pre>{shown}</div>"


def image(content: bytes, text: str, width: str = "auto") -> str:
    """A picture (PNG) that is part of the HTML, its text for who cannot see it, and its width."""
    data = base64.b64encode(content).decode()
    style = f"max-width:100%;width:{width}"
    return f'<img alt="{html.escape(text)}" style="{style}" src="data:image/png;base64,{data}">'
