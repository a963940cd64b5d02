"""The state of a walk at any time after its release: the walk is run again until then."""

from dataclasses import replace

import numpy as np

from warpchain.engine.batch import Batch
from warpchain.engine.devices import gpu_turn
from warpchain.engine.snapshot import restore, take_snapshot
from warpchain.inputs.setup import Setup
from warpchain.inputs.state import State
from warpchain.inputs.validation import InputError, checked
from warpchain.status import Status
from warpchain.walks.moving_plane import state_of_plane
from warpchain.walks.walk_phases import WalkRun

FINER = 8
"""By how much launches become shorter each time that one has gone too far."""


def state_at(setup: Setup, t: object, end: float) -> State:
    """The state of a walk at the end of its first step at or after a time [s], see `WalkResult.state`.

    Launches that go past that step are undone and shortened, down to one attempt: so the walk makes the steps that it
    always makes, and none for this time. Its end [s] is NaN if it came before the release. An `InputError` says that
    there is no such time, or that the walk, run again, ends before.
    """
    time: float = checked(t, "t", float, "s")
    first = setup.scene.release[-1][0] if setup.scene.release is not None else 0.0  # then the sprocket vanishes
    if setup.start is not None:
        first = setup.start.time
    if np.isnan(end):
        raise InputError("t: the walk ended before its release, and has no such time; see its status")
    if setup.start is None and 0 <= time < first:
        raise InputError(f"t: {time:g} s: the sprocket is there until {first:g} s, and a state has none; give more")
    if not first <= time <= end:
        raise InputError(f"t: {time:g} s is not in the walk; give a time from {first:g} to {end:.6g}")
    with gpu_turn([setup.options.device]):
        batch = Batch(1, setup.scene.links, setup.options, faces=len(setup.floor.laws))
        run = WalkRun(batch, 0, setup)
        attempts = batch.attempts_of_launch
        for features in run.phases():
            while not (has_come := run.is_free and batch.time(0) >= time) and batch.status(0) == Status.RUNNING:
                before = take_snapshot(batch, 0) if run.is_free else None
                batch.launch([0], features, attempts)
                if before is not None and batch.time(0) >= time and attempts > 1:
                    restore(batch, 0, before)
                    attempts = max(1, attempts // FINER)
            if has_come:
                return State(
                    position=batch.position(0),
                    velocity=batch.velocity(0),
                    setup=replace(setup, start=None),
                    time=batch.time(0),
                    memory=run.memory(),
                    **(state_of_plane(batch.plane(0)) if setup.scene.plane == "tilting" else {}),
                )
        raise InputError(f"t: run again, the walk ends as {run.status.label} at {batch.time(0):.6g} s; give less")
