"""Chains for the hybrid method that fly on rigid joints, or fall and bounce on their springs; on any device."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tests.support.rigid_joints import projected
from warpchain import Status, preset
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels.features import Features
from warpchain.oracle import motion_equations

Array = NDArray[np.float64]

PAPER = preset("paper")
CONTACT_STEP = 1e-6
"""In s; on springs every step then has this length, in both forms to the bit."""


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


def batch_with(
    chains: Sequence[tuple[Array, Array]], parameters: Parameters = PAPER, *, softness: float = 0.0, **options: object
) -> Batch:
    """A batch of method hybrid with these chains (position, velocity), on springs that may close at once."""
    settings = Options.model_validate({"method": "hybrid"} | options)
    batch = Batch(len(chains), max(len(position) for position, _ in chains), settings)
    batch.control.launch_time = np.inf
    for world, (position, velocity) in enumerate(chains):
        batch.set_chain(world, parameters, len(position))
        batch.load(world, position, velocity, stop_time=1.0, stop_status=Status.FINISHED, softness=softness)
    return batch


def bouncing(chains: Sequence[tuple[Array, Array]], **options: object) -> tuple[Batch, Features]:
    """A batch whose chains meet the floor, one another's links and a watch, in steps of CONTACT_STEP on springs."""
    settings = {"tolerance": 1e-3, "soften_pile": True, "contact_step": CONTACT_STEP} | options
    batch = batch_with(chains, **settings)  # type: ignore[arg-type]
    return batch, batch.features(fixed_body="floor", watch="rest")
