"""What a notebook shows of a figure or a result, without pyplot and without any setting of the notebook."""

import base64
import html
import io
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

NOTEBOOK_DPI: Final = 100
"""Resolution of a figure in a notebook [dots per inch]."""


class InlineFigure(Figure):
    """A figure that a notebook shows when it is the value of a cell."""

    def _repr_png_(self) -> bytes:
        """The figure as a PNG."""
        return png(self)


def png(figure: Figure, dpi: float = NOTEBOOK_DPI) -> bytes:
    """A figure as the bytes of a PNG file.

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


def axes_text(axes: Mapping[str, NDArray[Any]], samples: int) -> str:
    """Name and values of each axis, only the ends of many, and the number of samples."""
    parts = []
    for name, values in axes.items():
        texts = [f"{value:g}" if values.dtype.kind == "f" else str(value) for value in values]
        shown = ", ".join(texts) if len(texts) <= 6 else f"{texts[0]} … {texts[-1]} ({len(texts)} values)"
        parts.append(f"{name} {shown}")
    return "; ".join([*parts, f"samples {samples}"])


def page(title: str, rows: Iterable[tuple[str, str]], picture: bytes | None) -> str:
    """A fragment of HTML: a title, a table of names and values, and a picture (PNG) if there is one."""
    shown = "" if picture is None else image(picture, title)
    return f"<div><b>{html.escape(title)}</b>{table(('', ''), rows)}{shown}</div>"


def image(content: bytes, text: str, width: str = "auto") -> str:
    """A picture (PNG) that is part of the HTML, its text for who cannot see it, and its width."""
    data = base64.b64encode(content).decode()
    style = f"max-width:100%;width:{width}"
    return f'<img alt="{html.escape(text)}" style="{style}" src="data:image/png;base64,{data}">'


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], *, numeric: bool = False, marked: Iterable[bool] = ()
) -> str:
    """A table of texts in HTML.

    Args:
        head: one text for each column; if all are empty, the table has no head.
        rows: as many texts each.
        numeric: whether the texts are numbers.
        marked: whether a row needs attention; none by default.
    """

    def cells(tag: str, texts: Sequence[str]) -> str:
        return "".join(f'<{tag} style="text-align:{side}">{html.escape(text)}</{tag}>' for text in texts)

    side = "right" if numeric else "left"
    top = f"<thead><tr>{cells('th', head)}</tr></thead>" if any(head) else ""
    kinds = itertools.chain((" class=bad" if bad else "" for bad in marked), itertools.repeat(""))
    body = "\n".join(f"<tr{kind}>{cells('td', row)}</tr>" for row, kind in zip(rows, kinds, strict=False))
    return f'<div class="wide"><table>{top}<tbody>\n{body}\n</tbody></table></div>'
