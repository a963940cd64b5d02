"""Loops on their sprocket: driven up to their release, and held on from there."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tests.support.arrays import Array
from tests.support.blocks_under_test import run_recorded
from tests.support.setups import setup_walk
from warpchain.chain.keep import Keep
from warpchain.chain.link_values import LinkValues
from warpchain.chain.setup import Setup
from warpchain.engine.batch import Batch
from warpchain.inputs.parameters import Parameters
from warpchain.kernels import layout
from warpchain.status import Status
from warpchain.walks.walk_phases import WalkRun, go_on

SHAPE = (layout.HEIGHT, layout.WIDTH, layout.CENTER_X, layout.CENTER_Y)
"""Columns of a sample that say where a loop is."""


@dataclass(frozen=True)
class Loop:
    """Position and velocity (n, 3) of a walk's loop as it leaves its sprocket, about whose centre it is."""

    setup: Setup
    position: Array
    velocity: Array


def period_of(setup: Setup) -> float:
    """Time [s] in which a loop goes round, a quarter of a second if it stands still."""
    speed = setup.loop_speed
    return setup.scene.links * setup.parameters.link_length / speed if speed > 0 else 0.25


def released_loop(preset: str = "soft", **settings: Any) -> Loop:
    """Carry a walk of a preset's chain to the end of its drive."""
    setup = setup_walk(preset, {"method": "explicit"} | settings)
    batch = Batch(1, setup.scene.links, setup.options)
    run = WalkRun(batch.worlds[0], setup)
    found: Loop | None = None
    go_on([run])
    while not run.is_released:
        assert run.features is not None, "it was not released"
        batch.run([0], run.features)
        found = Loop(setup, batch.worlds[0].position, batch.worlds[0].velocity)
        go_on([run])
    assert found is not None
    return found


def hold(
    loop: Loop, parameters: Parameters, duration: float, load_factor: float = 1.0, own: LinkValues | None = None
) -> Array:
    """Hold a loop on for a time [s] with other parameters; means of `SHAPE` at its end and `bottom_curvature`, (5,)."""
    setup = loop.setup
    scene = setup.scene
    batch = Batch(1, scene.links, setup.options, keep=Keep(series_every=1, frame_every=1))
    other = replace(setup, parameters=parameters)
    touched = parameters.with_values({"sprocket_radius": other.contact_radius})
    batch.worlds[0].set_chain(touched, scene.links, own)
    softness = 1.0 if setup.options.soften_drive else 0.0
    batch.worlds[0].load(
        loop.position, loop.velocity, stop_time=duration, stop_status=Status.NOT_STEADY, softness=softness
    )
    batch.worlds[0].set_drive(
        sprocket_speed=-2 * np.pi * scene.frequency,
        loop_speed=other.loop_speed,
        loop_period=period_of(setup),
        load_factor=load_factor,
        steady_window=period_of(setup),
        steady_tolerance=1e-12,
        hold_softness=softness,
        loaded_softness=softness,
        push_rate=5e3,
    )
    pieces = run_recorded(batch, batch.features(fixed_body="sprocket"))
    assert batch.worlds[0].status == Status.NOT_STEADY
    rows, times, joints, _, _ = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
    since = duration - period_of(setup)
    shape = rows[rows[:, layout.TIME] > since][:, SHAPE].mean(axis=0)
    return np.append(shape, bottom_curvature(joints[times > since]))


def bottom_curvature(joints: Array, reach: int = 3) -> float:
    """Mean curvature [1/m] at the lowest joint: the turn from the chord before to that behind, by their length."""
    turns = []
    for frame in joints:
        lowest = int(np.argmin(frame[:, 1]))
        before, here, behind = (frame[(lowest + step) % len(frame)] for step in (-reach, 0, reach))
        first, second = here - before, behind - here
        turn = np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second)
        turns.append(abs(turn) / (np.hypot(*first) + np.hypot(*second)) * 2)
    return float(np.mean(turns))
