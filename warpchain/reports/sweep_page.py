"""The report of a sweep: one self-contained HTML page.

It has figures and tables of the walks that are there, the failed walks and what to try, parameters, the sweep file and
the software; on demand also one walk in motion. The same folder always gives the same page.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from itertools import chain, repeat
from pathlib import Path
from typing import Final

import numpy as np
import yaml
from matplotlib.figure import Figure

from warpchain.files import AnyPath, FileKind, checked_output, write_whole
from warpchain.inputs.arrays import AnyArray
from warpchain.inputs.validation import short
from warpchain.pictures.labels import cell_notes, cell_table, cell_text, cell_values, unit_text
from warpchain.pictures.style import image, png
from warpchain.reports.sweep_figures import figures
from warpchain.results.block_result import BlockResult
from warpchain.results.sweep_result import SweepResult, load
from warpchain.results.walk_result import WalkResult
from warpchain.status import Status
from warpchain.version import VERSION
from warpchain.walks.landmarks import FAULTS

_MOST_LISTED: Final = 100
"""Greatest number of walks with the same status or fault that are listed one by one."""

_PAGE: Final = Path(__file__).with_name("sweep_page.html").read_text(encoding="utf-8")
"""The page, whose policy makes the browser refuse to load anything; `write_report` fills in the double braces."""
_HEAD: Final = _PAGE[: _PAGE.index('<meta name="viewport"')].encode()
"""What a report begins with."""


def _is_report(path: Path) -> bool:
    with path.open("rb") as content:
        return content.read(len(_HEAD)) == _HEAD


REPORTS: Final = FileKind("page that warpchain report has written", _is_report)
"""All that a report replaces."""


def write_report(folder: AnyPath, path: AnyPath, *, animation_of: int | None = None, device: str | None = None) -> None:
    """Write the report of a sweep, which may still be running, as one HTML page, whole or not at all.

    An older report is replaced. The walk of a number is shown in motion, from its frames in the sweep or else run again
    on a device, by default where the sweep says.

    Raises:
        OSError: the folder cannot be read, the file cannot be written, or it is there and no report.
        InputError: there is no sweep in the folder, a shard is damaged or foreign, there is no such walk, or the file
            is one of the sweep's own.
    """
    result = load(folder)
    checked_output(path, REPORTS)
    columns = [block.columns["status"] for block in result.blocks.values()]
    failed = [(each.label, each.sentence, [own == each for own in columns]) for each in Status if not each.ok]
    faults = [block.faults for block in result.blocks.values()]
    inaccurate = [(name, remedy, [own[name] for own in faults]) for name, remedy in FAULTS.items()]
    resolved = yaml.safe_dump(result.sweep, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
    note = "Values are in SI units; gaussian and uniform are what samples draw. <code>warpchain parameters</code> "
    origin = [[name, f"{value}"] for name, value in result.notes().items() if name not in ("sweep", "runs")]
    for number, run in enumerate(result.provenance["runs"], 1):
        times = f"{run.get('start')} to {run.get('end', 'an unknown end')}"
        origin.append([f"run {number}", f"{run.get('command')}; {times}; {run.get('machines')}"])
    again = "<p>With the text under Sweep in a file: <code>warpchain sweep FILE.yaml -o DIR</code></p>"
    sections = {
        "Figures": "\n".join(_picture(each.figure, each.caption) for each in figures(result)),
        "Cells": _cells(result),
        "Failed walks": _listed(result, failed) or "<p>None.</p>",
        "Inaccurate walks": _listed(result, inaccurate),
        "One walk": "" if animation_of is None else _walk(result, animation_of, device),
        "Sweep": f"<p>{note}says what each quantity is.</p><pre>{escape(resolved)}</pre>",
        "Provenance": _table(["", ""], [*origin, ["this page", f"warpchain {VERSION}"]]) + again,
    }
    links, parts = [], []
    for heading, text in sections.items():
        if text:
            anchor = heading.lower().replace(" ", "-")
            links.append(f'<a href="#{anchor}">{heading}</a>')
            parts.append(f'<section id="{anchor}"><h2>{heading}</h2>\n{text}\n</section>')
    good = {status.label for status in Status if status.ok} | {"walks", "missing"}  # the others stand out
    counts = {"walks": result.walk_count, **result.summary(), "inaccurate": result.inaccurate_count}
    boxes = [
        f'<div class="{"" if label in good else "bad"}"><dt>{label.replace("_", " ")}</dt><dd>{count:,}</dd></div>'
        for label, count in counts.items()
        if count or label == "walks"
    ]
    content = {"title": escape(result.name), "numbers": "".join(boxes)}
    content |= {"links": " ".join(links), "sections": "\n".join(parts)}
    write_whole(path, re.sub(r"{{(\w+)}}", lambda found: content[found[1]], _PAGE), REPORTS)


def _cells(result: SweepResult) -> str:
    """Mean and spread of the distance in every cell, a table for each block."""
    parts = [
        "<p>Mean, standard deviation (divisor count − 1) and standard error of the mean of the distance walked Δx, "
        "over the walks at rest.</p>"
    ]
    parts += [f"<p>{escape(note)}.</p>" for note in cell_notes(result.cell_statistics().values())]
    for block in result.blocks.values():
        found = block.statistics("dx")
        head, rows = cell_table(found)
        parts += [f"<h3>{escape(block.name)}</h3>"] * (len(result.blocks) > 1)
        parts.append(_table(head, rows, right=True, bad=found.failed.ravel() > 0))
    return "\n".join(parts)


def _listed(result: SweepResult, found: Iterable[tuple[str, str, Sequence[AnyArray]]]) -> str:
    """Walks with their block, cell and sample, of many only the first.

    Each item of `found` is a heading, what it means and what to try, and which walks of each block it is said of.
    """
    several, parts = len(result.blocks) > 1, []
    for heading, sentence, chosen in found:
        rows, count = list[list[str]](), sum(int(mask.sum()) for mask in chosen)
        for block, mask in zip(result.blocks.values(), chosen, strict=True):
            for *place, sample in np.argwhere(mask)[: _MOST_LISTED - len(rows)]:
                index, cell = block.columns["index"][(*place, sample)], cell_text(cell_values(block.axes, place)) or "–"
                rows.append([f"{index}", *[block.name] * several, cell, f"{sample}"])
        if count:
            parts.append(f"<h3>{heading}: {count:,}</h3><p>{escape(sentence)}</p>")
            parts.append(_table(["walk", *["block"] * several, "cell", "sample"], rows))
            parts.append(f"<p>… and {count - len(rows):,} more.</p>" * (count > len(rows)))
    return "\n".join(parts)


def _walk(result: SweepResult, index: int, device: str | None) -> str:
    """One walk, as kept or else run again: its numbers, a player, and its pictures."""
    from warpchain.run.sweep_run import on_device

    block, place = result.located(index)
    block = replace(block, origin=on_device(block.origin, device))
    planned, frames = block.origin.walk(index), block.origin.recording.frames
    cell = cell_values(block.axes, place[:-1])
    names = [f"block {block.name}"] * (len(result.blocks) > 1) + [cell_text(cell)] * bool(cell)
    if frames is not None and frames.includes(planned.sample) and block.kept[place]:
        walk, again, source = block.walk_motion(place), "", "Its frames were kept by the sweep."
    else:
        walk = block.walk(index)
        again, source = ", run again for this page", _compared(walk, block, place)
    distance = f"Δx = {walk.dx:.4f} m in {walk.walk_time:.2f} s with {walk.bounces} bounce{'s' * (walk.bounces != 1)}"
    end = distance if math.isfinite(walk.dx) else walk.status.label
    text = f"Walk {index} ({', '.join([*names, f'sample {place[-1]}'])}){again}: {end}. {source}"
    parts = [f"<p>{escape(text)}</p>", _player(walk)]
    if len(walk.frame_time) and np.isfinite(walk.frame_joints).all():
        caption = "Height and speed of the centre of mass, as in the paper's Figure 5."
        parts += [_picture(walk.plot("film_strip"), "The walk, drawn to scale.")]
        parts += [_picture(walk.plot("height_and_speed"), caption)]
    if planned.draws:
        rows = [[name, short(value), unit_text(name)] for name, value in planned.draws.items()]
        parts.append("<h3>Drawn for this walk</h3>" + _table(["name", "value", "unit"], rows))
    return "\n".join(parts)


def _player(walk: WalkResult) -> str:
    """A frame with the page of the moving picture, or the reason why there is none."""
    from warpchain.pictures.player import framed_player

    try:
        return framed_player(walk)
    except ValueError as error:
        return f'<p class="bad">No moving picture: {escape(str(error))}</p>'


def _compared(walk: WalkResult, block: BlockResult, place: tuple[int, ...]) -> str:
    """Whether a walk that was run again has the same result as in the sweep."""
    if not block.is_there[place]:
        return "The sweep has not run it yet."
    if block.has_same(walk, place):
        return "The sweep has the same, bit for bit."
    dx = float(block.columns["dx"][place])
    stored = f"Δx = {dx:.4f} m" if math.isfinite(dx) else Status(int(block.columns["status"][place])).label
    return f"The sweep has another result, {stored}: it was computed by other software or on another machine."


def _picture(figure: Figure, caption: str) -> str:
    """A figure with its caption; the image is part of the HTML."""
    shown = image(png(figure, 160), caption, f"{round(96 * figure.get_figwidth())}px")
    return f"<figure>{shown}<figcaption>{escape(caption)}</figcaption></figure>"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], *, right: bool = False, bad: Iterable[bool] = ()) -> str:
    """A table of texts in HTML, to the right or left; without a head if that is empty; bad rows stand out."""

    def cells(tag: str, texts: Sequence[str]) -> str:
        return "".join(
            f'<{tag}{" class=failed" * (name == "failed")} style="text-align:{side}">{escape(text)}</{tag}>'
            for name, text in zip(head, texts, strict=True)
        )

    side = "right" if right else "left"
    top = f"<thead><tr>{cells('th', head)}</tr></thead>" if any(head) else ""
    kinds = chain((" class=bad" if is_bad else "" for is_bad in bad), repeat(""))
    body = "\n".join(f"<tr{kind}>{cells('td', row)}</tr>" for row, kind in zip(rows, kinds, strict=False))
    return f'<div class="wide"><table>{top}<tbody>\n{body}\n</tbody></table></div>'
