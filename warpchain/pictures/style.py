"""Style of all figures: colours, axes and resolution; captions; and figures in notebooks, without pyplot."""

import base64
import contextlib
import html
import io
import os
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np
from matplotlib import rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from pydantic import Field

from warpchain.files import write_whole
from warpchain.inputs.validation import InputError, checked, shown

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
MARKERS: Final = "osD^vP*"
STROKES: Final[Any] = ("-", DASHES, DOTS, (0, (6, 2, 1, 2)), (0, (2, 1)), (0, (8, 3)), (0, (6, 2, 1, 2, 1, 2)))
"""Symbols and lines of several curves, which are told apart in grey print, too."""


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

    def save(self, folder: Path, suffix: str = "png") -> Path:
        """Write the figure into a folder, in a file named after it; return its path. Errors as of `save_figure`."""
        path = folder / f"{self.name}.{suffix}"
        save_figure(self.figure, path)
        return path


_USUAL_WIDTH: Final = 7.0
"""Width [inches] from which on texts have their own size."""
NARROW: Final = 6.0
"""Width [inches] below which parts of a figure stand below one another."""
LEAST_TEXT: Final = 0.721
"""Least size of texts, relative to their own: the smallest then have 6 pt."""
_MM: Final = 1 / 25.4


@contextlib.contextmanager
def on_paper(width: float | None) -> Iterator[float | None]:
    """Draw for paper so wide [mm], or as wide as suits a figure if that is None; yield the width in inches.

    Texts of narrow figures are smaller, but have at least 6 pt. What is drawn must also be saved in this context.
    """
    wide: float | None = checked(width, "width", Annotated[float, Field(ge=40, le=1000)] | None, "mm")
    inches = None if wide is None else wide * _MM
    size = 10.0 if inches is None else 10.0 * min(1.0, max(LEAST_TEXT, inches / _USUAL_WIDTH))
    fonts: Any = {"font.size": size, "pdf.fonttype": 42, "svg.hashsalt": "warpchain"}  # texts of a PDF can be edited
    with rc_context(fonts):
        yield inches


def columns_on(width: float | None, most: int) -> int:
    """Columns of panels on paper of some width [inches], at most so many."""
    return most if width is None else max(1, min(most, int(width / (2.2 * text_scale()))))


def wrapped(text: str, figure: AnyFigure, share: float = 0.95, between: Literal[", ", " "] = ", ") -> str:
    """A text in as many lines as it takes in a share of the width of a figure; words in $ count as two letters.

    Lines end between parts, or between words; a symbol keeps its unit.
    """
    letters = share * figure.bbox.width / figure.dpi / (0.085 * text_scale())
    lines = [""]
    for part in text.split(between) if between == ", " else re.findall(r"(?:\$[^$]*\$| / |\S)+", text):
        longer = f"{lines[-1]}{between}{part}".removeprefix(between)
        if lines[-1] and len(re.sub(r"\$[^$]*\$", "mm", longer)) > letters:
            lines[-1] += between.rstrip()
            longer = part
            lines.append("")
        lines[-1] = longer
    return "\n".join(lines)


LEGEND: Final[Any] = {"frameon": False, "fontsize": "small", "title_fontsize": "small", "alignment": "left"}
"""Look of a legend of a whole figure."""


def head(figure: AnyFigure, text: str, is_alone: bool) -> str:
    """Write a text above a figure, where a legend may stand beside it; or return it for the title of that legend."""
    if not is_alone and figure.bbox.width / figure.dpi < NARROW:
        return wrapped(text, figure)
    figure.suptitle(wrapped(text, figure, 0.7 if is_alone else 0.38), fontsize="small", x=0.01, ha="left")
    return ""


def text_scale() -> float:
    """Size of texts relative to their usual one, see `on_paper`."""
    return float(rcParams["font.size"]) / 10.0


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure in the format of its suffix, whole or not at all; an `OSError` if it cannot be written."""
    suffix = Path(path).suffix
    if suffix == ".png":
        return write_whole(path, png(figure, dpi=200 if figure.get_figwidth() > _USUAL_WIDTH else 300))
    content = io.BytesIO()
    undated: Any = {"CreationDate": None} if suffix == ".pdf" else {"Date": None}
    figure.savefig(content, format=suffix[1:], metadata=undated)
    write_whole(path, content.getvalue())


def tidy(axes: Axes, *, grid: Literal["x", "y", "both"] | None = None) -> None:
    """Leave out the upper and right border; draw a faint grid across one axis or both."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(color=FAINT, labelsize=rcParams["font.size"])
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
