"""Coefficients of Rosenbrock methods, as data."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class RosenbrockTable:
    """One stiffly accurate embedded Rosenbrock method for y' = f(y), in the form without products by the Jacobian J.

    Stage i is (1/(hγ) − J) U_i = f(y + Σ_j<i A_ij U_j) + Σ_j<i C_ij U_j / h. The last row of A gives the embedded
    solution ŷ. The new state is ŷ plus the last U, which is also the error estimate.

    Attributes:
        name: What a user writes for ``method``.
        title: One line for help texts.
        order: Order of the solution that is propagated.
        error_order: Order of the embedded solution.
        gamma: γ.
        matrix: A; row i has i entries.
        couplings: C, likewise.
        source: Where the coefficients were published.
    """

    name: str
    title: str
    order: int
    error_order: int
    gamma: float
    matrix: tuple[tuple[float, ...], ...]
    couplings: tuple[tuple[float, ...], ...]
    source: str

    @property
    def stages(self) -> int:
        """Number of stages."""
        return len(self.matrix)

    @property
    def weights(self) -> tuple[float, ...]:
        """m with y_new = y + Σ m_i U_i."""
        return (*self.matrix[-1], 1.0)

    @cached_property
    def quadrature(self) -> tuple[float, ...]:
        """Weights w with ∫ p dt = h Σ w_i (p(Y_i) + ∂p/∂y · U_i) over a step, for a p that does not act back on y.

        They follow from the method on the system extended by e' = p(y). Its stages are a triangular system for e alone,
        E_i = hγ (p(Y_i) + ∂p/∂y · U_i) + γ Σ_j C_ij E_j, which is solved here.
        """
        weights = list(self.weights)
        for i in reversed(range(self.stages)):
            for j, coupling in enumerate(self.couplings[i]):
                weights[j] += self.gamma * coupling * weights[i]
        return tuple(self.gamma * weight for weight in weights)

    @cached_property
    def second_order(self) -> "SecondOrderTable":
        """The method for equations of second order."""
        couplings = [[self.gamma * entry for entry in row] for row in self.couplings]
        free: list[float] = []
        parts: list[list[float]] = []
        for row, coupling in zip(self.matrix, couplings, strict=True):
            free.append(1.0 + _product(coupling, free))
            part = [-entry for entry in coupling] + [1.0]
            for entry, other in zip(row, parts, strict=True):
                for k, value in enumerate(other):
                    part[k] -= entry * value
            parts.append(part)

        def through_parts(row: Sequence[float]) -> tuple[float, ...]:
            return tuple(sum(row[j] * parts[j][k] for j in range(k, len(row))) for k in range(len(row)))

        velocity = tuple(through_parts(row) for row in self.matrix)
        return SecondOrderTable(
            free=tuple(free),
            place=tuple(_product(row, free) for row in self.matrix),
            velocity=velocity,
            shift=tuple(
                tuple(entry + other for entry, other in zip(*rows, strict=True))
                for rows in zip(velocity, couplings, strict=True)
            ),
            drive=tuple(through_parts(row) for row in couplings),
            loss=through_parts(self.quadrature),
            loss_place=_product(self.quadrature, free),
        )


def _product(row: Sequence[float], values: Sequence[float]) -> float:
    return sum(entry * value for entry, value in zip(row, values, strict=False))


@dataclass(frozen=True)
class SecondOrderTable:
    """A method for q' = v, v' = a(q, v) in terms of W_i = U_q,i / (hγ) − free_i v, which vanishes in free motion.

    v is the velocity at the start of the step. Without forces U_q,i = hγ free_i v, where (1 − γ C) free = (1, …, 1).
    From U_q,i / (hγ) = v_i + γ Σ_j C_ij U_q,j / (hγ) + U_v,i follows U_v = P W with (1 + A) P = 1 − γ C. So only W has
    to be stored of a stage, half as many numbers. If free motion were not subtracted, the rounding of coefficients
    would change velocities in the same way in every step.

    Attributes:
        free: See above.
        place: Stage i lies at q + hγ (place_i v + Σ_j<i A_ij W_j) …
        velocity: … with the velocity v + Σ_j<i velocity_ij W_j; row i has i entries, as in all below.
        shift: r_q,i / (hγ) is free_i v + Σ shift_ij W_j, and U_v,i is W_i minus that sum.
        drive: γ Σ_j C_ij U_v,j is Σ drive_ij W_j.
        loss: Σ w_i U_v,i is Σ loss_i W_i, with the weights w of the quadrature, …
        loss_place: … and Σ w_i U_q,i is hγ (loss_place v + Σ w_i W_i).
    """

    free: tuple[float, ...]
    place: tuple[float, ...]
    velocity: tuple[tuple[float, ...], ...]
    shift: tuple[tuple[float, ...], ...]
    drive: tuple[tuple[float, ...], ...]
    loss: tuple[float, ...]
    loss_place: float


_FIFTH = (-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946)

RODAS5P = RosenbrockTable(
    name="rodas5p",
    title="RODAS5P 5(4), implicit",
    order=5,
    error_order=4,
    gamma=0.21193756319429014,
    matrix=(
        (),
        (3.0,),
        (2.849394379747939, 0.45842242204463923),
        (-6.954028509809101, 2.489845061869568, -10.358996098473584),
        (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
        _FIFTH,
        (*_FIFTH, 1.0),
        (*_FIFTH, 1.0, 1.0),
    ),
    couplings=(
        (),
        (-14.155112264123755,),
        (-17.97296035885952, -2.859693295451294),
        (147.12150275711716, -1.41221402718213, 71.68940251302358),
        (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
        (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471),
        (
            30.91273214028599,
            -3.1208243349937974,
            77.79954646070892,
            34.28646028294783,
            -19.097331116725623,
            -28.087943162872662,
        ),
        (
            37.80277123390563,
            -3.2571969029072276,
            112.26918849496327,
            66.9347231244047,
            -40.06618937091002,
            -54.66780262877968,
            -9.48861652309627,
        ),
    ),
    source="G. Steinebach, BIT Numerical Mathematics 63 (2023) 27",
)

ROSENBROCK_TABLES = {table.name: table for table in (RODAS5P,)}
