"""The report of a sweep: one page that holds everything and loads nothing.

Figures and tables of what is there of the sweep, its parameters, its file, where it comes from, which walks failed
and what to try; on demand one walk in motion. A folder gives the same page each time.
"""

import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import yaml

from warpchain.inputs.setup import SECTIONS
from warpchain.inputs.validation import DIMENSIONLESS, InputError
from warpchain.reports.html_page import page, picture, table
from warpchain.reports.statistics import axis_symbol, cell_text, number_text
from warpchain.status import Status
from warpchain.store.shards import Folder, check_not_own
from warpchain.store.sweep_result import BlockResult, SweepResult, load
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.recording import Recording
from warpchain.walks.rows import MISSING, field_column
from warpchain.walks.walk_result import replacing

if TYPE_CHECKING:
    from warpchain.pictures.walk_figures import Walk

FRAME_INTERVAL: Final = 2e-3
"""Time between two pictures of the walk in motion [s]."""

_MOST_FAILED: Final = 100
"""Most walks of each status that are listed one by one."""


def write_report(
    directory: Folder, path: str | os.PathLike[str], *, animation_of: int | None = None, device: str | None = None
) -> None:
    """Write the report of a sweep as one HTML page, whole or not at all; an older file is replaced.

    Args:
        directory: folder of the sweep, which may still be running.
        path: the file to write.
        animation_of: number of a walk to show in motion, with the frames that the sweep kept of it or else run again;
            None for none.
        device: where that walk is run again; None: where the sweep says.

    Raises:
        OSError: the folder cannot be read, or the file cannot be written.
        InputError: there is no sweep in the folder, a shard is damaged or foreign, there is no such walk, or the file
            is one of the sweep's own.
    """
    result = load(directory)
    check_not_own(directory, Path(path))
    if animation_of is not None and not 0 <= animation_of < result.walk_count:
        raise InputError(f"--walk: there is no walk {animation_of}; give 0 … {result.walk_count - 1}")
    sections = {
        "Figures": _figures(result),
        "Cells": _cells(result),
        "Failed walks": _failed(result),
        "One walk": "" if animation_of is None else _walk(result, animation_of, device),
        "Parameters": _parameters(result),
        "Sweep": f"<pre>{escape(_text(result.sweep))}</pre>",
        "Provenance": _provenance(result),
    }
    page = _page(result, {title: text for title, text in sections.items() if text})
    with replacing(path) as part:
        part.write_text(page, encoding="utf-8")


def _text(sweep: Mapping[str, Any]) -> str:
    """The resolved sweep as a YAML file."""
    return yaml.safe_dump(sweep, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)


def _page(result: SweepResult, sections: Mapping[str, str]) -> str:
    """The whole page, from the content of its sections."""
    counts = result.summary()
    rested, missing = counts[Status.AT_REST.label], counts["missing"]
    failed = result.walk_count - rested - missing
    tiles = {"walks": (result.walk_count, ""), "at rest": (rested, ""), "failed": (failed, "bad" if failed else "")}
    if missing:
        tiles["not run yet"] = (missing, "")
    return page(result.name, tiles, sections)


def _figures(result: SweepResult) -> str:
    from warpchain.reports.sweep_figures import figures

    return "\n".join(picture(drawn.figure, drawn.caption) for drawn in figures(result))


def _cells(result: SweepResult) -> str:
    """Mean and spread of the distance in every cell, a table for each block."""
    parts = [
        "<p>Mean, standard deviation (divisor count − 1) and standard error of the mean of the distance walked Δx, "
        "over the walks at rest.</p>"
    ]
    for block in result.blocks.values():
        found = block.statistics("dx")
        head = [" / ".join(filter(None, (axis_symbol(name), _unit(name)))) for name in block.axes]
        head += ["mean Δx / m", "s.d. / m", "s.e. / m", "at rest", "failed", "not run yet"]
        rows = [
            [
                *_axis_values(block, place),
                *(_meters(float(values[place])) for values in (found.mean, found.sd, found.standard_error)),
                *(f"{values[place]}" for values in (found.count, found.failed, found.missing)),
            ]
            for place in np.ndindex(*block.shape[:-1])
        ]
        if not found.missing.any():
            head, rows = head[:-1], [row[:-1] for row in rows]
        marked = [bool(count) for count in found.failed.ravel()]
        parts += [*_heading(result, block.name), table(head, rows, numbers_from=0, marked=marked)]
    return "\n".join(parts)


def _failed(result: SweepResult) -> str:
    """For each status of a failure what it means and what to try, and the walks that have it."""
    parts = []
    for status in Status:
        if status == Status.AT_REST:
            continue
        rows = [row for block in result.blocks.values() for row in _rows_of(result, block, status)]
        if not rows:
            continue
        parts.append(f"<h3>{status.label}: {len(rows):,}</h3><p>{escape(status.sentence)}</p>")
        head = ["walk", *(["block"] if len(result.blocks) > 1 else []), "cell", "sample"]
        parts.append(table(head, rows[:_MOST_FAILED], numbers_from=len(head)))
        if len(rows) > _MOST_FAILED:
            parts.append(f"<p>… and {len(rows) - _MOST_FAILED:,} more.</p>")
    return "\n".join(parts) or "<p>None.</p>"


def _rows_of(result: SweepResult, block: BlockResult, status: Status) -> Iterator[list[str]]:
    """A line for each walk of a block that ended with a status."""
    for *place, sample in np.argwhere(block.columns["status"] == status):
        index = block.columns["index"][(*place, sample)]
        name = [block.name] if len(result.blocks) > 1 else []
        yield [f"{index}", *name, _cell(block, tuple(place)) or "–", f"{sample}"]


def _walk(result: SweepResult, index: int, device: str | None) -> str:
    """One walk, as kept or else run again: what it is, a player, and its pictures."""
    from warpchain.run.single_walk import run_walk
    from warpchain.run.sweep_run import on_device

    sweep = load_sweep(result.sweep)
    planned = (sweep if device is None else on_device(sweep, device)).planned(index)
    block = list(result.blocks.values())[planned.block]
    place = (*planned.cell, planned.sample)
    name = f"block {block.name}, " if len(result.blocks) > 1 else ""
    cell = _cell(block, planned.cell)
    walk: Walk
    if _has_frames(result, block, place):
        walk, again = block.walk_motion(place), ""
        seconds, bounces = block.columns["walk_time"][place], block.columns["bounces"][place]
    else:
        walk = ran = run_walk(planned.setup, frame_interval=FRAME_INTERVAL)
        again, seconds, bounces = ", run again for this page", ran.walk_time, ran.bounces
    distance = f"Δx = {walk.dx:.4f} m in {seconds:.2f} s with {bounces} bounces"
    text = (
        f"Walk {index} ({name}{cell + ', ' if cell else ''}sample {planned.sample}){again}: "
        f"{distance if math.isfinite(walk.dx) else walk.status.label}. "
        + (_compared(walk, block, place) if again else "Its frames were kept by the sweep.")
    )
    parts = [f"<p>{escape(text)}</p>", _player(walk)]
    if len(walk.frame_time) and np.isfinite(walk.frame_joints).all():
        parts.append(picture(walk.plot("film_strip"), "The walk, drawn to scale."))
        parts.append(
            picture(walk.plot("figure5"), "Height and speed of the centre of mass, as in the paper's Figure 5.")
        )
    if planned.drawn:
        rows = [[name, number_text(value), _unit(name)] for name, value in planned.drawn.items()]
        parts.append("<h3>Drawn for this walk</h3>" + table(["name", "value", "unit"], rows, numbers_from=3))
    return "\n".join(parts)


def _has_frames(result: SweepResult, block: BlockResult, place: tuple[int, ...]) -> bool:
    """Whether the sweep has kept frames of a walk, or would have, had it been released."""
    frames = Recording.of(result.sweep.get("record", {})).frames
    return frames is not None and frames.includes(place[-1]) and bool(block.kept[place])


def _player(walk: "Walk") -> str:
    """The page with the moving picture, inside this one; why there is none if it can't be made."""
    from warpchain.pictures.animation import animate

    with tempfile.TemporaryDirectory() as folder:
        player = Path(folder) / "walk.html"
        try:
            animate(walk, player)
        except ValueError as error:
            return f'<p class="bad">No moving picture: {escape(str(error))}</p>'
        content = escape(player.read_text(encoding="utf-8"))
    # As high as the drawing at the page's full width, with its controls [px].
    wide, high = np.ptp(walk.frame_joints[..., 0]), walk.frame_joints[..., 1].max()
    height = round(min(600.0, 170.0 + 960.0 * high / wide))
    # Without a sandbox, which browsers put into another process: the player may then draw before it has a size.
    style = f'style="height:{height}px" loading="lazy"'
    return f'<iframe title="the walk in motion" {style} srcdoc="{content}"></iframe>'


def _compared(walk: "Walk", block: BlockResult, place: tuple[int, ...]) -> str:
    """What the sweep says about a walk that was run again."""
    status, dx = int(block.columns["status"][place]), float(block.columns["dx"][place])
    if status == MISSING:
        return "The sweep has not run it yet."
    if walk.status == status and (walk.dx == dx or math.isnan(walk.dx)):
        return "The sweep has the same, to the bit."
    stored = f"Δx = {dx:.4f} m" if math.isfinite(dx) else Status(status).label
    return f"The sweep has another result, {stored}: it was computed by other software or on another machine."


def _parameters(result: SweepResult) -> str:
    """Everything that the sweep sets, with units: a table for each section of its file."""
    blocks = result.sweep["blocks"]
    parts = ["<p>± is the standard deviation of a Gaussian, truncated to physical values.</p>"]
    presets = [["preset", "", _in_blocks({block["name"]: _value(block, "", "preset") for block in blocks}), "", ""]]
    for section, model in SECTIONS.items():
        rows = presets if section == "parameters" else []
        for name in model.model_fields:
            column = field_column(name)
            symbol = axis_symbol(name)
            values = _in_blocks({block["name"]: _value(block, section, name) for block in blocks})
            rows.append([name, "" if " " in symbol or symbol == name else symbol, values, _unit(name), column.meaning])
        head = ["name", "symbol", "value", "unit", "meaning"]
        parts += [f"<h3>{section}</h3>", table(head, rows, numbers_from=len(head))]
    return "\n".join(parts)


def _value(block: Mapping[str, Any], section: str, name: str) -> str:
    """What a block of a resolved sweep says about a field: a value, the values of an axis, or a distribution."""
    if name in block["grid"]:
        values = [_plain(value) for value in block["grid"][name]]
        return ", ".join(values) if len(values) <= 12 else f"{values[0]} … {values[-1]} ({len(values)} values)"
    fixed = block.get(name) if name == "preset" else block[section].get(name)
    plain = "of the preset" if fixed is None else _plain(fixed)
    distribution = block["distributions"].get(name, {})
    if "gaussian" in distribution:
        gaussian = distribution["gaussian"]
        return f"{_plain(gaussian['mean']) if 'mean' in gaussian else plain} ± {_plain(gaussian['sigma'])}"
    if "uniform" in distribution:
        return "uniform, {} … {}".format(*map(_plain, distribution["uniform"]))
    return plain


def _in_blocks(values: Mapping[str, str]) -> str:
    """The value that most blocks have, then the others with the names of their blocks."""
    texts = list(values.values())
    most = max(texts, key=texts.count)
    return "; ".join([most, *(f"{name}: {text}" for name, text in values.items() if text != most)])


def _provenance(result: SweepResult) -> str:
    """What names the sweep and the software, and how to run it again."""
    software = ", ".join(f"{name} {number}" for name, number in result.provenance["versions"].items())
    rows = [
        ["seed", f"{result.seed}"],
        ["digest of the sweep (SHA-256)", f"{result.provenance['digest']}"],
        ["version of the numerics", f"{result.provenance['numerics_version']}"],
        ["software that began the sweep", software],
        ["software that wrote this page", f"warpchain {version('warpchain')}"],
    ]
    again = "<p>With the text under Sweep in a file: <code>warpchain sweep FILE.yaml -o DIR</code></p>"
    return table(["", ""], rows, numbers_from=2) + again


def _cell(block: BlockResult, place: tuple[int, ...]) -> str:
    """What a cell is; empty if the block has but one."""
    return cell_text({name: values[i] for (name, values), i in zip(block.axes.items(), place, strict=True)})


def _axis_values(block: BlockResult, place: tuple[int, ...]) -> list[str]:
    return [_plain(values[i].item()) for values, i in zip(block.axes.values(), place, strict=True)]


def _heading(result: SweepResult, name: str) -> list[str]:
    """A heading for a block, if there are several."""
    return [f"<h3>{escape(name)}</h3>"] if len(result.blocks) > 1 else []


def _plain(value: object) -> str:
    """A value as in a sweep file."""
    if isinstance(value, bool):
        return str(value).lower()
    return number_text(value) if isinstance(value, float) else str(value)


def _unit(name: str) -> str:
    """Unit of a field; empty for pure numbers."""
    unit = field_column(name).unit
    return "" if unit == DIMENSIONLESS else unit


def _meters(length: float) -> str:
    """A length [m] to tenths of a millimetre, a dash for none."""
    return f"{length:.4f}" if math.isfinite(length) else "–"
