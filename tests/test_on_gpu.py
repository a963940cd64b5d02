"""What can only be seen on a GPU; skipped where there is none, for what is shared with the CPU is tested there."""

from pathlib import Path

import numpy as np
import pytest
import warp as wp

from tests.blocks_under_test import FIXED_STEP, SOFT, heap
from tests.test_block_hybrid import PAPER, bouncing
from tests.test_hybrid import falling
from tests.test_runner import brief_setup, data_of, outcomes
from warpchain import ensemble, simulate, sweep, walk
from warpchain.engine import Batch
from warpchain.options import Options
from warpchain.status import Status

LINKS, STEPS = 60, 300


def fixed_steps(device: str, method: str, fixed_body: str) -> dict[str, np.ndarray]:
    """State and counters of two heaps in which everything touches everything, after steps of equal length."""
    batch = Batch(2, LINKS, Options(method=method, tolerance=0.1, device=device))
    batch.control.skin = 1e-9  # so that no step may be longer than …
    batch.control.contact_step = FIXED_STEP
    for world in range(2):
        position, velocity = heap(LINKS, 3 + world, tilt=0.3 + world)
        if fixed_body == "sprocket":
            position[:, 1] += 0.9 * SOFT.sprocket_radius
        batch.set_chain(world, SOFT, LINKS)
        batch.load(world, position, velocity, stop_time=STEPS * FIXED_STEP, stop_status=Status.FINISHED)
        batch.set_program(world, sprocket_speed=-50.0)
        batch._edit(batch.state.step)[world] = FIXED_STEP
    batch.run(range(2), batch.features(fixed_body=fixed_body, watch="none"))
    worlds = range(2)
    return {
        "position": np.array([batch.position(world) for world in worlds]),
        "velocity": np.array([batch.velocity(world) for world in worlds]),
        "counts": np.array([list(batch.counts(world).values()) for world in worlds]),
    }


def compare(ours: dict[str, np.ndarray], theirs: dict[str, np.ndarray]) -> float:
    """Greatest difference of positions and velocities, of the greatest value of each."""
    assert (theirs["counts"][:, 0] == STEPS).all()
    assert (theirs["counts"][:, 4] > 100).all(), "self-impulses"
    assert (theirs["counts"][:, 2] + theirs["counts"][:, 3] > 50).all(), "impulses with floor or sprocket"
    assert np.array_equal(ours["counts"], theirs["counts"])
    names = ("position", "velocity")
    return max(np.abs(ours[name] - theirs[name]).max() / np.abs(theirs[name]).max() for name in names)


CASES = [("rkf78", "floor"), ("dp5", "sprocket"), ("bs32", "floor"), ("dp5", "floor")]


@pytest.fixture(autouse=True)
def gpu() -> None:
    """Skips where there is none."""
    if not wp.is_cuda_available():
        pytest.skip("no GPU")


@pytest.mark.parametrize(("method", "fixed_body"), CASES)
def test_fixed_steps_agree_with_the_cpu(method: str, fixed_body: str) -> None:
    """Three hundred steps with hundreds of impulses end in the same state, to 1e-9."""
    assert compare(fixed_steps("cuda", method, fixed_body), fixed_steps("cpu", method, fixed_body)) < 1e-9


@pytest.mark.parametrize("method", ["dp5", "hybrid"])
def test_a_walk_gives_the_same_bits_in_any_batch(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Alone, among others of other lengths, in few or many slots and launches, after whatever ran before."""
    settings = {"device": "cuda", "method": method}
    setups = [brief_setup(seed, links=links, **settings) for seed in range(3) for links in (30, 60, 90)]
    together = outcomes(setups)
    assert [outcomes([setup])[0] for setup in setups] == together
    assert outcomes(setups[::-1], slots=2)[::-1] == together
    monkeypatch.setattr("warpchain.engine.LAUNCH_SECONDS", 0.0)
    assert outcomes(setups * 3) == together * 3


def test_flights_and_landings_agree_with_the_cpu() -> None:
    """Chains that fly on rigid joints, land, bounce on their springs and fly again, to 1e-6."""
    batches = []
    for device in ("cuda", "cpu"):
        batch, features = bouncing([falling(12, PAPER, 0.3), falling(60, PAPER, 0.6)], device=device)
        batch.launch(range(2), features, 240)
        batches.append(batch)
    ours, theirs = batches
    for world in range(2):
        assert theirs.losses(world)["hand_over"] != 0.0
        assert ours.counts(world) == theirs.counts(world)
        assert np.abs(ours.position(world) - theirs.position(world)).max() < 1e-6
        assert np.abs(ours.velocity(world) - theirs.velocity(world)).max() < 1e-6 * np.abs(theirs.velocity(world)).max()
        for name, loss in theirs.losses(world).items():
            assert ours.losses(world)[name] == pytest.approx(loss, rel=1e-5, abs=1e-12)


def test_memory_that_holds_few_chains_only_takes_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where memory is short, walks wait for one another."""
    setups = [brief_setup(seed, device="cuda") for seed in range(5)]
    together = outcomes(setups)
    monkeypatch.setattr(ensemble, "most_worlds", lambda *_, **__: 2)
    assert outcomes(setups) == together


def test_a_sweep_keeps_series_and_goes_on(tmp_path: Path) -> None:
    """A sweep that was interrupted ends with the same bytes; its series are those of single walks."""
    content = {
        "version": 1,
        "name": "brief",
        "seed": 1,
        "preset": "soft",
        "samples": 20,
        "scene": {"links": 30, "start": "ellipse", "walk_limit": 0.05},
        "options": {"device": "cuda"},
        "grid": {"frequency": [10.0, 12.0]},
        "record": {"series": {"samples": [0]}},
    }
    whole = sweep(content, tmp_path / "whole")

    def interrupt(progress) -> None:
        if progress.done > 10:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(content, tmp_path / "cut", workers=4, on_progress=interrupt)
    sweep(content, tmp_path / "cut")
    assert data_of(tmp_path / "cut") == data_of(tmp_path / "whole")
    series = whole.series(frequency=10.0, sample=0)
    assert len(series.time) > 40
    assert np.isfinite(series.center).all()


def test_simulations_and_walks_run_on_a_gpu() -> None:
    """The same call with another device: the same statuses, samples at the same times, and nearly the same motion."""
    position, velocity = heap(12, 3)
    position[:, 1] += 0.1
    motions = [simulate("soft", position, velocity, duration=0.01, device=device) for device in ("cuda", "cpu")]
    assert motions[0].status == motions[1].status
    assert np.array_equal(motions[0].time, motions[1].time)
    assert np.allclose(motions[0].position[:4], motions[1].position[:4], rtol=0, atol=1e-6)
    ours = walk(links=30, start="ellipse", walk_limit=0.1, device="cuda")
    assert ours.status == Status.TIME_LIMIT
    assert len(ours.time) > 90
