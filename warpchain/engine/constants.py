"""Constants of a world, from the parameters of its chain and what each link has of its own."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.link_values import LinkValues
from warpchain.inputs.parameters import Parameters
from warpchain.kernels.types import CHAIN_NUMBERS


def constants_of(parameters: Parameters, own: LinkValues, sprocket_radius: float | None) -> NDArray[np.void]:
    """An element of :attr:`Model.chains`.

    Args:
        parameters: Each fills the field of its name, if there is one.
        own: What each link and joint has of its own.
        sprocket_radius: Radius [m] at which circles touch the sprocket; None: the parameter's.
    """
    half = parameters.link_length / 2
    values = vars(parameters) | {
        "link_count": len(own.mass),
        "half_length": half,
        "inverse_square": 1 / (half * half),
        "mass": own.total_mass,
        "inverse_smoothing": 1 / parameters.friction_smoothing,
    }
    if sprocket_radius is not None:
        values["sprocket_radius"] = sprocket_radius
    numbers = np.zeros((), dtype=CHAIN_NUMBERS)
    for name in CHAIN_NUMBERS["names"]:
        if name in values:
            numbers[name] = values[name]
    return numbers


def rows_of(own: LinkValues) -> Sequence[NDArray[np.float64]]:
    """The rows of :attr:`Model.links`, in the order of :mod:`warpchain.kernels.layout`."""
    return own.mass, own.inertia, own.viscous_friction, own.coulomb_friction
