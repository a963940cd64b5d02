"""Walks a second of a small sweep."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from warpchain.inputs.options import Options
from warpchain.run.progress_bar import SweepProgress
from warpchain.run.sweep_run import sweep
from warpchain.status import Status

SWEEP: Final[dict[str, Any]] = {
    "version": 1,
    "name": "bench",
    "seed": 0,
    "preset": "paper",
    "scene": {"links": 60, "frequency": 15.0, "start": "spinning"},
}
"""What is run, but for the number of samples."""


@dataclass(frozen=True)
class WalkRate:
    """How quickly a sweep runs, from when its kernels are loaded until the last walk is on disk.

    Attributes:
        method: Integrator.
        tolerance: Of its steps.
        walks: Number of walks.
        at_rest: Walks that came to rest.
        seconds: Wall time [s].
        walks_per_second: Walks per wall time [1/s].
    """

    method: str
    tolerance: float
    walks: int
    at_rest: int
    seconds: float
    walks_per_second: float


def walk_rate(device: str, walks: int, report: Callable[[str], None]) -> WalkRate:
    """Run a sweep of 60 links at 15 Hz with Table 1's joints in a folder that is deleted afterwards.

    Args:
        device: ``"cpu"``, ``"cuda"``, ``"cuda:N"`` or ``"fibers"``; on a CPU all processors take part.
        walks: Number of walks.
        report: Called with a line of progress.

    Raises:
        InputError: There is no such device.
        OSError: The folder cannot be written.
    """
    options = Options.model_validate({"device": device})
    last = SweepProgress(walks=walks, done=0, before=0)

    def follow(progress: SweepProgress) -> None:
        nonlocal last
        last = progress
        report("compiling kernels" if progress.compiling else f"{progress.done:,} of {walks:,} walks")

    with tempfile.TemporaryDirectory(prefix="warpchain-bench-") as folder:
        result = sweep(SWEEP | {"samples": walks}, f"{folder}/sweep", device=device, on_progress=follow)
    return WalkRate(
        method=options.method,
        tolerance=options.tolerance,
        walks=walks,
        at_rest=result.summary()[Status.AT_REST.label],
        seconds=last.seconds,
        walks_per_second=last.rate,
    )
