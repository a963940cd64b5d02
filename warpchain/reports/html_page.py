"""Building blocks of HTML pages that contain everything and load nothing."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import chain, repeat
from pathlib import Path
from typing import TYPE_CHECKING, Final

from warpchain.files import Kind
from warpchain.pictures.inline import image, png

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DPI: Final = 160


_HEAD: Final = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="generator" content="warpchain report">
"""
"""What a report begins with."""


def _is_report(path: Path) -> bool:
    with path.open("rb") as content:
        return content.read(len(_HEAD)) == _HEAD.encode()


REPORTS: Final = Kind("page that warpchain report has written", _is_report)
"""All that a report replaces."""


def page(title: str, tiles: Mapping[str, tuple[int, str]], sections: Mapping[str, str]) -> str:
    """A whole page.

    Args:
        title: heading of the page.
        tiles: numbers at the top of the page: label → number, and ``"bad"`` if it needs attention or else ``""``.
        sections: heading → content in HTML.
    """
    numbers = (
        f'<div class="{kind}"><dt>{label}</dt><dd>{count:,}</dd></div>' for label, (count, kind) in tiles.items()
    )
    links, parts = [], []
    for heading, text in sections.items():
        anchor = heading.lower().replace(" ", "-")
        links.append(f'<a href="#{anchor}">{heading}</a>')
        parts.append(f'<section id="{anchor}"><h2>{heading}</h2>\n{text}\n</section>')
    content = {"numbers": "".join(numbers), "links": " ".join(links), "sections": "\n".join(parts)}
    return _HEAD + _PAGE.format(title=escape(title), style=_STYLE, **content)


def picture(figure: "Figure", caption: str) -> str:
    """A figure with its caption; the image is part of the HTML."""
    shown = image(png(figure, _DPI), caption, f"{round(96 * figure.get_figwidth())}px")
    return f"<figure>{shown}<figcaption>{escape(caption)}</figcaption></figure>"


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
        return "".join(f'<{tag} style="text-align:{side}">{escape(text)}</{tag}>' for text in texts)

    side = "right" if numeric else "left"
    top = f"<thead><tr>{cells('th', head)}</tr></thead>" if any(head) else ""
    kinds = chain((" class=bad" if bad else "" for bad in marked), repeat(""))
    body = "\n".join(f"<tr{kind}>{cells('td', row)}</tr>" for row, kind in zip(rows, kinds, strict=False))
    return f'<div class="wide"><table>{top}<tbody>\n{body}\n</tbody></table></div>'


_STYLE: Final = """
:root { color-scheme: light; }
body { margin: 0 auto; max-width: 62rem; padding: 1.5rem; color: #222; background: #fff;
       font: 16px/1.5 system-ui, sans-serif; }
h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; }
p { max-width: 46rem; }
a { color: #0072b2; margin-right: 1rem; }
dl { display: flex; flex-wrap: wrap; gap: .75rem; }
dl div { padding: .5rem 1rem; min-width: 6rem; background: #f3f4f5; border-left: 4px solid #0072b2; }
dl .bad { border-color: #d55e00; }
dd { margin: 0; font-size: 1.4rem; }
figure { margin: 1.5rem 0 2.5rem; }
figure img { max-width: 100%; display: block; }
figcaption { max-width: 46rem; color: #555; font-size: .9rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; }
th, td { padding: .2rem .8rem .2rem 0; vertical-align: top; border-bottom: 1px solid #e3e3e3;
         font-variant-numeric: tabular-nums; }
tr.bad td, p.bad { color: #a84a00; }
iframe { width: 100%; border: 1px solid #ccc; }
pre { max-height: 30rem; overflow: auto; padding: 1rem; background: #f3f4f5; font-size: .8rem; line-height: 1.35; }
@media print { nav, iframe { display: none; } figure, tr { break-inside: avoid; } }
"""

# The policy makes the browser refuse to load anything.
_PAGE: Final = """<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy"
      content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<h1>{title}</h1>
<dl>{numbers}</dl>
<nav>{links}</nav>
{sections}
</body>
</html>
"""
