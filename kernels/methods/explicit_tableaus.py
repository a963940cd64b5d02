"""Butcher tableaus of the embedded explicit Runge–Kutta methods, as data.

A new explicit method is one call of :func:`register`, at the end of this file or elsewhere; no other file changes.
"""

from dataclasses import dataclass
from fractions import Fraction as F
from functools import cached_property

HYBRID = "hybrid"
"""The method that takes rigid joints between impulses …"""
HYBRID_SPRINGS = "os32"
"""… and this explicit method while joints are springs."""


@dataclass(frozen=True)
class Tableau:
    """One embedded explicit Runge–Kutta pair.

    The chain's equations are of second order, q'' = a(q, q'), and the positions' rows are integrated with the
    products A·A and b·A (the Nyström form). Every row sum of A is the stage's time, and the weights add up to one, so
    this is the same method on (q, q'), with half of the derivatives to store.
    """

    name: str  # what a user writes for ``method``
    title: str  # one line for help texts
    order: int  # order of the solution that is propagated
    error_order: int  # order of the embedded solution; sets the exponent of the step controller after a rejection
    matrix: tuple[tuple[F, ...], ...]  # lower-triangular stage coefficients A; row s has s entries
    weights: tuple[F, ...]  # weights b of the propagated solution
    embedded: tuple[F, ...]  # weights of the embedded solution
    source: str  # where the coefficients were published

    @property
    def stages(self) -> int:
        """Number of stages, including the one that the next step reuses."""
        return len(self.matrix)

    @property
    def first_same_as_last(self) -> bool:
        """Whether the last stage lies at the new state, so that it is the first stage of the next step."""
        return self.matrix[-1] == self.weights[:-1]

    @cached_property
    def nodes(self) -> tuple[float, ...]:
        """Stage times c as fractions of the step."""
        return tuple(float(sum(row)) for row in self.matrix)

    @cached_property
    def velocity(self) -> tuple[tuple[float, ...], ...]:
        """A as floats: weights of the accelerations in a stage's velocities, per h."""
        return tuple(tuple(float(a) for a in row) for row in self.matrix)

    @cached_property
    def position(self) -> tuple[tuple[float, ...], ...]:
        """A·A: weights of the accelerations in a stage's positions, per h²."""
        return tuple(tuple(float(x) for x in self._times_matrix(row)) for row in self.matrix)

    @cached_property
    def velocity_weights(self) -> tuple[float, ...]:
        """b as floats."""
        return tuple(float(b) for b in self.weights)

    @cached_property
    def position_weights(self) -> tuple[float, ...]:
        """b·A: weights of the accelerations in the new positions, per h²."""
        return tuple(float(x) for x in self._times_matrix(self.weights))

    @cached_property
    def velocity_errors(self) -> tuple[float, ...]:
        """b − b̂: weights of the velocities' error estimate, per h."""
        return tuple(float(x) for x in self._error_weights)

    @property
    def _error_weights(self) -> tuple[F, ...]:
        return tuple(b - e for b, e in zip(self.weights, self.embedded, strict=True))

    def _times_matrix(self, row: tuple[F, ...]) -> tuple[F, ...]:
        products = [F(0)] * len(row)
        for factor, lower in zip(row, self.matrix, strict=False):
            for column, value in enumerate(lower):
                products[column] += factor * value
        return tuple(products)


TABLEAUS: dict[str, Tableau] = {}
"""Every explicit method by its name; filled by :func:`register`."""


def register(tableau: Tableau) -> None:
    """Make a tableau a method that can be asked for by its name.

    Raises:
        ValueError: The name is taken, a row has the wrong length, the weights of a solution do not add up to one, or
            the embedded solution is of no order between 1 and that of the other.
    """
    name = tableau.name
    if name in {*TABLEAUS, HYBRID}:
        raise ValueError(f"{name}: there is a method of this name")
    rows = [(f"matrix[{stage}]", row, stage) for stage, row in enumerate(tableau.matrix)]
    solutions = [("weights", tableau.weights), ("embedded", tableau.embedded)]
    for place, row, length in [*rows, *((place, row, tableau.stages) for place, row in solutions)]:
        if len(row) != length:
            raise ValueError(f"{name}.{place}: {len(row)} entries instead of {length}")
    for place, row in solutions:
        if sum(row) != 1:
            raise ValueError(f"{name}.{place}: the entries add up to {sum(row)}, not 1")
    if not 1 <= tableau.error_order < tableau.order:
        raise ValueError(f"{name}.error_order: expected 1 to {tableau.order - 1}, got {tableau.error_order}")
    TABLEAUS[name] = tableau


def _fractions(row: str) -> tuple[F, ...]:
    """Fractions between blanks, such as ``1/4 0 3/4``."""
    return tuple(map(F, row.split()))


RKF78 = Tableau(
    name="rkf78",
    title="Fehlberg 7(8)",
    order=8,
    error_order=7,
    matrix=(
        (),
        _fractions("2/27"),
        _fractions("1/36 1/12"),
        _fractions("1/24 0 1/8"),
        _fractions("5/12 0 -25/16 25/16"),
        _fractions("1/20 0 0 1/4 1/5"),
        _fractions("-25/108 0 0 125/108 -65/27 125/54"),
        _fractions("31/300 0 0 0 61/225 -2/9 13/900"),
        _fractions("2 0 0 -53/6 704/45 -107/9 67/90 3"),
        _fractions("-91/108 0 0 23/108 -976/135 311/54 -19/60 17/6 -1/12"),
        _fractions("2383/4100 0 0 -341/164 4496/1025 -301/82 2133/4100 45/82 45/164 18/41"),
        _fractions("3/205 0 0 0 0 -6/41 -3/205 -3/41 3/41 6/41 0"),
        _fractions("-1777/4100 0 0 -341/164 4496/1025 -289/82 2193/4100 51/82 33/164 12/41 0 1"),
    ),
    weights=_fractions("0 0 0 0 0 34/105 9/35 9/35 9/280 9/280 0 41/840 41/840"),
    embedded=_fractions("41/840 0 0 0 0 34/105 9/35 9/35 9/280 9/280 41/840 0 0"),
    source="E. Fehlberg, NASA TR R-287 (1968), table X; the higher-order solution is propagated",
)

DP5 = Tableau(
    name="dp5",
    title="Dormand–Prince 5(4)",
    order=5,
    error_order=4,
    matrix=(
        (),
        _fractions("1/5"),
        _fractions("3/40 9/40"),
        _fractions("44/45 -56/15 32/9"),
        _fractions("19372/6561 -25360/2187 64448/6561 -212/729"),
        _fractions("9017/3168 -355/33 46732/5247 49/176 -5103/18656"),
        _fractions("35/384 0 500/1113 125/192 -2187/6784 11/84"),
    ),
    weights=_fractions("35/384 0 500/1113 125/192 -2187/6784 11/84 0"),
    embedded=_fractions("5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40"),
    source="J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26",
)

BS32 = Tableau(
    name="bs32",
    title="Bogacki–Shampine 3(2)",
    order=3,
    error_order=2,
    matrix=((), _fractions("1/2"), _fractions("0 3/4"), _fractions("2/9 1/3 4/9")),
    weights=_fractions("2/9 1/3 4/9 0"),
    embedded=_fractions("7/24 1/4 1/3 1/8"),
    source="P. Bogacki, L. F. Shampine, Appl. Math. Lett. 2 (1989) 321-325",
)

OS32 = Tableau(
    name="os32",
    title="six stages of order 3(2) for long stable steps",
    order=3,
    error_order=2,
    matrix=(
        (),
        _fractions("23/400"),
        _fractions("0 3/25"),
        _fractions("0 0 39/200"),
        _fractions("0 0 0 1/3"),
        _fractions("0 0 0 0 2/3"),
        _fractions("1/4 0 0 0 0 3/4"),
    ),
    weights=_fractions("1/4 0 0 0 0 3/4 0"),
    embedded=_fractions("3/16 0 0 0 0 15/16 -1/8"),
    source="Heun's method of order 3 (Z. Math. Phys. 45 (1900) 23-38) with three stages before it for stability",
)
"""Order 3 with six stages and a reused one, for steps that stability limits.

Each stage depends on the previous one only. The stability polynomial is 1 + z + z²/2 + z³/6 + c₄ z⁴ + c₅ z⁵ + c₆ z⁶,
with c₄ = 1/6 · 39/200, c₅ = c₄ · 3/25, c₆ = c₅ · 23/400 free to choose. They are near those of the optimal polynomial
in the sense of D. I. Ketcheson and A. J. Ahmadia (Commun. Appl. Math. Comput. Sci. 7 (2012) 247), which allows the
largest h with |P(hλ)| ≤ 1 on the eigenvalues λ. Eigenvalues of joints with k and b of Table 1 lie on a curve that ends
at |λ| = 1.08e6/s, 57° off the negative axis; those of sticking friction lie on that axis. Steps may be 6.2/|λ| on the
curve and 7.3/|λ| on the axis; with `dp5`, which has as many stages, 3.4 and 3.3; with `bs32`, with half as many, 2.5.
"""

for _tableau in (RKF78, DP5, BS32, OS32):
    register(_tableau)
