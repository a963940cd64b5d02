"""States that speed is measured from: a chain in the air, and a pile on the floor."""

import math

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.run.simulation import simulate
from warpchain.status import Status

Array = NDArray[np.float64]
State = tuple[Array, Array]
"""Position (n, 3) and velocity (n, 3) of a chain."""


def flying(links: int, parameters: Parameters) -> State:
    """An ellipse circulating at 5 m/s, 5 m above the floor."""
    position, velocity = lay_chain(ellipse(1.5), links, parameters.link_length, speed=5.0)
    position[:, 1] += 5.0
    return position, velocity


def piled(links: int, device: str = "cpu") -> State:
    """A slowly circulating ellipse of soft joints that has dropped to the floor.

    Raises:
        RuntimeError: The simulation of its fall failed.
    """
    parameters = preset("soft")
    position, velocity = lay_chain(ellipse(1.5), links, parameters.link_length, speed=0.3)
    position[:, 1] += 0.02 - position[:, 1].min()
    fall = math.sqrt(2 * np.ptp(position[:, 1]) / parameters.gravity)
    end = simulate(parameters, position, velocity, 2 * fall, times=[2 * fall], method="dp5", device=device)
    if end.status != Status.FINISHED:
        raise RuntimeError(f"the chain of {links} links did not come down: {end.status.sentence}")
    return end.position[-1], end.velocity[-1]
