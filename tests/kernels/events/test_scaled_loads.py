"""Multiplied loads on the sprocket: the loop is the same under them."""

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.inputs.scene import contact_radius, loop_speed
from warpchain.inputs.setup import Setup
from warpchain.kernels import layout
from warpchain.run.single_walk import setup_walk
from warpchain.status import Status
from warpchain.walks.walk_phases import Phase, WalkRun

Array = NDArray[np.float64]


def released_loop(setup: Setup) -> tuple[Array, Array]:
    """Position and velocity (n, 3) of a walk's loop as it leaves its sprocket."""
    batch = Batch(1, setup.scene.links, setup.options)
    run = WalkRun(batch, 0, setup)
    while True:
        batch.run([0], run.features)
        position, velocity = batch.position(0), batch.velocity(0)
        assert run.next_phase()
        if run.phase == Phase.WALK:
            return position, velocity


def held_on(setup: Setup, position: Array, velocity: Array, duration: float, load_factor: float) -> Array:
    """Hold a loop on for a time [s]: height, width, x, y of its centre [m] and its curvature at the bottom [1/m], (5,).

    They are means over the last time round.
    """
    scene, parameters = setup.scene, setup.parameters
    speed = loop_speed(scene, parameters)
    period = scene.links * parameters.link_length / speed
    batch = Batch(1, scene.links, setup.options, keeps_samples=True, frame_every=1)
    batch.set_chain(0, parameters, scene.links, contact_radius(scene, parameters))
    batch.load(0, position, velocity, stop_time=duration, stop_status=Status.NOT_STEADY, softness=1.0)
    batch.set_drive(
        0,
        sprocket_speed=-2 * np.pi * scene.frequency,
        loop_speed=speed,
        loop_period=period,
        load_factor=load_factor,
        steady_window=period,
        steady_tolerance=1e-12,
        hold_softness=1.0,
        loaded_softness=1.0,
        push_rate=5e3,
    )
    drained: list[tuple[Array, Array, Array]] = []
    batch.run(
        [0],
        batch.features(fixed_body="sprocket"),
        lambda: drained.append((batch.drain_samples(0), *batch.drain_frames(0))),
    )
    assert batch.status(0) == Status.NOT_STEADY
    rows, times, joints = (np.concatenate(parts) for parts in zip(*drained, strict=True))
    columns = (layout.HEIGHT, layout.WIDTH, layout.CENTER_X, layout.CENTER_Y)
    shape = rows[rows[:, layout.TIME] > duration - period][:, columns].mean(axis=0)
    return np.append(shape, np.mean([bottom_curvature(frame) for frame in joints[times > duration - period]]))


def bottom_curvature(joints: Array, reach: int = 3) -> float:
    """Turn from the chord of so many links before the lowest joint (n, 2) to that behind it, by their length [1/m]."""
    lowest = int(np.argmin(joints[:, 1]))
    before, here, behind = (joints[(lowest + step) % len(joints)] for step in (-reach, 0, reach))
    first, second = here - before, behind - here
    turn = np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second)
    return float(abs(turn) / (np.hypot(*first) + np.hypot(*second)) * 2)


def test_a_stationary_loop_stays_as_it_is_under_load() -> None:
    """Under loads that are 15 times as great, drag and all, it keeps height, width and curvature."""
    settings = {"links": 60, "frequency": 20.0, "start": "spinning", "method": "explicit", "soften_drive": True}
    setup = setup_walk("soft", settings, None)
    loop = released_loop(setup)
    own, loaded = (held_on(setup, *loop, 0.5, load_factor) for load_factor in (1.0, 15.0))
    height, width, curvature = own[[0, 1, 4]]
    change = np.abs(loaded - own) / [height, width, width, height, curvature]
    assert np.all(change < [0.002, 0.005, 0.003, 0.002, 0.01]), change
