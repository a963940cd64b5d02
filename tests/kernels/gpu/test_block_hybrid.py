"""The block form of the hybrid method equals the CPU form: flights, landings, bursts, the ways between them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.kernels.cpu.test_hybrid import shaken
from tests.kernels.gpu.test_same_as_cpu import compiles_for_gpus
from tests.support.blocks_under_test import launch_blocks, launch_chains
from tests.support.bouncing_chains import CONTACT_STEP, PAPER, batch_with, bouncing, falling, loop
from warpchain import Status, preset
from warpchain.kernels import layout
from warpchain.kernels.cpu.loop import Features
from warpchain.kernels.gpu import functions
from warpchain.kernels.gpu.loop import make_advance_block
from warpchain.kernels.gpu.rigid import FlightLayout
from warpchain.kernels.methods.method import METHODS

SOFT = preset("soft")
THREADS = 24


def in_the_air(chains, parameters=PAPER):
    """A batch whose chains meet nothing."""
    batch = batch_with(chains, parameters, self_contact=False, flight_tolerance=0.1)
    return batch, batch.features(fixed_body="none", watch="none")


def assert_close(ours, theirs, tolerance):
    """States, clocks and losses agree to this part of their greatest; counters, models and statuses are the same."""
    for name in ("counts", "status", "is_rigid"):
        assert np.array_equal(getattr(ours.state, name).numpy(), getattr(theirs.state, name).numpy()), name
    assert_allclose(ours.state.time.numpy(), theirs.state.time.numpy(), rtol=tolerance)
    losses = theirs.state.losses.numpy()
    scale = np.abs(losses).max(axis=1, keepdims=True)
    assert (np.abs(ours.state.losses.numpy() - losses) <= tolerance * scale).all()
    found, expected = ours.state.links.numpy(), theirs.state.links.numpy()
    assert (np.abs(found - expected).max(axis=2) <= tolerance * np.abs(expected).max(axis=2)).all()
    assert_allclose(ours.state.extremes.numpy(), theirs.state.extremes.numpy(), rtol=1e-5, atol=1e-13)


def both(ours, theirs, features, attempts):
    """Carry one batch on in the block form, the other in the CPU form."""
    launch_blocks(ours, features, attempts, block_dim=THREADS)
    launch_chains(theirs, features, attempts)


@pytest.mark.parametrize("parameters", [PAPER, SOFT], ids=["paper", "soft"])
def test_steps_of_a_flight_equal_the_cpu_form(parameters):
    """Ten given steps on rigid joints, after closing them, end in the same state, losses included."""
    chains = [loop(links, parameters) for links in (12, 4, 8, 22)]
    (ours, features), (theirs, _) = (in_the_air(chains, parameters) for _ in range(2))
    for step in range(10):
        for batch in (ours, theirs):
            batch.state.step.numpy()[:] = batch.state.other_step.numpy()[:] = 1.0
            for world in range(len(chains)):
                batch.resume(world, (step + 1) * 2e-4, Status.FINISHED)
        both(ours, theirs, features, 1)
    assert (theirs.state.is_rigid.numpy() == 1).all()
    assert theirs.counts(0)["accepted"] == 10
    assert theirs.losses(0)["joint_friction"] > 0
    assert_close(ours, theirs, 1e-9)


def test_adaptive_flight_equals_the_cpu_form():
    """Steps that the controller chooses, some of them refused: the same attempts, the same flight to the tolerance."""
    (ours, features), (theirs, _) = (in_the_air([loop(12), loop(22)]) for _ in range(2))
    for batch in (ours, theirs):
        batch.control.flight_tolerance = 1e-5
    both(ours, theirs, features, 40)
    assert theirs.counts(0)["rejected"] > 0
    assert theirs.time(0) > 1e-3
    assert_close(ours, theirs, 1e-5)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_nan_of_either_sign_ends_a_flight_at_once(sign):
    """A place that is no number is seen after one step, when joints cannot be closed there, whatever its sign bit."""
    batch, features = in_the_air([loop(12)])
    launch_blocks(batch, features, 3, block_dim=THREADS)
    assert batch.state.is_rigid.numpy()[0] == 1
    batch.state.links.numpy()[0, layout.X, 4] = np.copysign(np.nan, sign)
    launch_blocks(batch, features, 30, block_dim=THREADS)
    assert batch.status(0) == Status.NOT_FINITE
    assert batch.counts(0)["accepted"] == 3 + 1


@pytest.mark.parametrize(("size", "parameters"), [(1e-6, PAPER), (1e-7, PAPER.with_values({"joint_stiffness": 1e4}))])
def test_springs_that_ring_or_stretch_stay_springs(size, parameters):
    """Where joints must not be closed, the chain goes on from the very state on its springs."""
    (ours, features), (theirs, _) = (in_the_air([shaken(12, size, parameters)], parameters) for _ in range(2))
    both(ours, theirs, features, 5)
    assert theirs.counts(0)["accepted"] > 0
    assert theirs.state.is_rigid.numpy()[0] == 0
    assert_close(ours, theirs, 1e-6)


def test_landings_equal_the_cpu_form():
    """A chain that flies, lands, bounces on its springs and flies again, and one that lies longer, hand-over booked."""
    chains = [falling(12, PAPER, 0.3), falling(20, PAPER, 0.6)]
    (ours, features), (theirs, _) = (bouncing(chains) for _ in range(2))
    both(ours, theirs, features, 240)
    # but for the flights every step took CONTACT_STEP
    assert theirs.time(0) > 450 * CONTACT_STEP
    assert theirs.counts(0)["floor"] > 100
    assert theirs.counts(1)["list_builds"] > 0
    assert theirs.losses(0)["joint_switch"] != 0.0
    assert_close(ours, theirs, 1e-7)


def test_softness_changes_as_in_the_cpu_form():
    """Joints that stiffen at each look, with the energy that this takes, and are not closed meanwhile."""
    chains = [falling(12, SOFT, 0.3), falling(8, SOFT, 0.1)]
    settings = {"parameters": PAPER, "soften_drive": True, "record_interval": 2e-5, "softness": 1.0}
    (ours, features), (theirs, _) = (bouncing(chains, **settings) for _ in range(2))
    for batch in (ours, theirs):
        batch.control.stiffening_time = 2e-3
        for world in range(2):
            batch.set_drive(world, hold_softness=1.0)
    both(ours, theirs, features, 100)
    assert (theirs.state.softness.numpy() < 0.99).all()
    assert theirs.losses(0)["softening"] != 0.0
    assert (theirs.state.softness.numpy() > 0).all()
    assert not theirs.state.is_rigid.numpy().any()
    assert_close(ours, theirs, 1e-6)


def test_joints_that_soften_in_flight_stay_closed_as_in_the_cpu_form():
    """A flight goes on when its loop collapses, and ends on soft springs."""
    chains = [falling(12, PAPER, 0.3), loop(12, PAPER)]
    (ours, features), (theirs, _) = (bouncing(chains, record_interval=1e-4) for _ in range(2))
    for batch in (ours, theirs):
        batch.control.soften_area = 2.0  # any loop has collapsed
    both(ours, theirs, features, 100)
    assert (theirs.state.softness.numpy() >= 1).all()
    assert list(theirs.state.is_rigid.numpy()) == [0, 1]
    assert theirs.losses(0)["joint_switch"] != 0.0
    assert_close(ours, theirs, 1e-6)


def ends_of(batch):
    """All that a run leaves of its last world."""
    world = len(batch.links) - 1
    names = ("time", "step", "last_error", "is_rigid", "closing_time", "other_step", "counts", "losses", "extremes")
    numbers = [getattr(batch.state, name).numpy()[world].copy() for name in names]
    return [batch.position(world), batch.velocity(world), *numbers]


def test_cuts_neighbours_and_memory_do_not_change_a_bit(monkeypatch):
    """A chain gives the same bits in any launches, in any batch, and with the memory of its flights anywhere."""
    start = falling(12, PAPER, 0.3)
    runs = []
    for attempts, others, limit in ((240, 0, 64), (1, 0, 64), (13, 2, 64), (240, 0, 0)):
        monkeypatch.setattr(functions, "LARGEST_SHARED_FLIGHT", limit)
        make_advance_block.cache_clear()
        batch, features = bouncing([*(falling(20, PAPER, 0.6),) * others, start])
        while batch.attempts(others) < 240:
            launch_blocks(batch, features, min(attempts, 240 - batch.attempts(others)), block_dim=THREADS)
        runs.append(ends_of(batch))
    make_advance_block.cache_clear()
    assert runs[0][-3][layout.FLOOR_IMPULSES] > 100
    for run in runs[1:]:
        for found, expected in zip(run, runs[0], strict=True):
            assert np.array_equal(found, expected)


def test_memory_of_flights_fits_into_a_block():
    """Up to the limit it leaves room for three blocks on a multiprocessor; above, the scratch block has room for it."""
    limit = functions.LARGEST_SHARED_FLIGHT
    assert 3 * 8 * (FlightLayout(limit).size + layout.board_size(limit)) < 227 * 1024
    for threads in (96, 192, 512, 1024):
        board = layout.BOARD_NOTES * 200 if threads <= functions.LARGEST_SHARED_BLOCK else layout.board_size(threads)
        assert functions.block_rows("hybrid", threads, 200) * 200 >= board + FlightLayout(threads).size
    assert METHODS["hybrid"].block_memory(limit) == FlightLayout(limit).size


@pytest.mark.slow
@pytest.mark.parametrize(
    ("threads", "fixed_body", "watch", "self_contact", "softens"),
    [
        (64, "none", "none", False, False),
        (64, "sprocket", "steady", True, False),
        (64, "floor", "rest", True, True),
        (192, "floor", "rest", True, False),
    ],
)
def test_kernels_compile_for_gpus(tmp_path, threads, fixed_body, watch, self_contact, softens):
    """The method compiles for sm_80 and sm_90 with all features, its memory in either place."""
    features = Features("hybrid", layout.padded_width(60), fixed_body, self_contact, "grid", watch, softens=softens)
    compiles_for_gpus(tmp_path, features, threads)
