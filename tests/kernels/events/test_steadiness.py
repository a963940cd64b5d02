"""When a loop on its sprocket counts as stationary, and what is then released."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import warp as wp
from numpy.typing import NDArray

import warpchain
from tests.support.driven_loops import Loop, released_loop
from warpchain import InputError, Status, load_walk, preset
from warpchain.engine.batch import Batch
from warpchain.engine.control import push_rate, suitable_load
from warpchain.engine.devices import start_device
from warpchain.inputs.options import LONGEST_DRIVE_INTERVAL, Options
from warpchain.inputs.scene import Scene, fewest_links, greatest_load
from warpchain.kernels.events.release import (
    LEAST_LOAD,
    LITTLE_SLIP,
    LOADING_TIME,
    MOST_CROSSINGS,
    MOST_SLIP,
    SHORTEST_WINDOW,
    load_at,
    watch_steadiness,
)
from warpchain.kernels.events.summary import Summary
from warpchain.kernels.physics.scaled_loads import under_load
from warpchain.kernels.types import Drive, Model, State, read_chain
from warpchain.run.single_walk import setup_walk
from warpchain.walks import scheduler

Array = NDArray[np.float64]

SOFT = preset("soft")
CPU = start_device("cpu")
STEP = 1 / 1024  # s between two looks, of which sums are exact
HEIGHT, WIDTH, SPEED = 0.5, 0.125, 5.0
USUAL = {"height": HEIGHT, "width": WIDTH, "x": 0.01, "y": -0.2, "speed": SPEED}
SIZES = [("height", HEIGHT), ("width", WIDTH), ("x", WIDTH), ("y", HEIGHT)]
"""What is watched of a loop's shape, and what its changes are relative to."""
FALL = float(LOADING_TIME)


# --- the watch ---


@wp.kernel(module="unique", enable_backward=False)
def _watch(
    model: Model,
    drive: Drive,
    state: State,
    looks: wp.array2d(dtype=wp.float64),
    loads: wp.array(dtype=wp.float64),
):
    """One look after the other at chains that are what somebody says, as `record.sampling` has them."""
    for i in range(looks.shape[0]):
        time = looks[i, 0]
        summary = Summary()
        summary.height = looks[i, 1]
        summary.width = looks[i, 2]
        summary.center_x = looks[i, 3]
        summary.center_y = looks[i, 4]
        summary.loop_speed = looks[i, 5]
        chain = under_load(read_chain(model, 0), state.load_factor[0])
        watch_steadiness(chain, state, drive, 0, time, summary)
        state.load_factor[0] = load_at(state, drive, 0, time)
        loads[i] = state.load_factor[0]


@dataclass
class Watched:
    """A loop as it is seen at looks STEP apart, and the world that watches it.

    Attributes:
        duration: Of all looks [s].
        drive: What the world's drive says otherwise.
        loads: Factor of the loads after each look.
    """

    duration: float = 4.0
    drive: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make a world whose loop is held from 0.5 s on."""
        self.batch = Batch(1, 4, Options())
        self.batch.set_chain(0, SOFT, 4)
        self.batch.load(0, np.zeros((4, 3)), np.zeros((4, 3)), stop_time=30.0, stop_status=Status.NOT_STEADY)
        drive = {"hold_start": 0.5, "loop_speed": SPEED, "loop_period": 0.25, "load_factor": 16.0}
        drive |= {"steady_window": 0.125, "steady_time": -1.0, "steady_tolerance": 0.01}
        self.batch.set_drive(0, **drive | self.drive)
        self.time = STEP * np.arange(round(self.duration / STEP) + 1)
        self.loads = np.full(len(self.time), np.nan)

    def look(self, first: float = 0.0, last: float = math.inf, **seen: Any) -> "Watched":
        """Look from one time to before another at a loop that is HEIGHT, WIDTH and so on, unless one says otherwise."""
        of = (first - STEP / 2 < self.time) & (self.time < last - STEP / 2)
        time = self.time[of]
        rows = np.stack([time, *(np.broadcast_to(value, time.shape) for value in (USUAL | seen).values())], axis=1)
        loads = wp.full(len(rows), np.nan, dtype=wp.float64, device=CPU)
        looks = wp.array(rows, dtype=wp.float64, device=CPU)
        inputs = [self.batch.model, self.batch.drive, self.batch.state, looks, loads]
        wp.launch(_watch, dim=1, inputs=inputs, device=CPU)
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
        return self.batch.drift(0)


def crossing(load: float, gravity: float = SOFT.gravity) -> float:
    """2 ∫ dy / (√(v² + λ g (y + ρ/2)) − v) up to HEIGHT by Gauss and Legendre."""
    nodes, weights = np.polynomial.legendre.leggauss(100)
    pull = load * gravity * (HEIGHT / 2 * (nodes + 1) + SOFT.sprocket_radius / 2)
    return HEIGHT * float(weights @ ((np.sqrt(SPEED**2 + pull) + SPEED) / pull))


def first_sample(moment: float) -> float:
    """The first look at a moment or after it."""
    return math.ceil(moment / STEP - 1e-9) * STEP


def end_of_watch(start: float, window: float, wanted: float, since: float | None = None) -> float:
    """When the first window ends that is not before a time wanted.

    Args:
        start: Of the first window.
        window: Length of each.
        wanted: The time for which the shape must be kept.
        since: From when on it is counted; None: from the end of the first window.
    """
    length = first_sample(window)
    if since is None:
        since = start + length
        start = since
    return start + max(1, math.ceil((wanted + since - start) / length - 1e-9)) * length


def fall_of(load: float, start: float = 0.5) -> float:
    """When the loads of a loop that keeps its shape begin to fall."""
    return end_of_watch(start, max(float(SHORTEST_WINDOW), crossing(load) / 2), crossing(load))


def test_a_loop_that_keeps_its_shape_is_released_in_time() -> None:
    """Held for a window and a crossing under load, let down, watched for a period; then further_hold and the phase."""
    watched = Watched(drive={"further_hold": 0.75, "release_phase": 0.5}).look()
    time, loads = watched.time, watched.loads
    fall = fall_of(16.0)
    assert np.all(loads[time < 0.5] == 1.0)
    assert np.all(loads[(time >= 0.5) & (time < fall)] == 16.0)
    falling = (time >= fall) & (time < fall + FALL)
    assert loads[falling] == pytest.approx(16.0 ** (1 - (time[falling] - fall) / FALL), rel=1e-9)
    assert np.all(loads[time >= fall + FALL] == 1.0)
    watch = first_sample(fall + FALL) + STEP  # the look that makes it free is the last under load
    end = end_of_watch(watch, 0.125, 0.25, since=fall + FALL)
    assert watched.release == pytest.approx(end + 0.75 + 0.5 * 0.25, abs=1e-12)
    assert watched.drift == pytest.approx(0, abs=1e-12)


def test_steady_time_sets_how_long_a_free_loop_is_watched() -> None:
    """With a steady_time of 1 s instead of a period's 0.25 s the release is 0.75 s later; 0 takes one window."""
    by_itself, second, none = (
        Watched(drive={"steady_time": steady_time}).look().release for steady_time in (-1.0, 1.0, 0.0)
    )
    assert second - by_itself == 0.75
    assert by_itself - none == 0.125


def test_own_loads_are_watched_for_as_long_as_slow_waves_need() -> None:
    """With a factor of 1 there is one watch, of 6 s in this loop; a steady_time that is given overrides that."""
    watched = Watched(duration=8.0, drive={"load_factor": 1.0}).look()
    assert np.all(watched.loads == 1.0)
    assert 6.0 < crossing(1.0) < 6.2
    assert watched.release == end_of_watch(0.5, 0.125, crossing(1.0))
    given = Watched(drive={"load_factor": 1.0, "steady_time": 0.5}).look()
    assert given.release == end_of_watch(0.5, 0.125, 0.5)


@pytest.mark.parametrize("load_factor", [16.0, 1.0])
@pytest.mark.parametrize(("name", "size"), SIZES)
def test_a_loop_that_drifts_is_not_released(name: str, size: float, load_factor: float) -> None:
    """A drift by 3 % in a crossing is never let pass, one by 0.1 % is."""
    for part, is_released in ((0.03, False), (0.001, True)):
        watched = Watched(duration=10.0, drive={"load_factor": load_factor})
        rate = part * size / crossing(load_factor)
        watched.look(**{name: USUAL[name] + rate * (watched.time - 5.0)})
        assert math.isfinite(watched.release) == is_released, part


def test_a_loop_that_does_not_become_stationary_is_held_under_less() -> None:
    """A width that never stops growing under load is given up after some crossings, for the root of the load."""
    watched = Watched(duration=0.5 + 0.5 + float(MOST_CROSSINGS) * (crossing(16.0) + crossing(4.0)))
    watched.look(width=WIDTH * (1 + 0.03 * (watched.time - 5.0) / crossing(16.0)))
    change = watched.time[np.flatnonzero(np.diff(watched.loads))[1:] + 1]
    assert sorted(set(watched.loads)) == [1.0, 4.0, 16.0]
    given_up = 0.5 + float(MOST_CROSSINGS) * crossing(16.0)
    assert given_up <= change[0] <= given_up + crossing(16.0) / 2 + 2 * STEP
    given_up = change[0] + float(MOST_CROSSINGS) * crossing(4.0)
    assert len(change) == 1 or given_up <= change[1] <= given_up + crossing(4.0) / 2 + 2 * STEP
    assert math.isnan(watched.release)


def test_ripples_shorter_than_a_window_do_not_matter() -> None:
    """A width that ripples by a tenth as links pass is its mean: the loop is released when a smooth one is."""
    watched = Watched()
    ripple = WIDTH * (1 + 0.1 * np.sin(2 * np.pi * watched.time / 2.5e-3))
    assert watched.look(width=ripple).release == Watched().look().release


@pytest.mark.parametrize(("name", "size"), SIZES)
def test_drift_is_the_band_of_means_relative_to_height_or_width(name: str, size: float) -> None:
    """A step of half the tolerance when the loop becomes free is let pass, and told as what it is."""
    watched = Watched()
    moved = watched.time > fall_of(16.0) + 0.1
    watched.look(**{name: USUAL[name] + 0.005 * size * moved})
    assert math.isfinite(watched.release)
    assert watched.drift == pytest.approx(0.005, rel=0.006)


def test_a_loop_that_leaves_its_shape_when_free_is_held_under_the_root() -> None:
    """Whenever its loads have fallen its width jumps by 2 %: held under 16, then 4, then its own, and released."""
    assert 2 < float(LEAST_LOAD) < 4
    watched = Watched(duration=14.0)
    width, held = WIDTH, []
    before = 1.0
    for place, moment in enumerate(watched.time):
        watched.look(moment, moment + STEP, width=width)
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


@pytest.mark.parametrize("slip", [0.5, 0.9])
def test_a_loop_that_slips_a_little_is_released_as_one_that_does_not(slip: float) -> None:
    """Up to LITTLE_SLIP, some thousandths, nothing is different."""
    slow = Watched().look(speed=SPEED * (1 - slip * float(LITTLE_SLIP)))
    assert slow.release == Watched().look().release


@pytest.mark.parametrize("slip", [1.1 * float(LITTLE_SLIP), 0.2])
def test_a_free_loop_that_slips_more_is_watched_for_as_long_as_slow_waves_need(slip: float) -> None:
    """Beyond LITTLE_SLIP it is not released after a period, but after a crossing under its own loads."""
    watched = Watched(duration=10.0).look(speed=SPEED * (1 - slip))
    fall = fall_of(16.0)
    watch = first_sample(fall + FALL) + STEP
    assert watched.release == end_of_watch(watch, 0.125, crossing(1.0), since=fall + FALL)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_loop_that_slips_much_is_not_released(sign: int) -> None:
    """Slower or faster than its sprocket by more than MOST_SLIP it is never stationary."""
    for slip, is_released in ((float(MOST_SLIP) - 0.01, True), (float(MOST_SLIP) + 0.01, False)):
        watched = Watched(duration=10.0).look(speed=SPEED * (1 - sign * slip))
        assert math.isfinite(watched.release) == is_released


def test_a_loop_that_changes_its_speed_as_it_becomes_free_may() -> None:
    """Loaded loops slip more: what is watched of the speed of a free loop is its own."""
    watched = Watched()
    watched.look(speed=SPEED * (1 - 0.015 * (watched.time < fall_of(16.0) + 0.1)))
    assert watched.release == Watched().look().release


def test_a_loop_whose_speed_varies_is_not_released() -> None:
    """A speed that grows by 3 % in a crossing is not that of an even loop, though none of it is far off; 0.1 % is."""
    for part, is_released in ((0.03, False), (0.001, True)):
        watched = Watched(duration=3.0)
        watched.look(speed=SPEED * (1 + part * (watched.time - 1.5) / crossing(16.0)))
        assert math.isfinite(watched.release) == is_released


def test_a_standing_loop_is_released() -> None:
    """On a sprocket that stands still the speed may be anything below 2 cm/s."""
    drive = {"loop_speed": 0.0, "loop_period": 0.25}
    assert math.isfinite(Watched(drive=drive).look(speed=0.015).release)
    assert math.isnan(Watched(drive=drive).look(speed=0.025).release)


def test_what_happens_before_the_hold_does_not_matter() -> None:
    """However a loop swings while it spins up, the watch begins with the hold."""
    watched = Watched()
    early = watched.time < 0.5
    shape = {"height": HEIGHT * (1 + 0.5 * early), "width": WIDTH * (1 - 0.5 * early), "speed": SPEED * (1 - early)}
    assert watched.look(**shape).release == Watched().look().release


# --- whole drives ---


CELL = {"links": 60, "frequency": 15.0}


@pytest.fixture(scope="module")
def truth() -> Loop:
    """The loop of 60 links at 15 Hz after half a minute under its own loads."""
    undamped = {"load_factor": 1.0, "steady_time": 0.0, "steady_tolerance": 1.0, "further_hold": 25.0}
    return released_loop(start="spinning", **CELL, **undamped)


def assert_same_loop(ours: Loop, theirs: Loop, within: float = 0.005) -> None:
    """Height, width and centre agree to half a per cent of the loop's height or width."""
    height, width = theirs.shape[:2]
    assert ours.is_released and theirs.is_released
    change = np.abs(ours.shape - theirs.shape) / [height, width, width, height]
    assert np.all(change < within), change


@pytest.mark.slow
def test_an_undamped_hold_of_25_seconds_says_what_is_stationary(truth: Loop) -> None:
    """It was held for that long, and another 5 s change nothing."""
    assert 25 < truth.hold_time < 26
    longer = {"load_factor": 1.0, "steady_time": 0.0, "steady_tolerance": 1.0, "further_hold": 30.0}
    assert_same_loop(released_loop(start="rest", spin_up_time=0.5, **CELL, **longer), truth)


@pytest.mark.slow
@pytest.mark.parametrize("start", ["rest", "spinning"])
@pytest.mark.parametrize("chain", ["soft", "paper"])
def test_the_loop_that_is_released_is_the_stationary_one(chain: str, start: str, truth: Loop) -> None:
    """From rest or turning, on soft or stiff joints, it is that of the undamped hold, after a second or two."""
    found = released_loop(chain, start=start, **CELL)
    assert_same_loop(found, truth)
    assert 0.3 < found.hold_time < 2.5
    assert 0 < found.drift <= 0.01


def test_both_starts_release_the_same_loop() -> None:
    """60 links at 15 Hz spun up from rest, and placed turning, leave the sprocket in the same shape."""
    rest, spinning = (released_loop(start=start, **CELL) for start in ("rest", "spinning"))
    assert_same_loop(rest, spinning)
    assert rest.hold_time < 2.5 and spinning.hold_time < 2.5


def test_further_hold_prolongs_the_hold() -> None:
    """Half a second more of it is half a second more before the release, to the interval of looks."""
    usual, longer = (released_loop(start="spinning", **CELL, further_hold=hold) for hold in (0.0, 0.5))
    assert longer.hold_time - usual.hold_time == pytest.approx(0.5, abs=1e-9)
    assert longer.drift == usual.drift


TRIES_OF_SWINGING_RELEASES = {
    (60, 10.0): (21464, 65169),
    (60, 20.0): (24838, 61795),
    (60, 30.0): (29746, 59689),
    (120, 10.0): (74958, 85704),
    (120, 20.0): (59860, 78146),
    (120, 30.0): (60770, 74913),
    (180, 10.0): (101974, 180972),
    (180, 20.0): (80688, 96609),
    (180, 30.0): (90101, 92951),
}
"""Links, frequency → steps tried on the sprocket, from a turning start and from rest, by version 9 of the numerics.

It released loops once means over a loop period stayed within 1 %.
"""


@pytest.mark.parametrize("cell", TRIES_OF_SWINGING_RELEASES)
def test_a_drive_takes_no_more_steps_than_when_loops_were_released_swinging(cell: tuple[int, float]) -> None:
    """From a turning start it takes fewer, from rest at most a fifth more."""
    links, frequency = cell
    turning, hanging = TRIES_OF_SWINGING_RELEASES[cell]
    assert released_loop(links=links, frequency=frequency, start="spinning").attempts < turning
    assert released_loop(links=links, frequency=frequency, start="rest").attempts < 1.2 * hanging


def test_hold_time_and_drift_are_in_the_result_its_file_and_its_row(tmp_path: Path) -> None:
    """They are those of the drive, and come back from the file; without a sprocket there are none."""
    settings = {"start": "spinning", "method": "explicit", "walk_limit": 1e-3, **CELL}
    walk = warpchain.walk(preset="soft", **settings)
    drive = released_loop(start="spinning", **CELL)
    assert (walk.hold_time, walk.drift) == (drive.hold_time, drive.drift)
    assert walk.simulated_time == pytest.approx(walk.hold_time + walk.walk_time, abs=1e-12)
    walk.save(tmp_path / "walk.h5")
    again = load_walk(tmp_path / "walk.h5")
    assert (again.hold_time, again.drift) == (walk.hold_time, walk.drift)
    scene = {name: settings[name] for name in ("start", "walk_limit", *CELL)}
    content = {
        "version": 1,
        "name": "one",
        "seed": 1,
        "preset": "soft",
        "samples": 1,
        "distributions": {"all": "fixed"},
    }
    rows = warpchain.sweep(content | {"scene": scene, "options": {"method": "explicit"}}, tmp_path / "sweep")
    assert (rows.hold_time.item(), rows.drift.item()) == (walk.hold_time, walk.drift)
    ellipse = warpchain.walk(preset="soft", **settings | {"start": "ellipse"})
    assert math.isnan(ellipse.hold_time) and math.isnan(ellipse.drift)


def test_a_drive_depends_neither_on_its_launches_nor_on_its_neighbours(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops driven under several loads are released in the same state to the bit, however cut, in whatever batch."""
    cases = [
        {"links": 30, "frequency": 15.0},
        {"links": 44, "frequency": 10.0, "start": "rest", "settle_time": 0.1, "spin_up_time": 0.2},
        {"links": 36, "frequency": 20.0, "load_factor": 5.0, "further_hold": 0.05},
        {"links": 30, "frequency": 12.0, "load_factor": 1.0, "steady_time": 0.2, "steady_tolerance": 0.05},
    ]
    setups = [
        setup_walk("soft", {"method": "explicit", "start": "spinning", "walk_limit": 1e-3} | case, None)
        for case in cases
    ]

    def outcomes(attempts: int, slots: int) -> dict[int, tuple[Any, ...]]:
        monkeypatch.setitem(scheduler.ATTEMPTS, "cpu", attempts)
        found = {}
        for place, run in scheduler.run_setups(setups, slots=slots):
            assert run.status == Status.TIME_LIMIT
            found[place] = (run.hold_time, run.drift, run.drive_counts, run.energy(), run.raised)
        return found

    whole = outcomes(20_000, 1)
    assert all(hold_time > 0.2 for hold_time, *_ in whole.values())
    assert outcomes(501, 1) == whole
    assert outcomes(777, 3) == whole


@pytest.mark.parametrize(("links", "frequency"), [(60, 15.0), (180, 10.0)])
def test_loops_do_not_sink_into_a_sprocket_that_pushes(links: int, frequency: float) -> None:
    """Under fifty times the loads circles sink in by less than 0.1 mm, by a millimetre or more without the push."""
    depths = []
    for drive in ({}, {"push_rate": 0.0}):
        loop = released_loop(drive=drive, links=links, frequency=frequency, start="spinning")
        depths.append(loop.depth)
    assert depths[0] < 1e-4 < 1e-3 < depths[1]


@pytest.mark.parametrize(
    ("settings", "rate"),
    [
        ({"contact_step": 2e-5, "soft_contact_step": 5e-5, "soften_drive": True}, 5000.0),
        ({"contact_step": 2e-5, "soft_contact_step": 2e-4, "soften_drive": True}, 1250.0),
        ({"contact_step": 1e-4, "soft_contact_step": 2e-4, "soften_drive": False}, 2500.0),
    ],
)
def test_a_circle_is_pushed_out_by_a_quarter_of_its_depth_in_a_step(settings: dict[str, Any], rate: float) -> None:
    """In the longest step near a contact, though by no more than 5000 times its depth in a second."""
    assert push_rate(Options(**settings)) == pytest.approx(rate)


def test_loads_are_what_joints_bear() -> None:
    """Fifty times the loop's own, or as much as stretches joints by 1e-3; never less than its own."""
    soft, own = Options(method="explicit"), Options(method="reference")
    paper = preset("paper")
    bearable = 1e-3 * 1e7 * SOFT.link_length  # N
    assert suitable_load(paper, soft, bearable / 100) == suitable_load(paper, soft, 0.0) == 50.0
    assert suitable_load(paper, soft, bearable / 20) == pytest.approx(20.0)
    assert suitable_load(paper, own, bearable / 20) == 50.0  # a hundred times as stiff
    assert suitable_load(paper, soft, 3 * bearable) == 1.0
    assert suitable_load(paper.with_values(TENTH), soft, bearable / 100) == greatest_load(paper.with_values(TENTH))


# --- hard cases ---


FEWEST = fewest_links(Scene(), SOFT)
TENTH, TENFOLD = (
    {name: part * getattr(SOFT, name) for name in ("inner_inertia", "outer_inertia")} for part in (0.1, 10.0)
)
HARD = {
    "standing": {"links": 60, "frequency": 0.0},
    "fast": {"links": 180, "frequency": 60.0, "hold_limit": 3.0},
    "fewest": {"links": FEWEST, "frequency": 15.0, "hold_limit": 3.0},
    "long": {"links": 300, "frequency": 20.0, "hold_limit": 4.0},
    "point-like": {**CELL, **TENTH, "hold_limit": 3.0},
    "heavy turning": {**CELL, **TENFOLD, "hold_limit": 3.0},
    "weightless": {**CELL, "gravity": 0.0, "hold_limit": 1.0},
    "no friction in joints": {**CELL, "viscous_friction": 0.0, "coulomb_friction": 0.0, "hold_limit": 3.0},
    "heavily loaded": {**CELL, "load_factor": 1000.0, "hold_limit": 3.0},
}


SURE = {
    **dict.fromkeys(("standing", "fewest", "long", "heavily loaded"), Status.TIME_LIMIT),
    "weightless": Status.NOT_STEADY,
}
"""Those whose end is known: released, the walk then stopped at once; or nothing that slow waves could cross."""


@pytest.mark.slow
@pytest.mark.parametrize("start", ["rest", "spinning"])
@pytest.mark.parametrize("name", HARD)
def test_hard_holds_end_in_a_release_or_as_not_steady(name: str, start: str) -> None:
    """Whatever is held, it ends released or, at its limit, as not steady, and no number is lost."""
    settings = {"method": "explicit", "start": start, "walk_limit": 1e-3, "frame_interval": 1e-3, **HARD[name]}
    expected = SURE.get(name)
    walk = warpchain.walk(preset="soft", **settings)
    assert walk.status in ((Status.TIME_LIMIT, Status.NOT_STEADY) if expected is None else (expected,))
    limit = settings.get("hold_limit", 30.0)
    if walk.status == Status.NOT_STEADY:
        assert walk.hold_time == pytest.approx(limit, abs=1e-9)
    else:
        assert 0 < walk.hold_time < limit
        assert 0 <= walk.drift <= 0.01
        assert np.all(np.isfinite(walk.frame_joints))
        assert np.all(np.isfinite(walk.center)) and np.all(np.isfinite(walk.kinetic_energy))
    assert math.isfinite(walk.greatest_opening)


@pytest.mark.slow
def test_loops_of_point_like_links_are_released_alike_from_both_starts() -> None:
    """Loads that are hardly multiplied and long watches, of 10 s, lead to one loop as well."""
    rest, spinning = (released_loop(start=start, **CELL, **TENTH) for start in ("rest", "spinning"))
    assert_same_loop(rest, spinning)
    assert min(rest.hold_time, spinning.hold_time) > 3


def test_point_like_links_bear_less_load() -> None:
    """Links of a tenth of the inertia keep half of it: λ = 1 + I / 2 (m ℓ²/6 − I) of the kind that bears least."""
    limits = []
    for kind in ("inner", "outer"):
        inertia = TENTH[f"{kind}_inertia"]
        missing = getattr(SOFT, f"{kind}_mass") * SOFT.link_length**2 / 6 - inertia
        limits.append(1 + inertia / (2 * missing))
    found = greatest_load(SOFT.with_values(TENTH))
    assert found == pytest.approx(min(limits), rel=1e-12) and 1 < found < 2
    assert greatest_load(SOFT) == math.inf


@pytest.mark.parametrize("load_factor", [0.5, 1e5, math.nan, "much"])
def test_factors_that_cannot_be_are_refused(load_factor: Any) -> None:
    """Loads are multiplied by 1 to 10 000, or by what suits the chain."""
    with pytest.raises(InputError, match=r"^scene\.load_factor: "):
        setup_walk("soft", {"load_factor": load_factor}, None)


def test_factors_that_links_cannot_bear_are_refused() -> None:
    """Point-like links may be given as much as leaves them half of their inertia; an ellipse is never loaded."""
    most = greatest_load(SOFT.with_values(TENTH))
    setup_walk("soft", TENTH | {"load_factor": 0.999 * most}, None)
    with pytest.raises(
        InputError, match=r"^scene\.load_factor: 15 is too much for links .*; give at most 1\.\d+, or null$"
    ):
        setup_walk("soft", TENTH | {"load_factor": 15.0}, None)
    setup_walk("soft", TENTH | {"load_factor": 15.0, "start": "ellipse"}, None)


def test_looks_too_far_apart_for_loads_to_fall_are_refused() -> None:
    """Loads change at looks: unless there is nothing to change, these may be 2 ms apart at most."""
    coarse = {"record_interval": 1.1 * LONGEST_DRIVE_INTERVAL, "soften_drive": False}
    with pytest.raises(
        InputError, match=r"^options\.record_interval: loads on the sprocket .*or scene\.load_factor: 1$"
    ):
        setup_walk("soft", coarse, None)
    setup_walk("soft", coarse | {"load_factor": 1.0}, None)
    setup_walk("soft", coarse | {"start": "ellipse"}, None)
    setup_walk("soft", coarse | {"record_interval": LONGEST_DRIVE_INTERVAL}, None)
