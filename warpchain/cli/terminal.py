"""What the command line shows and writes: progress, tables, and a folder with record and pictures."""

import itertools
import json
import math
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from rich.console import Console
from rich.table import Table

from warpchain.engine.tallies import LOST
from warpchain.files import DISK_FAILURES, checked_output, failure, make_folder, remedy, remove_output
from warpchain.inputs.validation import InputError, one_line, printable
from warpchain.pictures.style import save_figure
from warpchain.pictures.walk_shape import Kind
from warpchain.run.progress_bar import counts_text
from warpchain.walks.faulty_rows import fault_remedies
from warpchain.walks.walk_result import WalkResult

if TYPE_CHECKING:
    from warpchain.run.progress_bar import SweepProgress
    from warpchain.run.single_walk import Progress
    from warpchain.store.sweep_result import SweepResult

_MOST_CELLS: Final = 1000
"""Most cells of a sweep that a table lists; one of 100,000 would take minutes to lay out."""

COMPILING: Final = "compiling kernels; later runs find them ready"


RECORD: Final = "walk.h5"
PICTURES: Final = ("figure5.png", "film_strip.png", "loop.png", "tilt.png")
"""Files of a walk, beside its animation."""


def try_walk_folder(folder: Path, animation: str | None) -> None:
    """Check before a walk that all its files can be written; errors as of `try_folder` and `checked_output`."""
    try_folder(folder)
    for name in (RECORD, *PICTURES, *([] if animation is None else [f"walk.{animation}"])):
        if folder.is_dir():
            checked_output(folder / name)


def try_folder(folder: Path) -> None:
    """Check before a long run that a folder can be written to; nothing is left there.

    Raises:
        InputError: it cannot.
        OSError: the disk is full or broken.
    """
    nearest = folder.absolute()
    try:
        while True:
            try:
                nearest.lstat()
                break
            except FileNotFoundError:
                nearest = nearest.parent
        with tempfile.TemporaryDirectory(prefix=".warpchain-", dir=nearest):
            pass
    except OSError as error:
        if error.errno in DISK_FAILURES:
            raise failure(error.errno, f"--output: {folder}: {error.strerror}; {remedy(error.errno)}") from None
        raise InputError(f"--output: {folder}: {error.strerror}; give a folder that can be written to") from None


@contextmanager
def status_line(every: float = math.inf) -> Iterator[Callable[[str], None]]:
    """Yield a function that shows a changing line on a terminal; without one it prints a line every so many seconds."""
    if not sys.stderr.isatty():
        last = time.monotonic()

        def print_now_and_then(text: str) -> None:
            nonlocal last
            if time.monotonic() - last >= every:
                print(text, file=sys.stderr, flush=True)
                last = time.monotonic()

        yield print_now_and_then
        return
    with Console(stderr=True).status("starting") as line:
        yield line.update


def progress_text(progress: "Progress") -> str:
    """Where a walk is, in columns."""
    if progress.phase == "compile":
        return COMPILING
    where, speed = f"{progress.phase:8}{progress.time:8.3f} s", f"{progress.speed:9.3f} m/s"
    return f"{where}{speed}{progress.attempts:14,} steps"


def sweep_progress_text(progress: "SweepProgress") -> str:
    """How far a sweep is, in columns."""
    if progress.compiling:
        return COMPILING
    left = "" if progress.time_left is None else f"   {_duration(progress.time_left)} left"
    rate = f"{progress.rate:.2f} a second{left}"
    return f"{progress.done:,} of {progress.walks:,} walks   {rate}   {counts_text(progress)}"


def _duration(seconds: float) -> str:
    """Hours, minutes and seconds, as far as needed."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s" if minutes else f"{rest} s"


def print_sweep(result: "SweepResult", as_json: bool, rate: float | None = None) -> None:
    """Print the statuses of a sweep and the mean Δx of each cell on standard output.

    Args:
        result: the sweep.
        as_json: whether to print one JSON object instead of a table.
        rate: walks per second of the process that runs the sweep; None if none does.
    """
    time_left = result.missing_count / rate if rate else None
    summary = result.summary()
    statistics = {name: block.statistics() for name, block in result.blocks.items()}
    if as_json:
        numbers = ("mean", "sd", "count", "failed", "missing")
        blocks = {
            name: {
                "axes": {axis: _plain(values) for axis, values in of_block.axes.items()},
                "dx": {key: _plain(getattr(of_block, key)) for key in numbers},
            }
            for name, of_block in statistics.items()
        }
        whole = {"name": result.name, "walks": result.walk_count, "statuses": summary}
        whole["inaccurate"] = result.inaccurate_count
        whole |= {"rate": rate, "time_left": time_left, "blocks": blocks}
        print(json.dumps(whole, indent=2, allow_nan=False))
        return
    console = Console(highlight=False, markup=False)
    counts = ", ".join(f"{count:,} {label}" for label, count in summary.items() if count or label == "at_rest")
    console.print(f"{printable(result.name)}: {result.walk_count:,} walks, {counts}")
    for remedy_of_fault, number in fault_remedies(block.faults for block in result.blocks.values()).items():
        console.print(f"{number:,} inaccurate: {remedy_of_fault}")
    if rate is not None:
        console.print(
            f"running: {rate:.2f} walks a second" + ("" if time_left is None else f", {_duration(time_left)} left")
        )
    left = _MOST_CELLS
    for name, of_block in statistics.items():
        if left == 0:
            break
        table = Table(
            box=None, pad_edge=False, title=printable(name) if len(statistics) > 1 else None, title_justify="left"
        )
        for heading in (*map(printable, of_block.axes), "mean Δx / m", "s.d. / m", "at rest", "failed", "missing"):
            table.add_column(heading, justify="right")
        for cell in itertools.islice(np.ndindex(*of_block.mean.shape), left):
            at = (values[index] for values, index in zip(of_block.axes.values(), cell, strict=True))
            place = ["null" if value is None else printable(str(value)) for value in at]
            lengths = [f"{array[cell]:.4f}" for array in (of_block.mean, of_block.sd)]
            walks = [str(array[cell]) for array in (of_block.count, of_block.failed, of_block.missing)]
            table.add_row(*place, *lengths, *walks)
        console.print(table)
        left -= len(table.rows)
    if more := sum(of_block.mean.size for of_block in statistics.values()) - _MOST_CELLS + left:
        console.print(f"… and {more:,} more cells, which --json lists")


def _plain(array: Any) -> Any:
    """An array as JSON has it; a number that is NaN is null."""
    values = np.asarray(array).tolist()
    if isinstance(values, list):
        return [_plain(part) for part in values]
    return None if values != values else values


def print_walk(result: WalkResult) -> None:
    """Print the results of a walk on standard output."""
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for row in _walk_rows(result):
        table.add_row(*row)
    Console(highlight=False, markup=False).print(table)


def _walk_rows(result: WalkResult) -> Iterator[tuple[str, str]]:
    """Names and values."""
    status, energy = result.status, result.energy
    yield "Δx", f"{result.dx:.4f} m" if math.isfinite(result.dx) else "unknown"
    yield "status", status.label if status.ok else f"{status.label}: {status.sentence}"
    if math.isfinite(result.hold_time):
        moved = f", drift {100 * result.drift:.2g} %" if math.isfinite(result.drift) else ""
        yield "loop held", f"{result.hold_time:.3f} s at full frequency{moved}"
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
    released = energy["kinetic_at_release"] + energy["potential_at_release"]
    if not math.isnan(released):  # else the chain never got so far
        yield "energy at release", f"{released:.5f} J, kinetic {energy['kinetic_at_release']:.5f} J"
        for cause in LOST:
            if energy[cause] or cause not in ("softening", "joint_switch"):
                yield f"  lost to {cause.replace('_', ' ')}", f"{energy[cause]:.5f} J"
        left = energy["kinetic_at_end"] + energy["potential_at_end"]
        yield "energy at the end", f"{left:.5f} J, kinetic {energy['kinetic_at_end']:.5f} J"
        yield "unaccounted for", f"{energy['residual']:.1e} J"
    for warning in result.warnings():
        yield "warning", warning


def write_files(result: WalkResult, folder: Path, animation: str | None) -> Iterator[Path]:
    """Write the record, then its pictures, each whole or not at all; yield the path of each.

    A failed walk may have nothing to show in a picture, and a sprocket that stands still no loop that runs. That
    picture is left out, and so is one of an earlier walk, which does not belong to this record.

    Raises:
        OSError: a file cannot be written.
    """
    make_folder(folder)
    record = folder / RECORD
    result.save(record)
    yield record
    figure5, film_strip, loop, tilt = PICTURES
    pictures: dict[str, Callable[[WalkResult, Path], None]] = {
        figure5: partial(_draw, "figure5"),
        film_strip: partial(_draw, "film_strip"),
    }
    if result.before_release is not None:
        pictures[loop] = partial(_draw, "loop")
    else:
        remove_output(folder / loop)
    if result.joints_in_room is not None:
        pictures[tilt] = partial(_draw, "tilt")
    else:
        remove_output(folder / tilt)
    if animation is not None:
        from warpchain.pictures.animation import animate

        pictures[f"walk.{animation}"] = animate
    for name, draw in pictures.items():
        path = folder / name
        try:
            draw(result, path)
        except ValueError as error:
            if result.status.ok and name != loop:
                raise
            remove_output(path)
            print(one_line(f"{path}: not drawn; {error}"), file=sys.stderr)
        else:
            yield path


def _draw(kind: Kind, result: WalkResult, path: Path) -> None:
    save_figure(result.plot(kind), path)
