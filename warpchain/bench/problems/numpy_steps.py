"""Steps of an explicit method on the NumPy model one by one: what the estimate of each says of its error.

The kernels keep the estimate of a step to themselves. Here are the same tableau, the same error norm and the same
controller in NumPy.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpchain.bench.starts import State
from warpchain.engine.batch import FIRST_STEP
from warpchain.kernels.methods.controller import GREATEST_GROWTH, LEAST_SHRINKAGE, SAFETY
from warpchain.kernels.methods.explicit_tableaus import Tableau

Array = NDArray[np.float64]
Acceleration = Callable[[Array, Array], Array]
"""q'' of position and velocity, all of one shape."""


@dataclass(frozen=True)
class Step:
    """One attempted step.

    Attributes:
        start: Position and velocity before it.
        length: h [s].
        end: Position and velocity after it.
        estimate: The method's estimate of the errors of both.
        rates: Velocity and acceleration at the start.
    """

    start: State
    length: float
    end: State
    estimate: State
    rates: State

    def ratio(self, errors: State) -> float:
        """Greatest |e| / (1 + |y| + h |ẏ|) of errors of position and velocity, odeint's norm."""
        return max(
            float((np.abs(error) / (1 + np.abs(value) + self.length * np.abs(rate))).max())
            for error, value, rate in zip(errors, self.start, self.rates, strict=True)
        )


def attempt(tableau: Tableau, acceleration: Acceleration, start: State, length: float) -> Step:
    """One step of a method from a state.

    Args:
        tableau: Of the method.
        acceleration: Right-hand side.
        start: Position and velocity.
        length: h [s].
    """
    position, velocity = start
    stages: list[Array] = []

    def total(weights: tuple[float, ...]) -> Array:
        return sum((w * k for w, k in zip(weights, stages, strict=False) if w), np.zeros_like(velocity))

    for node, to_velocity, to_position in zip(tableau.nodes, tableau.velocity, tableau.position, strict=True):
        stage_position = position + node * length * velocity + length**2 * total(to_position)
        stages.append(acceleration(stage_position, velocity + length * total(to_velocity)))
    end = (
        position + length * velocity + length**2 * total(tableau.position_weights),
        velocity + length * total(tableau.velocity_weights),
    )
    estimate = length**2 * total(tableau.position_errors), length * total(tableau.velocity_errors)
    return Step(start, length, end, estimate, (velocity, stages[0]))


def accepted_steps(
    tableau: Tableau, acceleration: Acceleration, start: State, duration: float, tolerance: float
) -> list[Step]:
    """The accepted steps of a flight, their lengths set by odeint's controller as in the kernels.

    Args:
        tableau: Of the method.
        acceleration: Right-hand side.
        start: Position and velocity.
        duration: Of the flight [s].
        tolerance: Of each step.
    """
    state, now, proposed, steps = start, 0.0, FIRST_STEP, list[Step]()
    while now < duration:
        length = min(proposed, duration - now)
        step = attempt(tableau, acceleration, state, length)
        error = step.ratio(step.estimate) / tolerance
        if not error <= 1:
            shrinkage = SAFETY * error ** (-1 / (tableau.error_order - 1))
            proposed = length * max(shrinkage, float(LEAST_SHRINKAGE))
            continue
        growth = min(SAFETY * max(error, 5.0**-tableau.order) ** (-1 / tableau.order), GREATEST_GROWTH)
        proposed = max(proposed, length * growth) if error < 0.5 else proposed
        state, now = step.end, now + length
        steps.append(step)
    return steps
