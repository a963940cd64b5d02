"""Coefficients of ROS34PW2, a W-method: a Rosenbrock method that keeps its order with any matrix for the Jacobian.

Of y' = f(y), with a matrix A: y + Σ b k with (1 − hγ A) k_i = h f(y + Σ_j<i α_ij k_j) + h A Σ_j<i γ_ij k_j.
Four stages, order 3 with any A, stiffly accurate, R(∞) = 0: J. Rang, L. Angermann, BIT Numer. Math. 45 (2005) 761-787.
"""

STAGES = 4
GAMMA = 4.3586652150845900e-1
NODES: tuple[tuple[float, ...], ...] = (
    (),
    (8.7173304301691801e-1,),
    (8.4457060015369423e-1, -1.1299064236484185e-1),
    (0.0, 0.0, 1.0),
)
"""α; row i has i entries."""
COUPLINGS: tuple[tuple[float, ...], ...] = (
    (),
    (-8.7173304301691801e-1,),
    (-9.0338057013044082e-1, 5.4180672388095326e-2),
    (2.4212380706095346e-1, -1.2232505839045147, 5.4526025533510214e-1),
)
"""γ_ij, likewise."""
WEIGHTS = (2.4212380706095346e-1, -1.2232505839045147, 1.5452602553351020, 4.3586652150845900e-1)
"""b."""
EMBEDDED = (3.7810903145819369e-1, -9.6042292212423178e-2, 5.0e-1, 2.1793326075422950e-1)
"""b̂, of order 2."""
ERRORS = tuple(b - other for b, other in zip(WEIGHTS, EMBEDDED, strict=True))
ERROR_ORDER = 2
