"""The block form of the implicit method: its linear solver against NumPy, its steps against the CPU form."""

import numpy as np
import pytest
import warp as wp
from numpy.testing import assert_allclose

from tests.kernels.cpu.test_rosenbrock import PAPER, dense, flying, jacobians
from tests.support.block_solver_under_test import RIGHT_SIDES, solve_loops
from tests.support.blocks_under_test import FIXED_STEP, SOFT, batch_of, features_of, heap, launch_blocks, launch_chains
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels import layout
from warpchain.kernels.gpu import functions
from warpchain.kernels.gpu.factors import FactorLayout, reductions_for
from warpchain.kernels.gpu.functions import block_rows
from warpchain.kernels.gpu.loop import make_advance_block
from warpchain.kernels.gpu.rosenbrock import LINK_NUMBERS, coefficients, factor_layout
from warpchain.kernels.methods.method import METHODS
from warpchain.kernels.methods.rosenbrock_tableaus import RODAS4P
from warpchain.oracle import motion_equations

LINKS = 12


# --- the linear solver ---


@pytest.mark.parametrize(
    ("block_dim", "reductions", "loops"),
    [(32, 2, (4, 6, 8, 30, 32)), (32, 3, (4, 6, 8, 10, 18, 32)), (64, None, (34, 60, 64)), (160, None, (130, 150))],
)
def test_solver_agrees_with_dense_elimination(block_dim: int, reductions: int | None, loops: tuple[int, ...]) -> None:
    """Loops of any even number of links are solved to rounding, those included that reductions use up."""
    rng = np.random.default_rng(block_dim)
    for links in loops:
        lower, upper = rng.normal(size=(2, links, 3, 3))
        diagonal = 9 + rng.normal(size=(links, 3))
        right = rng.normal(size=(RIGHT_SIDES, links, 3))
        found = solve_loops(lower, diagonal, upper, right, block_dim, reductions)
        matrix = dense(lower, diagonal[:, :, None] * np.eye(3), upper)
        exact = np.linalg.solve(matrix, right.reshape(RIGHT_SIDES, -1).T).T.reshape(right.shape)
        assert_allclose(found, exact, rtol=0, atol=2e-15, err_msg=f"{links} links")


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize(("block_dim", "loops"), [(32, (4, 6, 8, 30)), (64, (34, 60)), (160, (150,))])
def test_solver_of_full_diagonal_blocks_agrees_with_dense_elimination(
    order: int, block_dim: int, loops: tuple[int, ...]
) -> None:
    """So are loops whose diagonal blocks are full, of either order."""
    rng = np.random.default_rng(block_dim)
    for links in loops:
        lower, diagonal, upper = rng.normal(size=(3, links, order, order))
        diagonal += 9 * np.eye(order)
        right = rng.normal(size=(RIGHT_SIDES, links, order))
        found = solve_loops(lower, diagonal, upper, right, block_dim)
        exact = np.linalg.solve(dense(lower, diagonal, upper), right.reshape(RIGHT_SIDES, -1).T).T.reshape(right.shape)
        assert_allclose(found, exact, rtol=0, atol=2e-15, err_msg=f"{links} links")


@pytest.mark.parametrize("h", [1e-8, 1e-6, 1e-5, 1e-4, 3e-4])
@pytest.mark.parametrize(
    "values",
    [{}, {"joint_stiffness": 1e11}, {"joint_stiffness": 1e5}, {"friction_smoothing": 1e-6}, {"joint_damping": 1e6}],
    ids=str,
)
def test_solver_on_matrices_of_chains(values: dict[str, float], h: float) -> None:
    """On M + hγD + (hγ)²K of real chains the solution is NumPy's to 1e-12, or to 5e-13 times the condition.

    In the worst case that is 0.6e-13 to 2e-13, by how the last bits of the chain's positions fall.
    """
    chain = PAPER.with_values(values)
    links = 30
    position, velocity = flying(chain, links)
    by_place, by_speed = jacobians(position, velocity, chain)
    mass = np.column_stack(
        [*[motion_equations.link_masses(links, chain)] * 2, motion_equations.link_inertias(links, chain)]
    )
    g = h / 4
    matrix = mass.ravel()[:, None] * (np.eye(3 * links) - g * by_speed - g * g * by_place)
    # angles as paths, as the block form has them
    scale = np.tile([1.0, 1.0, 2 / chain.link_length], links)
    blocks = (scale[:, None] * matrix * scale).reshape(links, 3, links, 3)
    around = np.arange(links)
    lower, own, upper = (blocks[around, :, (around + shift) % links] for shift in (-1, 0, 1))
    diagonal = np.einsum("ijj->ij", own)
    matrix = dense(lower, diagonal[:, :, None] * np.eye(3), upper)
    right = np.stack([g * mass * velocity, mass * np.random.default_rng(1).normal(size=(links, 3))])
    right *= scale.reshape(links, 3)
    found = solve_loops(lower, diagonal, upper, right, 32).reshape(RIGHT_SIDES, -1)
    exact = np.linalg.solve(matrix, right.reshape(RIGHT_SIDES, -1).T).T
    condition = np.linalg.cond(matrix)
    for solution, known, side in zip(found, exact, right.reshape(RIGHT_SIDES, -1), strict=True):
        residual = np.abs(matrix @ solution - side).max()
        assert residual < 1e-12 * max(1.0, condition / 1e6) * np.abs(matrix).sum(axis=1).max() * np.abs(solution).max()
        assert np.abs(solution - known).max() < max(1e-12, 5e-13 * condition) * np.abs(known).max()
    assert condition < 1e3 or h * np.sqrt(chain.joint_stiffness) > 5 or chain.joint_damping > 1e5


def test_last_level_fits_into_a_warp() -> None:
    """The last rounds meet by barriers of a warp alone, whose rows must not be more than its threads."""
    for block_dim in range(4, 1025):
        memory = FactorLayout(block_dim=block_dim, reductions=reductions_for(block_dim), link_numbers=LINK_NUMBERS)
        assert memory.last_width <= 32
        rounds = (memory.inverse - memory.rounds) // (18 * memory.last_width)
        assert 2**rounds >= memory.last_width - 1


def test_memory_fits_into_a_block() -> None:
    """Blocks up to the limit keep their factors in 62 KB; longer chains have room for them in their scratch block."""
    assert 8 * factor_layout(functions.LARGEST_SHARED_MEMORY).size < 62_000
    for links in (200, 512, 1000):
        threads = -(-links // 32) * 32
        is_shared = threads <= functions.LARGEST_SHARED_BLOCK
        board = layout.BOARD_NOTES * 200 if is_shared else layout.board_size(threads)
        assert block_rows("rodas4p", threads, 200) * 200 >= board + factor_layout(threads).size


# --- steps ---


def test_coefficients_are_those_of_the_table() -> None:
    """The native table holds A, γ C and the quadrature's weights to the last digit."""
    coefficient = coefficients("rodas4p")
    stages = RODAS4P.stages

    @wp.kernel(module="unique", enable_backward=False)
    def read(values: wp.array3d(dtype=wp.float64)):
        kind, i, j = wp.tid()
        values[kind, i, j] = coefficient(kind, i, j)

    values = wp.full((3, stages, stages), np.nan, dtype=wp.float64, device="cpu")
    wp.launch(read, dim=values.shape, inputs=[values], device="cpu")
    expected = np.zeros((3, stages, stages))
    for i in range(stages):
        expected[0, i, :i] = RODAS4P.matrix[i]
        expected[1, i, :i] = RODAS4P.gamma * np.array(RODAS4P.couplings[i])
        expected[2, i] = RODAS4P.quadrature[i]
    assert np.array_equal(values.numpy(), expected)


def assert_close(ours, theirs, tolerance: float = 1e-9) -> None:
    """States, losses and clocks agree to this part of their greatest; counters and statuses are the same."""
    for name in ("counts", "status"):
        assert np.array_equal(getattr(ours.state, name).numpy(), getattr(theirs.state, name).numpy()), name
    for name in ("time", "losses"):
        assert_allclose(getattr(ours.state, name).numpy(), getattr(theirs.state, name).numpy(), rtol=tolerance)
    found, expected = ours.state.links.numpy(), theirs.state.links.numpy()
    assert (np.abs(found - expected).max(axis=2) <= tolerance * np.abs(expected).max(axis=2)).all()


@pytest.mark.parametrize(("fixed_body", "self_contact"), [("floor", True), ("sprocket", True), ("floor", False)])
def test_fixed_steps_equal_the_cpu_form(fixed_body: str, self_contact: bool) -> None:
    """Forty steps with dozens of impulses end in the same state as those of the CPU form, whose solver is another."""
    raised = 0.9 * SOFT.sprocket_radius if fixed_body == "sprocket" else 0.0
    chains = [heap(LINKS, 3, raised=raised), heap(4, 18, tilt=np.pi, raised=raised), heap(8, 2, raised=raised)]
    ours, theirs = (batch_of(chains, method="rodas4p", self_contact=self_contact) for _ in range(2))
    features = features_of(ours, fixed_body=fixed_body)
    for batch in (ours, theirs):
        batch.control.tolerance = 1e3
    launch_blocks(ours, features, 40, block_dim=LINKS)
    launch_chains(theirs, features, 40)
    assert theirs.counts(0)["accepted"] == 40
    assert theirs.counts(0)[fixed_body] > 10
    assert (theirs.counts(0)["self"] > 10) == self_contact
    assert_close(ours, theirs)


def test_memory_in_the_scratch_block_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long chains keep factors and board in their scratch block, with the same result."""
    runs = []
    for limit in (512, LINKS - 1):
        monkeypatch.setattr(functions, "LARGEST_SHARED_BLOCK", limit)
        monkeypatch.setattr(functions, "LARGEST_SHARED_MEMORY", limit)
        make_advance_block.cache_clear()
        batch = batch_of([heap(LINKS)], method="rodas4p")
        launch_blocks(batch, features_of(batch, fixed_body="floor"), 10, block_dim=LINKS)
        runs.append(batch)
    make_advance_block.cache_clear()
    assert runs[0].counts(0)["floor"] > 0
    for name in ("links", "losses", "counts"):
        assert np.array_equal(getattr(runs[0].state, name).numpy(), getattr(runs[1].state, name).numpy())


def test_flight_equals_the_cpu_form() -> None:
    """Adaptive long steps of a chain that touches nothing: the same attempts, the same flight, the same losses."""
    position, velocity = lay_chain(ellipse(1.5), LINKS, SOFT.link_length, 2.0, 0.1)
    velocity[:, 2] += np.random.default_rng(1).normal(size=LINKS)
    ours, theirs = (
        batch_of([(position, velocity)], method="rodas4p", self_contact=False, fixed_step=False) for _ in range(2)
    )
    features = features_of(ours, fixed_body="none")
    launch_blocks(ours, features, 60, block_dim=LINKS)
    launch_chains(theirs, features, 60)
    assert ours.counts(0) == theirs.counts(0)
    assert theirs.time(0) > 1000 * FIXED_STEP
    assert ours.time(0) == pytest.approx(theirs.time(0), rel=1e-5)
    assert_allclose(ours.position(0), theirs.position(0), rtol=0, atol=1e-4)
    assert_allclose(ours.state.losses.numpy(), theirs.state.losses.numpy(), rtol=1e-4)


def test_cuts_and_neighbours_do_not_change_a_bit() -> None:
    """A chain gives the same bits however its run is cut into launches, and in whatever batch."""
    runs = []
    for worlds, attempts in ((2, 30), (2, 7), (3, 30)):
        batch = batch_of(
            [heap(LINKS, 5)] + [heap(LINKS, 6)] * (worlds - 1), method="rodas4p", stop_time=20 * FIXED_STEP
        )
        features = features_of(batch, fixed_body="floor")
        for _ in range(-(-30 // attempts)):
            launch_blocks(batch, features, attempts, block_dim=LINKS)
        runs.append(batch)
    assert runs[0].counts(1)["self"] > 10
    for run in runs[1:]:
        for name in ("links", "time", "step", "counts", "losses"):
            assert np.array_equal(getattr(run.state, name).numpy()[1], getattr(runs[0].state, name).numpy()[1]), name


def test_every_method_has_a_block_form() -> None:
    """Each name that the CPU form knows makes a kernel of the block form, too."""
    for name in METHODS:
        batch = batch_of([heap(LINKS)], method=name)
        assert make_advance_block(features_of(batch, fixed_body="none"), LINKS) is not None
