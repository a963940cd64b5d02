"""One walk whose setup is complete, run and recorded."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from warpchain.engine.devices import gpu_turn, versions
from warpchain.inputs.options import Options
from warpchain.inputs.setup import Setup, check_has_joint_forces
from warpchain.inputs.validation import InputError, checked_positive, plain, shown
from warpchain.walks.motion import LONGEST_INTERVAL, Keep
from warpchain.walks.scheduler import run_setups
from warpchain.walks.walk_phases import WalkRun
from warpchain.walks.walk_result import WalkResult

SHORTEST_INTERVAL = 1e-6
"""Least time [s] between two frames, as between two samples."""
RECORD_BEFORE = 0.5
"""Time [s] before the release that is kept if frames are, unless told otherwise."""


@dataclass(frozen=True)
class Progress:
    """Where a walk is.

    Attributes:
        phase: ``"compile"``, ``"settle"``, ``"spin up"``, ``"hold"`` or ``"walk"``.
        time: Simulated time [s] since the start, in phase ``"walk"`` since the release.
        speed: Speed [m/s] along the loop, in phase ``"walk"`` of the centre of mass.
        attempts: Attempted steps so far.
    """

    phase: str
    time: float
    speed: float
    attempts: int


OnProgress = Callable[[Progress], None]


def run_walk(
    setup: Setup,
    *,
    seed: int | None = None,
    frame_interval: float | None = 2e-3,
    record_before: float | None = None,
    record_loads: bool = False,
    on_progress: OnProgress | None = None,
) -> WalkResult:
    """Run a walk whose setup is complete, samples drawn; the seed is only noted. The rest is as of `warpchain.walk`."""
    started = time.perf_counter()
    frame_every, between = _frame_marks(plain(frame_interval, "frame_interval"), setup.options)
    before = _time_before(plain(record_before, "record_before"), frame_every) if setup.has_drive else 0.0

    if record_loads:
        check_has_joint_forces(setup.options)
        if frame_every is None:
            raise InputError("record_loads: loads are kept with frames, but frame_interval is None; give one")

    def watch(run: WalkRun, compiling: bool) -> None:
        if on_progress is not None:
            phase = "compile" if compiling else run.phase.value
            on_progress(Progress(phase, run.walk_time or run.simulated_time, run.speed, run.attempts))

    keep = Keep(series_every=1, frame_every=frame_every, frame_interval=between, loads=record_loads, before=before)
    with gpu_turn([setup.options.device]):
        ((_, run),) = run_setups([setup], keeps=[keep], watch=watch)
        return WalkResult(
            **run.outcome(),
            **run.recorder.motion(),
            setup=setup,
            seed=plain(seed),
            versions=versions(),
            wall_time=time.perf_counter() - started - run.compile_time,
        )


def _frame_marks(frame_interval: object, options: Options) -> tuple[int | None, float]:
    """Whole samples between two kept frames, None for no frames, and their time if it is less than a sample, else 0.

    Raises:
        InputError: it is no such time.
    """
    if frame_interval is None:
        return None, 0.0
    interval = checked_positive(frame_interval, "frame_interval", "time in s")
    if not SHORTEST_INTERVAL <= interval < LONGEST_INTERVAL:
        raise InputError(
            f"frame_interval: {shown(interval)} is not between {SHORTEST_INTERVAL} s and {LONGEST_INTERVAL} s; "
            "give a time between, or None"
        )
    samples = interval / options.record_interval
    return (round(samples), 0.0) if samples > 0.999 else (1, float(interval))


def _time_before(record_before: float | None, frame_every: int | None) -> float:
    """Time [s] before the release that is kept, or an `InputError`."""
    if record_before is None:
        return RECORD_BEFORE if frame_every is not None else 0.0
    is_number = isinstance(record_before, int | float) and not isinstance(record_before, bool)
    if not (is_number and 0 <= record_before <= LONGEST_INTERVAL):
        raise InputError(
            f"record_before: {shown(record_before)} is not a time in s from 0 to {LONGEST_INTERVAL}; give one, or None"
        )
    if record_before > 0 and frame_every is None:
        raise InputError("record_before: a time is given, but frame_interval is None; give a frame_interval as well")
    return float(record_before)
