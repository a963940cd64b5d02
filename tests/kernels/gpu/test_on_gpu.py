"""What a GPU computes, and all that the host does for it. Without a GPU, the host's part runs on CPU fibers.

Numbers of real walks and comparisons with the CPU need a GPU, and are skipped where there is none. With one, nothing
here needs a Warp that can compile for the CPU, except the tests that compare with it.
"""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import warp as wp
import yaml

from tests.kernels.methods.test_flight import FLIGHTS, exact_flight, greatest
from tests.run.test_sweep_run import brief_setup, data_of, outcomes
from tests.support.blocks_under_test import FIXED_STEP, HILLS, SOFT, floor_with, heap
from warpchain import simulate, sweep, walk
from warpchain.chain.sprocket_motion import motion_rows
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.kernels.physics import elementary
from warpchain.run.workers import gpu_workers
from warpchain.status import Status
from warpchain.walks import scheduler

LINKS, STEPS = 60, 300


def fixed_steps(device: str, method: str, fixed_body: str) -> dict[str, np.ndarray]:
    """State and counters of two heaps in which everything touches everything, after steps of equal length."""
    options = Options(method=method, tolerance=0.1, device=device, precision="double")
    batch = Batch(2, LINKS, options, faces=len(HILLS) - 1)
    batch.control.skin = 1e-9  # so that no step may be longer than …
    batch.control.contact_step = FIXED_STEP
    for world in range(2):
        position, velocity = heap(LINKS, 3 + world, tilt=0.3 + world)
        if fixed_body == "sprocket":
            position[:, 1] += 0.9 * SOFT.sprocket_radius
        batch.worlds[world].set_chain(SOFT, LINKS)
        points = HILLS if fixed_body == "terrain" else HILLS[[0, -1]]
        batch.worlds[world].set_floor(floor_with(points, SOFT))
        batch.worlds[world].load(position, velocity, stop_time=STEPS * FIXED_STEP, stop_status=Status.FINISHED)
        batch.worlds[world].set_drive(sprocket_speed=-50.0)
        batch.worlds[world].set_drive(motion=motion_rows(((0.01, 0.002, -0.01, 5.0),), 8.0, 0.02))
        batch.worlds[world].set_state(step=FIXED_STEP)
    moves = fixed_body == "floor and sprocket"
    batch.run(range(2), batch.features(fixed_body="floor" if moves else fixed_body, moving_sprocket=moves))
    worlds = range(2)
    return {
        "position": np.array([batch.worlds[world].position for world in worlds]),
        "velocity": np.array([batch.worlds[world].velocity for world in worlds]),
        "counts": np.array([list(batch.worlds[world].counts.values()) for world in worlds]),
    }


def compare(ours: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> float:
    """Greatest difference of positions and velocities, of the greatest value of each."""
    assert (theirs["counts"][:, 0] == STEPS).all()
    assert (theirs["counts"][:, 4] > 100).all(), "self-impulses"
    assert (theirs["counts"][:, 2] + theirs["counts"][:, 3] > 50).all(), "impulses with floor or sprocket"
    assert np.array_equal(ours["counts"], theirs["counts"])
    names = ("position", "velocity")
    return max(np.abs(ours[name] - theirs[name]).max() / np.abs(theirs[name]).max() for name in names)


@wp.kernel(module="unique", enable_backward=False)
def divide_and_root(a: wp.array(dtype=wp.float64), b: wp.array(dtype=wp.float64), found: wp.array2d(dtype=wp.float64)):
    """Functions for which a GPU has instructions of its own."""
    i = wp.tid()
    found[0, i] = elementary.quotient(a[i], b[i])
    found[1, i] = elementary.reciprocal(b[i])
    found[2, i] = elementary.square_root(wp.abs(b[i]))
    found[3, i] = elementary.tanh(b[i])


CASES = [("rkf78", "floor"), ("dp5", "sprocket"), ("bs32", "floor"), ("os32", "floor"), ("dp5", "floor")]
CASES += [("os32", "slope"), ("os32", "terrain")]


@pytest.fixture
def device() -> str:
    """The first GPU, or CPU fibers where there is none."""
    return "cuda" if wp.is_cuda_available() else "fibers"


@pytest.fixture
def gpu() -> None:
    """Skips where there is none."""
    if not wp.is_cuda_available():
        pytest.skip("no GPU")


@pytest.fixture
def cpu() -> None:
    """Skips where Warp came without its CPU compiler, as on machines that have GPUs only."""
    if not wp.is_cpu_available():
        pytest.skip("this Warp cannot compile for the CPU, which is compared with")


def test_quotients_and_roots_are_exact_to_rounding() -> None:
    """Quotients, reciprocals and roots err by at most two units in the last place, tanh by 2e-15; √0 is nearly 0."""
    rng = np.random.default_rng(1)
    a, b = (rng.choice([-1.0, 1.0], 100_000) * 10.0 ** rng.uniform(-60, 60, 100_000) for _ in range(2))
    where = "cuda" if wp.is_cuda_available() else "cpu"
    inputs = (wp.array(each, dtype=wp.float64, device=where) for each in (a, b))
    found = wp.zeros((4, len(a)), dtype=wp.float64, device=where)
    wp.launch(divide_and_root, len(a), [*inputs, found], device=where)
    quotient, reciprocal, root, tanh = found.numpy()
    for ours, exact, units in ((quotient, a / b, 1), (reciprocal, 1 / b, 2), (root, np.sqrt(np.abs(b)), 1)):
        assert (np.abs(ours - exact) <= units * np.spacing(np.abs(exact))).all()
    np.testing.assert_allclose(tanh, np.tanh(b), rtol=0, atol=2e-15)
    nothing = wp.zeros(1, dtype=wp.float64, device=where)
    wp.launch(divide_and_root, 1, [nothing, nothing, found], device=where)
    assert 0.0 <= found.numpy()[2, 0] <= 1e-140


@pytest.mark.usefixtures("gpu", "cpu")
@pytest.mark.parametrize(("method", "fixed_body"), CASES)
def test_fixed_steps_agree_with_the_cpu(method: str, fixed_body: str) -> None:
    """Three hundred steps with hundreds of impulses end in the same state, to 1e-9."""
    assert compare(fixed_steps("cuda", method, fixed_body), fixed_steps("cpu", method, fixed_body)) < 1e-9


@pytest.mark.usefixtures("cpu")
def test_a_moving_sprocket_is_the_same_on_both(device: str) -> None:
    """Above a floor, with which the chain collides as well, blocks end in the state of a CPU, to 1e-9."""
    ours, theirs = (fixed_steps(each, "os32", "floor and sprocket") for each in (device, "cpu"))
    assert compare(ours, theirs) < 1e-9
    assert (theirs["counts"][:, 2:4] > 50).all()


def test_a_walk_gives_the_same_bits_in_any_batch(device: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Alone, among others of other lengths, in few or many slots and launches, after whatever ran before."""
    setups = [brief_setup(seed, links=links, device=device) for seed in range(3) for links in (30, 60)]
    together = outcomes(setups)
    assert [outcomes([setup])[0] for setup in setups] == together
    assert outcomes(setups[::-1], slots=2)[::-1] == together
    monkeypatch.setattr(scheduler, "SHARED_WALKS", 0)
    assert outcomes(setups) == together
    monkeypatch.setattr("warpchain.engine.batch.LAUNCH_SECONDS", 0.0)
    assert outcomes(setups * 3) == together * 3


@pytest.mark.usefixtures("gpu")
@pytest.mark.parametrize("method", ["explicit", "rkf78", "dp5", "bs32"])
def test_a_walk_gives_the_same_bits_in_any_block(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the block of its own size, or in one that it shares with the longest chain."""
    setups = [brief_setup(links, links=links, device="cuda", method=method) for links in (30, 90, 180)]
    shared = outcomes(setups)
    monkeypatch.setattr(scheduler, "SHARED_WALKS", 0)
    assert outcomes(setups) == shared


def test_memory_that_holds_few_chains_only_takes_longer(device: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where memory is short, walks are computed in turn."""
    setups = [brief_setup(seed, device=device) for seed in range(5)]
    together = outcomes(setups)
    monkeypatch.setattr(scheduler, "most_worlds", lambda *_, **__: 2)
    assert outcomes(setups) == together


def content_of(device: str, long: float) -> dict[str, object]:
    """A sweep that needs several kernels: walks that fly, briefly or long [s], or lean, and loops on the sprocket."""
    scene = {"links": 30, "frequency": 12.0, "start": "ellipse"}
    return {
        "version": 1,
        "name": "several kernels",
        "seed": 1,
        "preset": "soft",
        "samples": 20 if device == "cuda" else 10,
        "scene": scene,
        "options": {"method": "os32", "tolerance": 1e-5, "rest_time": 100.0, "device": device},
        "blocks": [
            {"name": "flying", "grid": {"walk_limit": [0.002, long]}},
            {"name": "leaning", "scene": {"plane": "tilting", "tilt": 0.1, "clearance": 1e-4, "walk_limit": 0.01}},
            {"name": "driven", "scene": {"start": "spinning", "hold_limit": 0.002}},
        ],
        "record": {"series": {"samples": [0]}, "frames": {"interval": 0.002, "samples": [0]}},
    }


def broken_off(source: Path, folder: Path, how: signal.Signals) -> int:
    """Run a sweep in a process of its own, send it a signal when two shards are there; its exit status."""
    process = subprocess.Popen(
        [sys.executable, "-m", "warpchain", "sweep", str(source), "-o", str(folder), "--workers", "2"],
        stdout=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    try:
        until = time.monotonic() + 120
        while len(list((folder / "shards").glob("[0-9]*.h5"))) < 2:
            assert process.poll() is None, "it ended by itself"
            assert time.monotonic() < until, "no shards"
            time.sleep(0.005)
        process.send_signal(how)
        return process.wait(60)
    finally:
        process.kill()
        process.wait()


def test_a_sweep_gives_the_same_bytes_however_it_is_run(device: str, tmp_path: Path) -> None:
    """In this process, by a worker of a GPU, or ended by Ctrl-C or killed and begun again; its series are a walk's."""
    content = content_of(device, long=1.0 if device == "cuda" else 0.04)
    samples = content["samples"]
    source = tmp_path / "sweep.yaml"
    source.write_text(yaml.safe_dump(content, sort_keys=False))
    whole = sweep(source, tmp_path / "whole")
    assert whole.summary() == {"time_limit": 3 * samples, "not_steady": samples, "at_rest": 0, "missing": 0}
    assert whole.blocks["leaning"].greatest_tilt.max() > 0.1004
    expected = data_of(tmp_path / "whole")
    with gpu_workers(1) as executor:
        sweep(source, tmp_path / "worker", executor=executor, workers=1)
    assert data_of(tmp_path / "worker") == expected
    for how, status in ((signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)):
        cut = tmp_path / how.name
        assert broken_off(source, cut, how) == status
        kept = data_of(cut)
        assert 2 <= len(kept) < len(expected)
        assert kept.items() <= expected.items()
        sweep(source, cut)
        assert data_of(cut) == expected

    series = whole.blocks["flying"].series(walk_limit=0.002, sample=0)
    alone = walk(preset="soft", seed=1, walk_limit=0.002, **content["scene"], **content["options"])
    assert len(series.time) == 3
    assert np.array_equal(series.time, alone.time)
    assert np.array_equal(series.center, alone.center)


@pytest.mark.usefixtures("gpu")
@pytest.mark.parametrize(("method", "within"), [("rkf78", 1e-8), ("dp5", 1e-8), ("bs32", 1e-7), ("os32", 1e-7)])
@pytest.mark.parametrize("name", FLIGHTS)
def test_flights_agree_with_scipy(name: str, method: str, within: float) -> None:
    """At tolerance 1e-9 a flight with friction and damping agrees with DOP853 to 1e-8, rates of order 3 to 1e-7."""
    start, (position, velocity) = exact_flight(name)
    settings = {"method": method, "tolerance": 1e-9, "device": "cuda"}
    flight = simulate(name, *start, FLIGHTS[name], times=[FLIGHTS[name]], **settings)
    assert flight.status == Status.FINISHED
    assert greatest(flight.position[-1], position) < 1e-8
    assert greatest(flight.velocity[-1], velocity) < within
    assert flight.losses["joint_friction"] > 1e-4


@pytest.mark.parametrize("name", FLIGHTS)
def test_flights_in_mixed_precision_follow_the_tolerance(name: str, device: str) -> None:
    """At tolerance 1e-6, the least for steps in mixed precision, places agree with DOP853 to 1e-6."""
    start, (position, _) = exact_flight(name)
    settings = {"method": "os32", "tolerance": 1e-6, "precision": "mixed", "device": device}
    flight = simulate(name, *start, FLIGHTS[name], times=[FLIGHTS[name]], **settings)
    assert flight.status == Status.FINISHED
    assert greatest(flight.position[-1], position) < 1e-6


@pytest.mark.usefixtures("gpu")
def test_a_walk_comes_to_rest_and_its_ledger_closes() -> None:
    """Spun up, released, walked and at rest: the distance is that of such chains, no energy is unaccounted for."""
    found = walk(preset="soft", links=60, frequency=15.0, start="spinning", device="cuda")
    assert found.status == Status.AT_REST
    assert 0.5 < found.dx < 0.85
    energy = found.energy
    at_release = energy["kinetic_at_release"] + energy["potential_at_release"]
    assert abs(energy["residual"]) < 5e-4 * at_release
    assert found.impulses["floor"] > 1000
