"""Progress lines of walks and sweeps in a terminal, in a notebook, or in a log."""

import contextlib
import math
import os
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import timedelta
from typing import TextIO

from warpchain.walks.walk_phases import Progress

LINE_EVERY = 60.0
"""Time [s] between two lines of progress where there is neither a terminal nor a notebook."""
_COLUMNS = 120
"""Width of a line where no terminal says its own."""
COMPILING = "compiling kernels for this machine, which takes 10 to 30 s; later runs find them ready"


@dataclass
class SweepProgress:
    """Progress of a sweep.

    Attributes:
        walks: Walks of the sweep; with `until` those of its rounds so far.
        done: Walks that are over, those of earlier runs included. Threads of this process count each walk, other
            workers only those in files that are written.
        before: Walks that were on disk when this run began.
        seconds: Wall time [s] of this run so far.
        statuses: Number of walks of this run by status label.
        inaccurate: Walks of this run that are inaccurate, see `warpchain.walks.landmarks`.
        waited: Time [s] for which the threads of this process have waited for a GPU.
        round: Number of the round of this run that is under way, of a sweep with `until`; else None.
        compiling: Kernels are being compiled, which takes seconds to minutes the first time on a machine.
    """

    walks: int
    done: int
    before: int
    seconds: float = 0.0
    statuses: Counter[str] = field(default_factory=Counter)
    compiling: bool = False
    inaccurate: int = 0
    waited: float = 0.0
    round: int | None = None

    @property
    def rate(self) -> float:
        """Walks per second of this run."""
        return (self.done - self.before) / self.seconds if self.seconds > 0 else 0.0


OnProgress = Callable[[SweepProgress], None]


def counts_text(progress: SweepProgress) -> str:
    """Number of walks of this run by status label, and of inaccurate ones, in one line."""
    texts = [f"{count} {label}" for label, count in sorted(progress.statuses.items())]
    return ", ".join(texts + [f"{progress.inaccurate} inaccurate"] * (progress.inaccurate > 0))


@contextlib.contextmanager
def changing_line(in_terminals: bool = True, every: float = math.inf) -> Iterator[Callable[..., None]]:
    """Yield a function `show(text, urgent=False)` that shows a text in the place of the one before.

    Without a terminal and a notebook it prints a line on standard error, so often [s], by default never, and at once if
    the text is urgent and a new one. Threads may call it at the same time.
    """
    in_notebook = type(sys.stdout).__module__.startswith("ipykernel")
    stays = not in_notebook and not (in_terminals and sys.stderr.isatty())
    stream, last, shown = sys.stdout if in_notebook else sys.stderr, time.monotonic(), False
    told = set[str]()
    one_at_a_time = threading.Lock()

    def show(text: str, urgent: bool = False) -> None:
        with one_at_a_time:
            show_alone(text, urgent)

    def show_alone(text: str, urgent: bool) -> None:
        nonlocal last, shown
        if urgent and stays and text not in told:
            print(text, file=stream, flush=True)
            told.add(text)
        elif not stays:
            room = _columns(stream) - 1  # a longer line wraps, and the next one would not cover it
            print(f"\r{text[:room]:{room}}", end="", file=stream, flush=True)
            shown = True
        elif time.monotonic() - last >= every and not urgent:
            print(text, file=stream, flush=True)
            last = time.monotonic()

    try:
        yield show
    finally:
        if shown:
            print(file=stream)


def _columns(stream: TextIO) -> int:
    """Width of the terminal of a stream, which need not be that of standard output."""
    try:
        return os.get_terminal_size(stream.fileno()).columns or _COLUMNS
    except (OSError, ValueError):  # a notebook
        return _COLUMNS


def progress_text(progress: SweepProgress) -> str:
    """How far a sweep is, in one line."""
    if progress.compiling:
        return COMPILING
    rate = f"{progress.rate:.2f} a second"
    if progress.rate > 0:  # else no walk is over yet
        rate += f"   {timedelta(seconds=round((progress.walks - progress.done) / progress.rate))} left"
    if progress.round is not None:
        rate += f" in round {progress.round}"
    bar = f"[{'#' * (10 * progress.done // progress.walks):10}]"
    return f"{bar} {progress.done:,} of {progress.walks:,} walks   {rate}   {counts_text(progress)}"


def walk_progress_text(progress: Progress) -> str:
    """Where a walk is, in columns."""
    if progress.phase == "compile":
        return COMPILING
    where, speed = f"{progress.phase:8}{progress.time:8.3f} s", f"{progress.speed:9.3f} m/s"
    return f"{where}{speed}{progress.attempts:14,} steps"
