"""Output of commands: tables, and the folder of a walk with its record and figures."""

import itertools
import json
import math
import os
import sys
import tempfile
from collections.abc import Container, Iterable, Iterator, Sequence
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from warpchain.engine.tallies import LOST
from warpchain.files import checked_output, make_folder, naming, remove_output
from warpchain.hdf5_files import SWEEP_FILE, WALK_FILE
from warpchain.inputs.figure_kinds import KINDS, FigureWord
from warpchain.inputs.validation import InputError, json_value, one_line, printable, short
from warpchain.pictures.labels import COUNTS, SPREADS, cell_notes, cell_table, cell_text, with_error
from warpchain.results.walk_result import WalkResult, load_walk
from warpchain.status import Status
from warpchain.walks.landmarks import FAULTS

if TYPE_CHECKING:
    from warpchain.results.sweep_result import SweepResult
    from warpchain.run.sweep_plan import SweepPlan
    from warpchain.sweeps.plan import Sweep

_PICTURES: Final = (*(f"{kind}.png" for kind in KINDS), "walk.gif")
"""What `plot` and `animate` write beside the record unless told otherwise."""
ONE_OF_MANY: Final = "one of many: any small change alters it, typically by 1 to 4 %; --samples 12 gives a mean"
"""What a single distance is worth, which has two digits."""
BYTES_ON_DISK: Final = 500
"""Bytes of a walk in its shard, about, without its motion."""
_MOST_CELLS: Final = 1000
"""Most cells of a sweep that a table lists; one of 100,000 would take minutes to lay out."""


def print_table(headings: Iterable[str], rows: Iterable[Sequence[str]], left: Container[str] = ()) -> None:
    """Print columns of text on standard output, to the right but for those whose headings are `left`; NaN is empty."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="")
    for heading in headings:
        table.add_column(heading, justify="left" if heading in left else "right", no_wrap=heading != "meaning")
    for row in rows:
        table.add_row(*("" if text.startswith("nan") else text for text in row))
    width = None if sys.stdout.isatty() else 180  # where there is no terminal to ask
    Console(highlight=False, markup=False, width=width).print(table)


def print_sweep(result: "SweepResult", folder: Path | None, as_json: bool) -> None:
    """Print the statuses of a sweep and the mean Δx of each cell on standard output, as a table or one JSON object.

    If a folder is given, and holds a part of the sweep, a line says how far the part is.
    """
    from warpchain.store.shards import read_manifest

    summary, statistics = result.summary(), result.cell_statistics()
    if as_json:
        blocks = {
            name: {
                "axes": cells.axes,
                "dx": {key: getattr(cells, key) for key in (*SPREADS, "independent", *COUNTS)},
                **({} if cells.reached is None else {"reached": cells.reached}),
            }
            for name, cells in statistics.items()
        }
        whole = {"name": result.name, "walks": result.walk_count, "statuses": summary}
        whole |= {"inaccurate": result.inaccurate_count, "blocks": blocks}
        print(json.dumps(json_value(whole), indent=2, allow_nan=False))
        return
    counts = ", ".join(f"{count:,} {label}" for label, count in summary.items() if count)
    print(f"{printable(result.name)}: {result.walk_count:,} walks, {counts}")
    if folder is not None and folder.is_dir():
        manifest = read_manifest(folder)
        part, parts = manifest.part
        if parts > 1:
            missing = np.concatenate([block.is_missing.ravel() for block in result.blocks.values()])
            done, left = result.walk_count - missing.sum(), (missing & manifest.mine).sum()
            print(f"part {part}/{parts}: {done:,} of {done + left:,} walks")
    for fault, remedy in FAULTS.items():
        if number := sum(int(block.faults[fault].sum()) for block in result.blocks.values()):
            print(f"{number:,} inaccurate: {remedy}")
    room = _MOST_CELLS
    for name, cells in statistics.items():
        head, rows = cell_table(cells)
        if room and len(statistics) > 1:
            print(printable(name))
        if room:
            print_table(head, itertools.islice(rows, room))
        room = max(0, room - cells.mean.size)
    for note in cell_notes(statistics.values()):
        print(note)
    if (more := sum(cells.mean.size for cells in statistics.values()) - _MOST_CELLS) > 0:
        print(f"… and {more:,} more cells, which --json lists")


def print_walk(result: WalkResult) -> None:
    """Print the results of a walk on standard output."""
    _print_rows(_walk_rows(result))


def _print_rows(given: Iterable[tuple[str, str]]) -> None:
    """Print names and values in two columns."""
    rows = list(given)
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"{name:<{width}}  {value}")


def print_plan(planned: "Sweep", plan: "SweepPlan", as_json: bool) -> None:
    """Print what a sweep would take, or what is left of it, on standard output, as rows or one JSON object."""
    if as_json:
        print(json.dumps(json_value({"name": planned.name, **vars(plan)}), indent=2, allow_nan=False))
        return
    least, most = plan.walks
    rows = {"sweep": f"{printable(planned.name)} is valid", "cells": f"{plan.cells:,}"}
    rows |= {"walks done": f"{plan.done:,}"} if plan.done else {}
    rows["walks left" if plan.done else "walks"] = f"{least:,}" + f" in this round, {most:,} at most" * (most > least)
    if not most:
        _print_rows([*rows.items(), ("memory", f"{_sizes(plan.memory)} to read the results")])
        return
    rows |= {"expected": f"{plan.expected:,} walks left"} if plan.expected is not None else {}
    rows |= {"files": f"{plan.shards:,}", "disk": _sizes(BYTES_ON_DISK * least, BYTES_ON_DISK * most)}
    rows |= {"motions": f"of {plan.motions:,} walks; they need room beside this"} if plan.motions else {}
    rows |= {"memory": f"{_sizes(plan.memory)} to read the results", "at a time": f"{plan.at_once}"}
    for block, values, seconds in plan.pilot:
        name = f"{printable(block)}: " * (len(planned.blocks) > 1)
        rows[f"a walk of {name}{cell_text(values) or 'the cell'}"] = f"{seconds:.2f} s"
    if plan.seconds:
        rows["time"] = " to ".join(dict.fromkeys(str(timedelta(seconds=math.ceil(each))) for each in plan.seconds))
    _print_rows(rows.items())


def _sizes(*sizes: float) -> str:
    """Numbers of bytes, alike ones once."""
    return " to ".join(dict.fromkeys(f"{short(max(size / 1e6, 0.001), 2)} MB" for size in sizes))


def print_samples(result: "SweepResult") -> None:
    """Print mean, error and spread of the distances of the samples of one cell on standard output, and statuses."""
    from warpchain.results.block_result import counted

    cells, dx = result.statistics(), result.dx
    rows = {"Δx": "unknown; no walk came to rest"}
    if cells.count:
        mean, error = cells.mean.item(), cells.standard_error.item()
        rows["Δx"] = f"{with_error(mean, error)} m, mean and standard error of {cells.count} walks at rest"
        spread = f"{short(cells.sd.item(), 2)} m, " * bool(cells.count > 1)
        rows["spread"] = f"{spread}from {short(np.nanmin(dx), 3)} to {short(np.nanmax(dx), 3)} m"
    rows["status"] = counted(result.summary())
    if inaccurate := result.inaccurate_count:
        rows["warning"] = f"{inaccurate} inaccurate"
    _print_rows(rows.items())


def _walk_rows(result: WalkResult) -> Iterator[tuple[str, str]]:
    """Names and values."""
    status, energy = result.status, result.energy
    yield "Δx", f"{result.dx:#.2g}".removesuffix(".") + f" m, {ONE_OF_MANY}" if math.isfinite(result.dx) else "unknown"
    yield "status", status.label  # what to try is said on standard error
    if math.isfinite(result.hold_time):
        drift = f"drift {100 * result.drift:.2g} %" if math.isfinite(result.drift) else ""
        if result.status is Status.NOT_STEADY:  # the drift of its last, short watch is no reason
            drift = f"shape or speed kept changing; {drift} while last watched" if drift else "never watched"
        yield "loop held", f"{result.hold_time:.3f} s at full frequency" + (f", {drift}" if drift else "")
    yield "walk time", f"{result.walk_time:.3f} s"
    yield "bounces", f"{result.bounces}"
    if math.isfinite(result.greatest_tilt):
        fell = f"fell over {result.fell_at:.3f} s after the release" if result.fell_over else "did not fall over"
        yield "plane", f"{fell}, greatest tilt {math.degrees(result.greatest_tilt):.3g}°"
    if math.isfinite(result.lateral_drift):
        yield "lateral drift", f"{result.lateral_drift:+.4f} m, to the right"
    if math.isfinite(result.softened_at):
        yield "joints softened", f"{result.softened_at:.3f} s after the release"
    yield "steps", f"{result.steps_accepted:,} accepted, {result.steps_rejected:,} rejected"
    yield "simulated", f"{result.simulated_time:.3f} s in {result.wall_time:.1f} s"
    yield "greatest joint opening", f"{1e3 * result.greatest_opening:.3g} mm"
    depths = (f"{kind} {1e3 * depth:.3g} mm" for kind, depth in result.greatest_penetration.items())
    yield "greatest penetration", ", ".join(depths)
    if not math.isnan(result.energy_at_release):  # else the chain never got so far
        yield "energy at release", f"{result.energy_at_release:.5f} J, kinetic {energy['kinetic_at_release']:.5f} J"
        for cause in LOST:
            if energy[cause] or cause not in ("softening", "joint_switch"):
                yield f"  lost to {cause.replace('_', ' ')}", f"{energy[cause]:.5f} J"
        yield "energy at the end", f"{result.energy_at_end:.5f} J, kinetic {energy['kinetic_at_end']:.5f} J"
        yield "unaccounted for", f"{energy['residual']:.1e} J"
    for warning in result.warnings():
        yield "warning", warning


def saved(path: Path, wanted: str) -> "WalkResult | SweepResult":
    """The walk or the sweep of a file or a folder; else an `InputError` says what is `wanted` in its place."""
    from warpchain.hdf5_files import kind_of_hdf5
    from warpchain.results.sweep_result import MERGED, load

    record = path / WALK_FILE if os.path.isfile(path / WALK_FILE) else path
    is_sweep = record.is_dir() or (record.suffix != ".h5" and not record.exists())
    return load(record) if is_sweep or kind_of_hdf5(record, wanted) == MERGED.kind else load_walk(record)


def try_walk_folder(folder: Path) -> None:
    """Check before a walk that all its files can be written to a folder, by an `OSError`; nothing is left there."""
    nearest = folder.absolute()
    with naming(folder):
        while True:
            try:
                nearest.lstat()
                break
            except FileNotFoundError:
                nearest = nearest.parent
        with tempfile.TemporaryDirectory(prefix=".warpchain-", dir=nearest):
            pass
    if (folder / SWEEP_FILE).exists():
        raise InputError(f"{folder}: already holds a sweep; use another folder")
    if folder.is_dir():
        for name in (WALK_FILE, *_PICTURES):
            checked_output(folder / name)


def write_walk(result: WalkResult, folder: Path) -> Iterator[Path]:
    """Write the record, then its film strip, whole or not at all; yield the path of each.

    Figures and film of an earlier walk, which do not belong to this record, are deleted.
    """
    make_folder(folder)
    result.save(folder / WALK_FILE)
    yield folder / WALK_FILE
    for name in _PICTURES:
        remove_output(folder / name)
    yield from draw_figures(result, folder, ["film_strip"])


def draw_figures(
    walk: WalkResult, folder: Path, kinds: Iterable[FigureWord], suffix: str = "png", width: float | None = None
) -> Iterator[Path]:
    """Draw figures, of a width [inches] if it is given, into a folder, in files of a suffix; yield the path of each.

    Standard error says which a walk has nothing for, and why.
    """
    from warpchain.pictures.style import save_figure
    from warpchain.pictures.walk_figures import draw

    for kind in kinds:
        path = folder / f"{kind}.{suffix}"
        try:
            figure = draw(walk, kind, width=width)
        except ValueError as error:
            print(one_line(f"{path}: not drawn; {error}"), file=sys.stderr)
        else:
            save_figure(figure, path)
            yield path
