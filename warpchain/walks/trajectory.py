"""What a simulation of a given chain returns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpchain.status import Status

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Trajectory:
    """Motion of a chain of n links at t chosen instants, as `warpchain.simulate` returns it.

    Attributes:
        status: how the simulation ended.
        time: instants [s], shape (t,).
        position: x, y [m] and θ [rad] of each link's centre of mass, shape (t, n, 3).
        velocity: their rates [m/s, m/s, rad/s], shape (t, n, 3).
        steps_accepted: number of accepted steps.
        steps_rejected: number of rejected steps.
        impulses: number of impulses by kind of contact.
        losses: energy lost by cause [J], positive.
        greatest_opening: greatest distance between two joined link ends [m].
        greatest_penetration: greatest overlap by kind of contact [m].
    """

    status: Status
    time: Array
    position: Array
    velocity: Array
    steps_accepted: int
    steps_rejected: int
    impulses: dict[str, int]
    losses: dict[str, float]
    greatest_opening: float
    greatest_penetration: dict[str, float]

    def __repr__(self) -> str:
        """One line."""
        return f"<Trajectory of {self.position.shape[1]} links, {len(self.time)} instants: {self.status.label}>"
