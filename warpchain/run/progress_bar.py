"""The progress of a sweep, shown where somebody looks: in a terminal or in a notebook."""

import contextlib
import html
import importlib
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

LINE_EVERY = 60.0
"""Time [s] between two lines of progress where there is neither a terminal nor a notebook."""
COMPILING = "compiling kernels; later runs find them ready"


@dataclass
class SweepProgress:
    """Progress of a sweep.

    Attributes:
        walks: Walks of the sweep.
        done: Walks that are over, those of earlier runs included. Threads of this process count each walk, other
            workers only those in files that are written.
        before: Walks that were on disk when this run began.
        seconds: Wall time [s] of this run so far.
        statuses: Number of walks of this run by status label.
        inaccurate: Walks of this run that are inaccurate, see `warpchain.walks.faults`.
        compiling: Kernels are being compiled, which takes seconds to minutes the first time on a machine.
    """

    walks: int
    done: int
    before: int
    seconds: float = 0.0
    statuses: Counter[str] = field(default_factory=Counter)
    compiling: bool = False
    inaccurate: int = 0

    @property
    def rate(self) -> float:
        """Walks per second of this run."""
        return (self.done - self.before) / self.seconds if self.seconds > 0 else 0.0

    @property
    def time_left(self) -> float | None:
        """Seconds to go at this rate; None before the first walk is over."""
        return (self.walks - self.done) / self.rate if self.rate > 0 else None


OnProgress = Callable[[SweepProgress], None]


def counts_text(progress: SweepProgress) -> str:
    """Number of walks of this run by status label, and of inaccurate ones, in one line."""
    texts = [f"{count} {label}" for label, count in sorted(progress.statuses.items())]
    return ", ".join(texts + [f"{progress.inaccurate} inaccurate"] * (progress.inaccurate > 0))


@contextlib.contextmanager
def progress_bar() -> Iterator[OnProgress]:
    """Yield a function that shows progress as a bar; without a terminal and a notebook it prints a line a minute."""
    if _in_notebook():
        yield _notebook_bar()
    elif sys.stderr.isatty():
        with _terminal_bar() as show:
            yield show
    else:
        yield _lines()


def progress_text(progress: SweepProgress) -> str:
    """How far a sweep is, in one line."""
    if progress.compiling:
        return COMPILING
    left = "" if progress.time_left is None else f"   {duration_text(progress.time_left)} left"
    rate = f"{progress.rate:.2f} a second{left}"
    return f"{progress.done:,} of {progress.walks:,} walks   {rate}   {counts_text(progress)}"


def duration_text(seconds: float) -> str:
    """Hours, minutes and seconds, as far as needed."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s" if minutes else f"{rest} s"


def _lines() -> OnProgress:
    """A line on standard error now and then, for the logs of schedulers."""
    last = time.monotonic()

    def show(progress: SweepProgress) -> None:
        nonlocal last
        if time.monotonic() - last >= LINE_EVERY:
            print(progress_text(progress), file=sys.stderr, flush=True)
            last = time.monotonic()

    return show


def _in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    if "IPython" not in sys.modules:
        return False
    return "IPKernelApp" in getattr(importlib.import_module("IPython").get_ipython(), "config", {})


def walk_in_notebook() -> Callable[[Any], None] | None:
    """What shows the progress of a walk as a line in the output of a cell; None where there is no notebook."""
    if not _in_notebook():
        return None
    show = _cell_output()

    def report(progress: Any) -> None:
        text = f"{progress.phase}: {progress.time:.2f} s, {progress.attempts:,} steps"
        show({"text/plain": "compiling kernels" if progress.phase == "compile" else text})

    return report


@contextlib.contextmanager
def _terminal_bar() -> Iterator[OnProgress]:
    """A bar on standard error."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    with Progress(BarColumn(), TextColumn("{task.fields[text]}"), console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=None, text="")

        def show(progress: SweepProgress) -> None:
            bar.update(task, total=progress.walks, completed=progress.done, text=progress_text(progress))

        yield show


def _notebook_bar() -> OnProgress:
    """A bar in the output of a cell, which needs no widgets."""
    show = _cell_output()

    def report(progress: SweepProgress) -> None:
        text = progress_text(progress)
        bar = f'<progress value="{progress.done}" max="{progress.walks}"></progress> {html.escape(text)}'
        show({"text/plain": text, "text/html": bar})

    return report


def _cell_output() -> Callable[[dict[str, str]], None]:
    """What shows a content in the output of a cell, in the place of the one before."""
    handle: Any = None

    def show(content: dict[str, str]) -> None:
        nonlocal handle
        if handle is None:
            handle = importlib.import_module("IPython.display").display(content, raw=True, display_id=True)
        else:
            handle.update(content, raw=True)

    return show
