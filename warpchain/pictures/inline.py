"""What a notebook shows of a figure or a result, without pyplot and without any setting of the notebook."""

import base64
import html
import io
from collections.abc import Callable, Iterable
from typing import Any, Final

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

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


def fragment(text: str, picture: bytes | None) -> str:
    """A fragment of HTML: lines of text, and a picture (PNG) if there is one."""
    shown = "" if picture is None else image(picture, text.partition("\n")[0])
    return f"<div><pre>{html.escape(text)}</pre>{shown}</div>"


def image(content: bytes, text: str, width: str = "auto") -> str:
    """A picture (PNG) that is part of the HTML, its text for who cannot see it, and its width."""
    data = base64.b64encode(content).decode()
    style = f"max-width:100%;width:{width}"
    return f'<img alt="{html.escape(text)}" style="{style}" src="data:image/png;base64,{data}">'
