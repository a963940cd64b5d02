"""Coefficients of W-methods (Rosenbrock methods that keep their order with any matrix for the Jacobian), as data."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WTable:
    """One embedded W-method for y' = f(y): (1 − hγ A) k_i = h f(y + Σ_j<i α_ij k_j) + h A Σ_j<i γ_ij k_j.

    Attributes:
        name: Its name in the literature.
        order: Order of the solution y + Σ b k, whatever the matrix A.
        error_order: Order of the embedded solution y + Σ b̂ k.
        gamma: γ.
        nodes: α; row i has i entries.
        couplings: γ_ij, likewise.
        weights: b.
        embedded: b̂.
        source: Where the coefficients were published.
    """

    name: str
    order: int
    error_order: int
    gamma: float
    nodes: tuple[tuple[float, ...], ...]
    couplings: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]
    embedded: tuple[float, ...]
    source: str

    @property
    def stages(self) -> int:
        """Number of stages."""
        return len(self.weights)

    @property
    def errors(self) -> tuple[float, ...]:
        """b − b̂."""
        return tuple(b - other for b, other in zip(self.weights, self.embedded, strict=True))


ROS34PW2 = WTable(
    name="ROS34PW2",
    order=3,
    error_order=2,
    gamma=4.3586652150845900e-1,
    nodes=(
        (),
        (8.7173304301691801e-1,),
        (8.4457060015369423e-1, -1.1299064236484185e-1),
        (0.0, 0.0, 1.0),
    ),
    couplings=(
        (),
        (-8.7173304301691801e-1,),
        (-9.0338057013044082e-1, 5.4180672388095326e-2),
        (2.4212380706095346e-1, -1.2232505839045147, 5.4526025533510214e-1),
    ),
    weights=(2.4212380706095346e-1, -1.2232505839045147, 1.5452602553351020, 4.3586652150845900e-1),
    embedded=(3.7810903145819369e-1, -9.6042292212423178e-2, 5.0e-1, 2.1793326075422950e-1),
    source="J. Rang, L. Angermann, BIT Numerical Mathematics 45 (2005) 761-787",
)
"""Four stages, order 3 with any matrix, stiffly accurate, R(∞) = 0."""
