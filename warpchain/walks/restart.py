"""States of a walk: taken by running it again until then, with all that its rest depends on.

`WalkResult.state` takes one; `WalkRun` continues from one.
"""

from dataclasses import replace

import numpy as np

from warpchain.chain.setup import Setup, State
from warpchain.engine.batch import Batch
from warpchain.engine.devices import gpu_turn
from warpchain.inputs.validation import InputError, checked
from warpchain.status import Status
from warpchain.walks.moving_plane import state_of_plane
from warpchain.walks.walk_phases import WalkRun, go_on


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
        raise InputError("t: the walk ended before its release; see its status")
    if setup.start is None and 0 <= time < first:
        remedy = "use a later time" if end >= first else f"but the walk ends at {end:g} s: it has no state"
        raise InputError(f"t: expected a time after {first:g} s, when the sprocket vanishes, got {time:g} s; {remedy}")
    if not first <= time <= end:
        raise InputError(f"t: expected {first:g} to {end:.6g} s, got {time:g} s; use a time of the walk")
    with gpu_turn([setup.options.device]):
        batch = Batch(1, setup.scene.links, setup.options, faces=len(setup.floor.laws))
        world = batch.worlds[0]
        run = WalkRun(world, setup)
        attempts = batch.attempts_of_launch
        while run.status == Status.RUNNING:
            go_on([run])
            while not (has_come := run.is_free and world.time >= time) and world.status == Status.RUNNING:
                before = world.snapshot() if run.is_free else None
                assert run.features is not None
                batch.launch([0], run.features, attempts, np.array([run.is_driven]))
                if before is not None and world.time >= time and attempts > 1:
                    world.restore(before)
                    attempts = max(1, attempts // 8)
            if has_come:
                return State(
                    position=world.position,
                    velocity=world.velocity,
                    setup=replace(setup, start=None),
                    time=world.time,
                    memory={**world.snapshot(), "setup": setup.fingerprint, **run.driven.memory},
                    **(state_of_plane(world.plane) if setup.scene.plane == "tilting" else {}),
                )
        raise InputError(f"t: the repeated walk ended as {run.status.label} at {world.time:.6g} s; use an earlier time")
