"""The implicit methods: their coefficients, linear solver and Jacobian, and what they are for, long steps."""

import itertools
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import warpchain
from tests.oracle_model import motion_equations
from tests.support.rosenbrock_under_test import one_step, solve_loop
from warpchain import Status, preset
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels.methods.rosenbrock_tableaus import ROSENBROCK_TABLES

PAPER, SOFT = preset("paper"), preset("soft")

tables = pytest.mark.parametrize("table", ROSENBROCK_TABLES.values(), ids=lambda table: table.name)


def square(rows, stages):
    """Lower-triangular rows as a square matrix."""
    matrix = np.zeros((stages, stages))
    for i, row in enumerate(rows):
        matrix[i, : len(row)] = row
    return matrix


def classical(table):
    """α, Γ, b and b̂ of the form k_i = h f(y + Σ α_ij k_j) + h J Σ Γ_ij k_j, y_new = y + Σ b_i k_i."""
    s = table.stages
    gammas = np.linalg.inv(np.eye(s) / table.gamma - square(table.couplings, s))
    alphas = square(table.matrix, s) @ gammas
    return alphas, gammas, np.array(table.weights) @ gammas, np.array([*table.matrix[-1], 0.0]) @ gammas


# --- coefficients ---


def rooted_trees(nodes):
    """Rooted trees with so many nodes, each the sorted tuple of its branches."""
    if nodes == 1:
        return [()]
    found = set()
    for partition in partitions(nodes - 1):
        for branches in itertools.product(*map(rooted_trees, partition)):
            found.add(tuple(sorted(branches)))
    return sorted(found)


def partitions(total, greatest=None):
    """Ways of writing a number as a falling sum."""
    if total == 0:
        yield ()
    for first in range(min(total, greatest or total), 0, -1):
        for rest in partitions(total - first, first):
            yield (first, *rest)


def nodes_and_density(tree):
    """Number of nodes of a rooted tree and its density: the product of the numbers of nodes above each node."""
    below = [nodes_and_density(branch) for branch in tree]
    nodes = 1 + sum(count for count, _ in below)
    return nodes, nodes * math.prod(density for _, density in below)


def differential(tree, alphas, betas):
    """The stages' elementary differential of a tree: β leads to a single branch, α to each of several."""
    if not tree:
        return np.ones(len(alphas))
    if len(tree) == 1:
        return betas @ differential(tree[0], alphas, betas)
    return np.prod([alphas @ differential(branch, alphas, betas) for branch in tree], axis=0)


@tables
def test_coefficients_fulfil_the_order_conditions(table):
    """All conditions up to the order hold for the solution and the embedded one, to rounding, and not one order more.

    E. Hairer, G. Wanner, Solving ODEs II, theorem IV.7.2: Σ b Φ(t) = 1/γ(t) for every rooted tree t, with β = α + Γ.
    """
    alphas, gammas, b, embedded = classical(table)
    for weights, order in ((b, table.order), (embedded, table.error_order)):
        misses = {}
        for nodes in range(1, order + 2):
            for tree in rooted_trees(nodes):
                terms = weights * differential(tree, alphas, alphas + gammas)
                miss = abs(terms.sum() - 1 / nodes_and_density(tree)[1])
                misses.setdefault(nodes, []).append(miss / max(1.0, np.abs(terms).max()))
        assert [len(misses[nodes]) for nodes in range(1, 5)] == [1, 1, 2, 4]
        assert max(max(misses[nodes]) for nodes in range(1, order + 1)) < 5e-14
        assert max(misses[order + 1]) > 1e-5


@tables
def test_method_is_stiffly_accurate(table):
    """The last stage lies at the new state, so very stiff parts are damped at once: R(∞) = 0, of both solutions."""
    alphas, gammas, b, embedded = classical(table)
    assert_allclose((alphas + gammas)[-1], b, atol=1e-14)
    assert_allclose(alphas[-1], embedded, atol=1e-14)
    for weights in (b, embedded):
        for z, bound in ((-1e8, 1e-6), (1e8j, 1e-6)):
            inner = np.eye(table.stages) - z * (alphas + gammas)
            assert abs(1 + z * weights @ np.linalg.solve(inner, np.ones(table.stages))) < bound


@tables
def test_quadrature_belongs_to_the_method(table):
    """The weights of quadratures are b of the textbook form, whose stages for e' = p(y) are h (p(Y_i) + p'·U_i)."""
    _, _, b, _ = classical(table)
    assert_allclose(table.quadrature, b, atol=1e-14)
    assert sum(table.quadrature) == pytest.approx(1.0, abs=1e-14)


@tables
def test_second_order_form_is_the_method(table):
    """For q' = v the stages' places and velocities follow from the changes of the places alone, for any Jacobian."""
    stages, gamma = table.stages, table.gamma
    second = table.second_order
    matrix, couplings, velocity, shift, drive = (
        square(rows, stages) for rows in (table.matrix, table.couplings, second.velocity, second.shift, second.drive)
    )
    rng = np.random.default_rng(stages)
    start = rng.normal()
    pushes = rng.normal(size=stages)
    # stages of the textbook with h γ = 1: U_q = v_i + U_v + γ Σ C U_q, whatever U_v the accelerations make
    places = np.zeros(stages)
    for i in range(stages):
        places[i] = start + matrix[i] @ pushes + gamma * couplings[i] @ places + pushes[i]
    changes = places - np.array(second.free) * start
    assert_allclose(matrix @ places, np.array(second.place) * start + matrix @ changes, atol=1e-11)
    assert_allclose(start + matrix @ pushes, start + velocity @ changes, atol=1e-11)
    shifted = np.array(second.free) * start + shift @ changes
    assert_allclose(start + matrix @ pushes + gamma * couplings @ places, shifted, atol=1e-10)
    assert_allclose(pushes, places - shifted, atol=1e-10)
    assert_allclose(gamma * couplings @ pushes, drive @ changes, atol=1e-10)
    assert_allclose(np.array(table.quadrature) @ pushes, np.array(second.loss) @ changes, atol=1e-11)
    weights = np.array(table.quadrature)
    assert_allclose(weights @ places, second.loss_place * start + weights @ changes, atol=1e-11)


# --- the linear solver ---


def dense(lower, diagonal, upper):
    """The cyclic block-tridiagonal matrix in full."""
    n, size, _ = diagonal.shape
    matrix = np.zeros((n, size, n, size))
    for i in range(n):
        matrix[i, :, (i - 1) % n] += lower[i]
        matrix[i, :, i] += diagonal[i]
        matrix[i, :, (i + 1) % n] += upper[i]
    return matrix.reshape(n * size, n * size)


@pytest.mark.parametrize("size", [2, 3])
def test_solver_agrees_with_dense_elimination(size):
    """For every kind of number of rows, the shortest loops included, the solution is NumPy's to rounding."""
    rng = np.random.default_rng(size)
    for rows in (4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 60, 90, 150, 198, 1000 if size == 3 else 62):
        lower, upper, diagonal = (rng.normal(size=(rows, size, size)) for _ in range(3))
        diagonal += 3 * size * np.eye(size)
        right = rng.normal(size=(rows, size))
        exact = np.linalg.solve(dense(lower, diagonal, upper), right.ravel()).reshape(rows, size)
        assert_allclose(solve_loop(lower, diagonal, upper, right), exact, rtol=0, atol=3e-15, err_msg=f"{rows} rows")


def jacobians(position, velocity, parameters):
    """∂q̈/∂q and ∂q̈/∂q̇ of the reference, (3n, 3n) each, by central differences.

    Forces are linear in X, Ẋ and ω up to friction, so only angles and friction see the finite step.
    """
    n = len(position)
    found = []
    for which in (0, 1):
        columns = np.empty((3 * n, 3 * n))
        for k in range(3 * n):
            states = []
            step = 1e-6 if which == 0 else min(1e-6, 1e-4 * parameters.friction_smoothing)
            if k % 3 != 2:
                step = 1e-3
            for sign in (1, -1):
                moved = [position.copy(), velocity.copy()]
                moved[which].ravel()[k] += sign * step
                states.append(motion_equations.acceleration(*moved, parameters).ravel())
            columns[:, k] = (states[0] - states[1]) / (2 * step)
        found.append(columns)
    return found


def flying(parameters, links, speed=2.0, disorder=1e-8):
    """A circulating ellipse with a little disorder in places and speeds: no joint is at rest or closed."""
    position, velocity = lay_chain(ellipse(1.5), links, parameters.link_length, speed, 0.1)
    rng = np.random.default_rng(links)
    return position + disorder * rng.normal(size=(links, 3)), velocity + rng.normal(size=(links, 3)) * [
        1e-3,
        1e-3,
        1e-1,
    ]


@pytest.mark.parametrize("h", [1e-8, 1e-6, 1e-4])
@pytest.mark.parametrize(
    "values",
    [{}, {"joint_stiffness": 1e11}, {"joint_stiffness": 1e5}, {"friction_smoothing": 1e-6}, {"joint_damping": 1e6}],
    ids=str,
)
def test_solver_on_matrices_of_chains(values, h):
    """On M + hγD + (hγ)²K of real chains the solution is NumPy's to 1e-13 of it, times the matrix's condition.

    The condition stays below 1000 where steps are wanted, h = 1e-4 s at k = 1e9 N/m, or 1e-5 s at 1e11 N/m.
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
    blocks = matrix.reshape(links, 3, links, 3)
    around = np.arange(links)
    lower, diagonal, upper = (blocks[around, :, (around + shift) % links] for shift in (-1, 0, 1))
    matrix = dense(lower, diagonal, upper)
    right = mass * velocity * g
    found = solve_loop(lower, diagonal, upper, right)
    exact = np.linalg.solve(matrix, right.ravel()).reshape(links, 3)
    # both solutions are off by rounding times the condition, that of rows and columns of one size
    scale = 1 / np.sqrt(np.abs(np.diag(matrix)))
    condition = np.linalg.cond(scale[:, None] * matrix * scale)
    difference = np.abs((found - exact).ravel() / scale).max() / np.abs(exact.ravel() / scale).max()
    assert difference < 1e-13 * condition
    assert condition < 1e3 or h * np.sqrt(chain.joint_stiffness) > 10 or chain.joint_damping > 1e5


# --- one step ---


def dense_step(table, position, velocity, parameters, h, steeper=0.0):
    """One step of the method in its textbook form, with the reference's equations and dense linear algebra.

    By ``steeper`` [N m s], one number a joint, friction's slope is greater in the Jacobian than it is.
    """
    n = len(position)
    start = np.concatenate([position.ravel(), velocity.ravel()])
    by_place, by_speed = jacobians(position, velocity, parameters)
    spins = np.eye(n) - np.roll(np.eye(n), 1, axis=1)
    friction = -spins.T @ (np.broadcast_to(steeper, n)[:, None] * spins)
    by_speed[2::3, 2::3] += friction / motion_equations.link_inertias(n, parameters)[:, None]
    jacobian = np.block([[np.zeros((3 * n, 3 * n)), np.eye(3 * n)], [by_place, by_speed]])
    matrix = np.eye(6 * n) - h * table.gamma * jacobian
    changes = []
    for row, coupling in zip(table.matrix, table.couplings, strict=True):
        place = start + sum((a * change for a, change in zip(row, changes, strict=True)), np.zeros(6 * n))
        q, v = place.reshape(2, n, 3)
        rates = np.concatenate([v, motion_equations.acceleration(q, v, parameters)]).ravel()
        right = h * table.gamma * rates
        right += table.gamma * sum((c * change for c, change in zip(coupling, changes, strict=True)), np.zeros(6 * n))
        changes.append(np.linalg.solve(matrix, right))
    end = start + sum(m * change for m, change in zip(table.weights, changes, strict=True))
    return (*end.reshape(2, n, 3), changes[-1].reshape(2, n, 3))


@tables
@pytest.mark.parametrize("links", [4, 6, 10, 16, 30])
@pytest.mark.parametrize(
    ("parameters", "h"),
    [(PAPER, 1e-6), (PAPER, 3e-5), (SOFT, 3e-5), (SOFT.with_values({"friction_smoothing": 10.0}), 3e-4)],
    ids=["paper-short", "paper-long", "soft", "smooth"],
)
def test_step_is_that_of_the_exact_jacobian(table, links, parameters, h):
    """A step is the textbook's with the reference's Jacobian, geometric terms included, to the latter's accuracy."""
    position, velocity = flying(parameters, links)
    tolerance = 1e-9
    place, speed, error, _ = one_step(table.name, position, velocity, parameters, h, tolerance)
    expected_place, expected_speed, estimate = dense_step(table, position, velocity, parameters, h)
    moved = np.abs(expected_place - position).max(axis=0)
    changed = np.abs(expected_speed - velocity).max(axis=0)
    assert (np.abs(place - expected_place).max(axis=0) / moved).max() < 1e-6
    assert (np.abs(speed - expected_speed).max(axis=0) / np.maximum(changed, 1e-6)).max() < 1e-5
    rates = motion_equations.acceleration(position, velocity, parameters)
    scales = 1 + np.abs([position, velocity]) + h * np.abs([velocity, rates])
    assert error * tolerance == pytest.approx((np.abs(estimate) / scales).max(), rel=1e-4)


@tables
@pytest.mark.parametrize("links", [10, 16, 30])
def test_joints_that_turn_round_unseen_have_the_secant_for_a_slope(table, links):
    """Where a spin that the tolerance does not see would change its sign, the matrix holds f(w)/w instead of f'(w)."""
    chain = PAPER.with_values({"friction_smoothing": 0.02})
    h = 3e-5
    position, velocity = flying(chain, links)
    spin = velocity[:, 2] - np.roll(velocity[:, 2], -1)
    rate = motion_equations.acceleration(position, velocity, chain)[:, 2]
    turns_round = spin * (spin + h * (rate - np.roll(rate, -1))) < 0
    torque = motion_equations.friction_torque(spin, chain)
    switch = 1 - np.tanh(spin / chain.friction_smoothing) ** 2
    tangent = chain.viscous_friction + chain.coulomb_friction / chain.friction_smoothing * switch
    steeper = np.where(turns_round & (np.abs(spin) > 4 * chain.friction_smoothing), torque / spin - tangent, 0.0)
    assert 1 <= np.count_nonzero(steeper) < links
    expected_place, expected_speed, _ = dense_step(table, position, velocity, chain, h, steeper)
    place, speed, *_ = one_step(table.name, position, velocity, chain, h, tolerance=1.0)
    assert (np.abs(place - expected_place) / np.abs(expected_place - position).max(axis=0)).max() < 1e-6
    assert (np.abs(speed - expected_speed) / np.abs(expected_speed - velocity).max(axis=0)).max() < 1e-5


def test_rejected_steps_leave_the_chain_alone():
    """A step far beyond the tolerance reports an error ratio above one."""
    position, velocity = flying(PAPER, 12, disorder=1e-6)
    *_, error, _ = one_step("rodas5p", position, velocity, PAPER, 1e-4, tolerance=1e-9)
    assert error > 1


# --- what it is for ---


def test_steps_are_longer_than_the_springs_allow():
    """In calm flight a step is tens of times the explicit limit of 4 µs, and as accurate as the tolerance says."""
    chain = PAPER.with_values({"friction_smoothing": 1.0})
    start = lay_chain(ellipse(1.5), 60, chain.link_length, 2.0, 0.1)
    duration = 0.05
    run = {"times": [duration], "floor": False, "self_contact": False}
    calm = warpchain.simulate(chain, *start, 5e-3, tolerance=1e-8, **(run | {"times": [5e-3]}))
    state = calm.position[-1], calm.velocity[-1]
    exact = warpchain.simulate(chain, *state, duration, tolerance=1e-9, **run)
    flight = warpchain.simulate(chain, *state, duration, method="rodas5p", tolerance=3e-4, **run)
    assert flight.status == Status.FINISHED
    assert duration / flight.steps_accepted > 5e-5
    assert np.abs(flight.position[-1] - exact.position[-1])[:, :2].max() < 1e-5


@tables
def test_flight_reaches_eight_digits(table):
    """At tolerance 1e-8 places and speeds of 150 links are those of rkf78 at 1e-12, to 1e-8 of the greatest.

    SciPy, which takes minutes, agrees with both methods on shorter chains: `test_flight_agrees_with_scipy`.
    """
    duration = 5e-4
    start = lay_chain(ellipse(1.5), 150, PAPER.link_length, 2.0, 0.1)
    run = {"times": [duration], "floor": False, "self_contact": False}
    exact = warpchain.simulate(PAPER, *start, duration, method="rkf78", tolerance=1e-12, **run)
    flight = warpchain.simulate(PAPER, *start, duration, method=table.name, tolerance=1e-8, **run)
    assert flight.status == exact.status == Status.FINISHED
    for found, known in ((flight.position[-1], exact.position[-1]), (flight.velocity[-1], exact.velocity[-1])):
        assert np.abs(found - known)[:, :2].max() < 1e-8 * np.abs(known[:, :2]).max()
        assert np.abs(found - known)[:, 2].max() < 1e-8 * np.abs(known[:, 2]).max()


def calm_flight(links):
    """Table 1's chain as a circulating ellipse whose joints bear their loads: arguments of a run without contacts."""
    start = lay_chain(ellipse(1.5), links, PAPER.link_length, 5.0, 0.1)
    run = {"floor": False, "self_contact": False}
    calm = warpchain.simulate(PAPER, *start, 2e-3, times=[2e-3], method="rodas5p", tolerance=1e-7, **run)
    return (PAPER, calm.position[-1], calm.velocity[-1]), run


@tables
@pytest.mark.parametrize("tolerance", [1e-8, 1e-9])
def test_estimates_do_not_drown_in_rounding(table, tolerance):
    """A tenth of the tolerance costs at most 4 times the steps; an estimate that falls as h² would need 3.2 times.

    With openings from places that are rounded to 1e-16 m in each stage it was 6 to 17 times.
    """
    start, run = calm_flight(150)
    steps = []
    for tried in (tolerance, tolerance / 10):
        flight = warpchain.simulate(*start, 1e-3, times=[1e-3], method=table.name, tolerance=tried, **run)
        steps.append(flight.steps_accepted + flight.steps_rejected)
    assert steps[1] < 4 * steps[0], steps


@tables
def test_sticking_joints_do_not_hold_loose_steps_back(table):
    """With friction as sharp as Table 1's a looser tolerance costs fewer steps, and keeps what it promises."""
    start, run = calm_flight(60)
    duration = 0.05
    exact = warpchain.simulate(*start, duration, times=[duration], method="dp5", tolerance=1e-9, **run)
    steps = []
    for tolerance in (1e-3, 1e-5):
        flight = warpchain.simulate(*start, duration, times=[duration], method=table.name, tolerance=tolerance, **run)
        steps.append(flight.steps_accepted + flight.steps_rejected)
        assert np.abs(flight.position[-1] - exact.position[-1])[:, :2].max() < 1e-2 * tolerance
        assert np.abs(flight.velocity[-1] - exact.velocity[-1])[:, :2].max() < tolerance
    assert steps[0] < 0.65 * steps[1], steps


def test_losses_converge_with_the_order_of_the_method():
    """What friction and damping take is integrated as the motion is: against rkf78 at 1e-12 its errors fall as h⁵.

    With friction as sharp as Table 1's, ω_c = 1e-3 rad/s, steps of a few µs pass over its change of sign, and no order
    shows; here ω_c = 10.
    """
    chain = PAPER.with_values({"joint_stiffness": 1e5, "joint_damping": 0.05, "friction_smoothing": 10.0})
    position, velocity = lay_chain(ellipse(1.5), 12, chain.link_length, 2.0, 0.1)
    run = {"duration": 4e-3, "times": [4e-3], "gravity": False}
    position[:, 1] += 0.1
    state = position, velocity
    exact = warpchain.simulate(chain, *state, tolerance=1e-12, **run).losses
    steps = [8e-5, 4e-5, 2e-5, 1e-5]
    names = ("joint_friction", "joint_damping")
    errors = []
    for step in steps:
        # a skin beyond the floor makes contact_step, not the loose tolerance, set the step
        flight = warpchain.simulate(chain, *state, method="rodas5p", tolerance=0.1, contact_step=step, skin=5.0, **run)
        errors.append([abs(flight.losses[name] - exact[name]) for name in names])
    assert min(exact[name] for name in names) > 1e-7
    slopes = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert np.abs(slopes - 5).max() < 0.3, slopes


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6])
def test_floor_impact_is_that_of_an_explicit_method(tolerance):
    """A chain that drops on the floor keeps the momentum that dp5 leaves it, to a few per cent of what it had.

    When contacts are seen depends on the steps, and so do the impulses of a single impact.
    """
    position, velocity = lay_chain(ellipse(1.2), 20, PAPER.link_length, 2.0, 0.1)
    ends = np.concatenate(motion_equations.link_ends(position, PAPER))
    position[:, 1] -= ends[:, 1].min() - PAPER.circle_radius - 2e-4
    velocity[:, 1] -= 1.0
    duration = 2e-3
    momenta = []
    for method, tried in (("dp5", 1e-7), ("rodas5p", tolerance)):
        flight = warpchain.simulate(PAPER, position, velocity, duration, method=method, tolerance=tried)
        assert flight.status == Status.FINISHED
        assert flight.impulses["floor"] > 0
        momenta.append(np.array([motion_equations.linear_momentum(v, PAPER) for v in flight.velocity]))
    at_start = np.linalg.norm(momenta[0][0])
    assert np.linalg.norm(momenta[0][-1] - momenta[0][0]) > 0.1 * at_start
    assert np.linalg.norm(momenta[1] - momenta[0], axis=1).max() < 0.03 * at_start
