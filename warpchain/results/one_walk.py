"""Runs and records one walk of a complete setup; `walk`, the commands and repeated walks of sweeps call this."""

import time
from collections.abc import Callable
from typing import Annotated

from pydantic import Field

from warpchain.chain.keep import FRAME_INTERVAL, LONGEST_INTERVAL, Keep
from warpchain.chain.setup import Setup
from warpchain.engine.devices import gpu_turn
from warpchain.engine.machine import machine_of, own_command
from warpchain.files import now
from warpchain.inputs.validation import InputError, checked
from warpchain.kernels.methods.method import find_method
from warpchain.results.walk_result import WalkResult
from warpchain.version import package_versions
from warpchain.walks.scheduler import compile_kernels, run_setups
from warpchain.walks.walk_phases import Progress

_INTERVAL = Annotated[float, Field(ge=1e-6, lt=LONGEST_INTERVAL)]  # as between two samples
_BEFORE = Annotated[float, Field(ge=0, le=LONGEST_INTERVAL)]
RECORD_BEFORE = 0.5
"""Time [s] before the release that is kept if frames are, unless told otherwise."""
OnProgress = Callable[[Progress], None]


def run_walk(
    setup: Setup,
    *,
    seed: int | None = None,
    frame_interval: float | None = FRAME_INTERVAL,
    record_before: float | None = None,
    record_joint_forces: bool = False,
    on_progress: OnProgress | None = None,
) -> WalkResult:
    """Run a walk whose setup is complete, samples drawn; the seed is only noted. The rest is as of `warpchain.walk`."""
    interval: float | None = checked(frame_interval, "frame_interval", _INTERVAL | None, "s")
    before: float | None = checked(record_before, "record_before", _BEFORE | None, "s")
    if interval is None and (before or record_joint_forces):
        name = "record_before" if before else "record_joint_forces"
        raise InputError(f"{name}: needs frames, but frame_interval is None; set frame_interval as well")
    method = setup.options.method
    if record_joint_forces and find_method(method).has_rigid_flight:
        raise InputError(f"options.method: {method!r} has rigid joints, without forces; use explicit")
    if not setup.has_drive:
        before = 0.0
    earlier = RECORD_BEFORE if before is None else before
    keep = Keep.asked(interval, earlier, record_joint_forces, setup.options.record_interval)
    report = on_progress or (lambda progress: None)
    with gpu_turn([setup.options.device]):
        compile_kernels([setup], on_compile=lambda: report(Progress("compile", 0.0, 0.0, 0)))
        started, date = time.perf_counter(), now()
        (((_, run),),) = run_setups([setup], keeps=[keep], watch=lambda run: report(run.progress()))
        return WalkResult(
            **vars(run.outcome()),
            **run.motion(),
            setup=setup,
            seed=seed,
            versions=package_versions(),
            provenance={"command": own_command(), **machine_of([setup.options.device]), "date": date},
            wall_time=time.perf_counter() - started,
        )
