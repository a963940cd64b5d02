"""Coefficients of the explicit methods: orders, stability on the chain's own eigenvalues, kernels that differ."""

import math
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import warpchain
from tests.oracle_model.motion_equations import acceleration
from tests.support.kernels_compiled_otherwise import PLAIN, compiled_with
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS, Tableau, register

EACH = pytest.mark.parametrize("tableau", TABLEAUS.values(), ids=list(TABLEAUS))


@EACH
def test_weights_meet_the_order_conditions_of_bushy_and_tall_trees(tableau: Tableau) -> None:
    """Σ b c^k = 1/(k+1) and b·A^k·1 = 1/(k+1)! up to the order, for both solutions, in exact fractions."""
    nodes = [sum(row, Fraction(0)) for row in tableau.matrix]
    for weights, order in ((tableau.weights, tableau.order), (tableau.embedded, tableau.error_order)):
        power = [Fraction(1)] * tableau.stages
        for k in range(order):
            assert sum(b * c**k for b, c in zip(weights, nodes, strict=True)) == Fraction(1, k + 1)
            assert sum(b * p for b, p in zip(weights, power, strict=True)) == Fraction(1, math.factorial(k + 1))
            power = [sum((a * p for a, p in zip(row, power, strict=False)), Fraction(0)) for row in tableau.matrix]


def eigenvalues(n: int) -> np.ndarray:
    """Of the chain's equations in flight with Table 1's joints (NumPy model, central differences), (6n,) 1/s.

    ω_c is so large that sticking friction plays no part.
    """
    parameters = preset("paper").with_values({"friction_smoothing": 10.0})
    start = np.stack(lay_chain(ellipse(1.5), n, parameters.link_length, speed=5.0))

    def rates(state: np.ndarray) -> np.ndarray:
        return np.stack([state[1], acceleration(state[0], state[1], parameters)])

    columns = []
    for index in np.ndindex(start.shape):
        shift = np.zeros_like(start)
        shift[index] = 1e-8 if index[0] == 0 else 1e-6
        columns.append(((rates(start + shift) - rates(start - shift)) / (2 * shift[index])).ravel())
    return np.linalg.eigvals(np.array(columns).T)


def greatest_growth(tableau: Tableau, z: np.ndarray) -> float:
    """max |P(z)| of the method's stability polynomial P = 1 + Σ b·A^k·1 z^(k+1)."""
    matrix = np.zeros((tableau.stages, tableau.stages))
    for stage, row in enumerate(tableau.matrix):
        matrix[stage, : len(row)] = [float(a) for a in row]
    growth, power = np.ones_like(z), np.ones(tableau.stages)
    for k in range(tableau.stages):
        growth = growth + tableau.velocity_weights @ power * z ** (k + 1)
        power = matrix @ power
    return float(np.abs(growth).max())


def test_os32_is_stable_for_almost_twice_the_step_of_dp5() -> None:
    """On the springs of 24 links 6 / max |λ| is stable with os32, 3.2 with dp5 and 2.4 with bs32, and little more."""
    found = eigenvalues(24)
    # what rounding makes of the modes that do not decay is not what this is about
    normal = found[np.abs(found) > 1e-3 * np.abs(found).max()] / np.abs(found).max()
    assert len(normal) > 90
    limits = {"os32": (6.0, 6.5), "dp5": (3.2, 3.5), "bs32": (2.4, 2.6)}
    for name, (stable, unstable) in limits.items():
        assert greatest_growth(TABLEAUS[name], stable * normal) <= 1.0 + 1e-6, name
        assert greatest_growth(TABLEAUS[name], unstable * normal) > 1.01, name


def fractions(row: str) -> tuple[Fraction, ...]:
    """Numbers of a row as they are printed in a table."""
    return tuple(map(Fraction, row.split()))


CASH_KARP = Tableau(
    name="cash_karp",
    title="Cash–Karp 5(4)",
    order=5,
    error_order=4,
    matrix=(
        (),
        fractions("1/5"),
        fractions("3/40 9/40"),
        fractions("3/10 -9/10 6/5"),
        fractions("-11/54 5/2 -70/27 35/27"),
        fractions("1631/55296 175/512 575/13824 44275/110592 253/4096"),
    ),
    weights=fractions("37/378 0 250/621 125/594 0 512/1771"),
    embedded=fractions("2825/27648 0 18575/48384 13525/55296 277/14336 1/4"),
    source="J. R. Cash, A. H. Karp, ACM TOMS 16 (1990) 201-222",
)


HEUN_EULER = Tableau(
    name="heun_euler",
    title="Heun–Euler 2(1)",
    order=2,
    error_order=1,
    matrix=((), fractions("1")),
    weights=fractions("1/2 1/2"),
    embedded=fractions("1 0"),
    source="K. Heun, Z. Math. Phys. 45 (1900) 23-38, with Euler's method",
)


@pytest.fixture(
    params=[pytest.param(CASH_KARP, marks=pytest.mark.thorough), HEUN_EULER], ids=lambda tableau: tableau.name
)
def new_method(request: pytest.FixtureRequest) -> Iterator[str]:
    """Name of a method that is registered for one test."""
    register(request.param)
    yield request.param.name
    del TABLEAUS[request.param.name]


def test_a_tableau_is_all_that_a_new_method_takes(new_method: str) -> None:
    """Once registered it is an option and walks on a CPU: the chain falls freely, and its ledger closes."""
    assert Options(method=new_method).method == new_method
    settings = {"links": 12, "frequency": 15.0, "start": "ellipse", "clearance": 0.05, "walk_limit": 5e-3}
    with compiled_with(PLAIN):
        walk = warpchain.walk(preset="soft", method=new_method, **settings)
    assert walk.status == warpchain.Status.TIME_LIMIT
    assert walk.steps_accepted > 100
    fall = walk.center[0, 1] - walk.center[:, 1]
    np.testing.assert_allclose(fall, preset("soft").gravity * walk.time**2 / 2, rtol=0, atol=1e-14)
    assert fall[-1] > 1e-4
    assert walk.energy["joint_friction"] > 1e-6
    assert abs(walk.energy["residual"]) < 1e-6 * walk.energy["kinetic_at_release"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "dp5"}, "dp5: there is a method of this name"),
        ({"weights": CASH_KARP.weights[:-1]}, r"cash_karp\.weights: 5 entries instead of 6"),
        ({"weights": (Fraction(1), *CASH_KARP.weights[1:])}, r"cash_karp\.weights: the entries add up to .*, not 1"),
        ({"error_order": 5}, r"cash_karp\.error_order: expected 1 to 4, got 5"),
    ],
)
def test_a_tableau_that_does_not_fit_is_refused(changes: dict, message: str) -> None:
    """The door says in one line what is wrong, and what was there before stays."""
    before = dict(TABLEAUS)
    with pytest.raises(ValueError, match=f"^{message}$"):
        register(replace(CASH_KARP, **changes))
    assert before == TABLEAUS
