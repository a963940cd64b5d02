"""Chains for the hybrid method: closed loops in flight, and loops that fall on the floor."""

import numpy as np
from numpy.typing import NDArray

from tests.oracle_model import motion_equations
from tests.support.rigid_joints import projected
from warpchain import preset
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.start_shapes import ellipse, lay_chain

Array = NDArray[np.float64]

PAPER = preset("paper")


def loop(links: int, parameters: Parameters = PAPER, speed: float = 2.0) -> tuple[Array, Array]:
    """A circulating ellipse in the air with joints that are closed and stay so, in NumPy to rounding.

    Args:
        links: n.
        parameters: Of the chain.
        speed: Along the loop [m/s].
    """
    position, velocity = lay_chain(ellipse(1.3), links, parameters.link_length, speed, 0.1)
    position[:, 1] += 0.3
    velocity[:, 2] += 0.5 * np.sin(7.0 * np.arange(links))
    return projected(position, velocity, parameters)


def falling(
    links: int, parameters: Parameters, phase: float, speed: float = 2.0, fall: float = 2.0
) -> tuple[Array, Array]:
    """A circulating ellipse 0.1 mm above the floor, falling: position and velocity (n, 3).

    Args:
        links: n.
        parameters: Of the chain.
        phase: Place of the first joint as a fraction of the ellipse.
        speed: Along the loop [m/s].
        fall: Downwards [m/s].
    """
    position, velocity = lay_chain(ellipse(1.3), links, parameters.link_length, speed, phase)
    ends = np.concatenate(motion_equations.link_ends(position, parameters))
    position[:, 1] += parameters.circle_radius + 1e-4 - ends[:, 1].min()
    return position, velocity - [0.0, fall, 0.0]
