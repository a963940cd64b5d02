"""What a notebook shows of a figure or a result, without pyplot and without any setting of the notebook."""

import base64
import html
import io
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from matplotlib.figure import Figure
from numpy.typing import NDArray

NOTEBOOK_DPI: Final = 100
"""Resolution of a figure in a notebook [dots per inch]."""


class InlineFigure(Figure):
    """A figure that a notebook shows when it is the value of a cell."""

    def _repr_png_(self) -> bytes:
        """The figure as a PNG."""
        return png(self)


def png(figure: Figure) -> bytes:
    """A figure as the bytes of a PNG file."""
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=NOTEBOOK_DPI)
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
    lines = [
        f'<tr><th style="text-align:left">{html.escape(name)}</th>'
        f'<td style="text-align:left">{html.escape(value)}</td></tr>'
        for name, value in rows
    ]
    shown = ""
    if picture is not None:
        data = base64.b64encode(picture).decode()
        shown = f'<img alt="{html.escape(title)}" style="max-width:100%" src="data:image/png;base64,{data}">'
    return f"<div><b>{html.escape(title)}</b><table>{''.join(lines)}</table>{shown}</div>"
