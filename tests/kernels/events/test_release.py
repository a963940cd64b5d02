"""When a loop on its sprocket counts as stationary: the release rule, fed with made-up samples."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
import warp as wp

from tests.support.presets import SOFT
from warpchain import Status
from warpchain.engine.batch import Batch
from warpchain.engine.devices import start_device
from warpchain.inputs.options import Options
from warpchain.kernels import layout
from warpchain.kernels.events.release import (
    LEAST_LOAD,
    LOADING_TIME,
    MOST_SLIP,
    SHORTEST_WINDOW,
    load_at,
    watch_steadiness,
)
from warpchain.kernels.physics.scaled_loads import under_load
from warpchain.kernels.types import Worlds

CPU = start_device("cpu").warp
STEP = 1 / 1024  # s between two samples; sums of it are exact
HEIGHT, WIDTH, SPEED = 0.5, 0.125, 5.0
USUAL = {"height": HEIGHT, "width": WIDTH, "x": 0.01, "y": -0.2, "speed": SPEED}
SIZES = [("height", HEIGHT), ("width", WIDTH), ("x", WIDTH), ("y", HEIGHT)]
"""What is watched of a loop's shape, and what its changes are relative to."""
FALL = float(LOADING_TIME)


@wp.kernel(module="unique", enable_backward=False)
def _watch(worlds: Worlds, samples: wp.array2d(dtype=wp.float64), loads: wp.array(dtype=wp.float64)):
    """Feeds one made-up sample after the other to the release rule, as `events.sample` does."""
    for i in range(samples.shape[0]):
        time = samples[i, layout.TIME]
        chain = under_load(worlds.model.chains[0], worlds.load_factor[0])
        watch_steadiness(chain, worlds, 0, samples[i])
        worlds.load_factor[0] = load_at(worlds, 0, time)
        loads[i] = worlds.load_factor[0]


@dataclass
class Watched:
    """A loop that is sampled every STEP, and the world that watches it.

    `drive` has fields of the world's drive that are not the usual ones, `loads` the factor of the loads after each
    sample.
    """

    duration: float = 4.0
    drive: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make a world whose loop is held from 0.5 s on."""
        self.batch = Batch(1, 4, Options())
        self.batch.worlds[0].set_chain(SOFT, 4)
        self.batch.worlds[0].load(np.zeros((4, 3)), np.zeros((4, 3)), stop_time=30.0, stop_status=Status.NOT_STEADY)
        drive = {"hold_start": 0.5, "loop_speed": SPEED, "loop_period": 0.25, "load_factor": 16.0}
        drive |= {"steady_window": 0.125, "steady_time": -1.0, "steady_tolerance": 0.01}
        self.batch.worlds[0].set_drive(**drive | self.drive)
        self.time = STEP * np.arange(round(self.duration / STEP) + 1)
        self.loads = np.full(len(self.time), np.nan)

    def sample(self, first: float = 0.0, last: float = math.inf, **seen: Any) -> "Watched":
        """Samples from one time to before another of a loop that is as usual, except for the quantities given."""
        of = (first - STEP / 2 < self.time) & (self.time < last - STEP / 2)
        time = self.time[of]
        rows = np.zeros((len(time), layout.SAMPLE_COLUMNS))
        rows[:, layout.TIME] = time
        for column, value in zip(layout.WATCHED_COLUMNS, (USUAL | seen).values(), strict=True):
            rows[:, column] = value
        loads = wp.full(len(rows), np.nan, dtype=wp.float64, device=CPU)
        samples = wp.array(rows, dtype=wp.float64, device=CPU)
        wp.launch(_watch, dim=1, inputs=[self.batch.state, samples, loads], device=CPU)
        self.loads[of] = loads.numpy()
        return self

    @property
    def release(self) -> float:
        """Moment [s] of the release; NaN if none is set."""
        is_set = self.batch.state.stop_status.numpy()[0] == Status.FINISHED
        return float(self.batch.state.stop_time.numpy()[0]) if is_set else math.nan

    @property
    def drift(self) -> float:
        """DRIFT of the watch."""
        return self.batch.worlds[0].watched(layout.DRIFT)


def crossing(load: float, gravity: float = SOFT.gravity) -> float:
    """2 ∫ dy / (√(v² + λ g (y + ρ/2)) − v) up to HEIGHT by Gauss and Legendre."""
    nodes, weights = np.polynomial.legendre.leggauss(100)
    pull = load * gravity * (HEIGHT / 2 * (nodes + 1) + SOFT.sprocket_radius / 2)
    return HEIGHT * float(weights @ ((np.sqrt(SPEED**2 + pull) + SPEED) / pull))


def first_sample(moment: float) -> float:
    """Time of the first sample at a moment or after it."""
    return math.ceil(moment / STEP - 1e-9) * STEP


def end_of_watch(start: float, window: float, wanted: float, since: float | None = None) -> float:
    """When the first window ends that is not before a time wanted, for which the shape must be kept.

    The time is counted from `since`, or from the end of the first window.
    """
    length = first_sample(window)
    if since is None:
        since = start + length
        start = since
    return start + max(1, math.ceil((wanted + since - start) / length - 1e-9)) * length


def test_a_loop_that_keeps_its_shape_is_released_in_time() -> None:
    """Held for a window and a crossing under load, let down, watched for a period; then extra_hold and the phase."""
    watched = Watched(drive={"extra_hold": 0.75, "release_phase": 0.5}).sample()
    time, loads = watched.time, watched.loads
    fall = end_of_watch(0.5, max(float(SHORTEST_WINDOW), crossing(16.0) / 2), crossing(16.0))
    assert np.all(loads[time < 0.5] == 1.0)
    assert np.all(loads[(time >= 0.5) & (time < fall)] == 16.0)
    falling = (time >= fall) & (time < fall + FALL)
    assert loads[falling] == pytest.approx(16.0 ** (1 - (time[falling] - fall) / FALL), rel=1e-9)
    assert np.all(loads[time >= fall + FALL] == 1.0)
    watch = first_sample(fall + FALL) + STEP  # the sample that makes it free is the last under load
    end = end_of_watch(watch, 0.125, 0.25, since=fall + FALL)
    assert watched.release == pytest.approx(end + 0.75 + 0.5 * 0.25, abs=1e-12)
    assert watched.drift == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("load_factor", [16.0, 1.0])
@pytest.mark.parametrize(("name", "size"), SIZES)
def test_a_loop_that_drifts_is_not_released(name: str, size: float, load_factor: float) -> None:
    """A drift by 3 % in a crossing is never let pass, one by 0.1 % is."""
    for part, is_released in ((0.03, False), (0.001, True)):
        watched = Watched(duration=10.0, drive={"load_factor": load_factor})
        rate = part * size / crossing(load_factor)
        watched.sample(**{name: USUAL[name] + rate * (watched.time - 5.0)})
        assert math.isfinite(watched.release) == is_released, part


def test_a_loop_that_leaves_its_shape_when_free_is_held_under_the_root() -> None:
    """Whenever its loads have fallen its width jumps by 2 %: held under 16, then 4, then its own, and released."""
    assert 2 < float(LEAST_LOAD) < 4
    watched = Watched(duration=14.0)
    width, held = WIDTH, []
    before = 1.0
    for place, moment in enumerate(watched.time):
        watched.sample(moment, moment + STEP, width=width)
        load = watched.loads[place]
        if load > before:
            held.append(load)
        if load == 1.0 < before:
            width *= 1.02
        before = load
        if math.isfinite(watched.release):
            break
    assert held == [16.0, 4.0]
    free = watched.time[np.flatnonzero(watched.loads > 1)[-1]]
    assert crossing(1.0) < watched.release - free < crossing(1.0) + 0.5
    assert watched.release == moment


@pytest.mark.parametrize("sign", [1, -1])
def test_a_loop_that_slips_much_is_not_released(sign: int) -> None:
    """Slower or faster than its sprocket by more than MOST_SLIP it is never stationary."""
    for slip, is_released in ((float(MOST_SLIP) - 0.01, True), (float(MOST_SLIP) + 0.01, False)):
        watched = Watched(duration=10.0).sample(speed=SPEED * (1 - sign * slip))
        assert math.isfinite(watched.release) == is_released
