"""Constants of a world, from the parameters of its chain, what each link has of its own, and its scene."""

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.link_values import LinkValues
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene, contact_radius
from warpchain.kernels.types import CHAIN_NUMBERS


def constants_of(parameters: Parameters, own: LinkValues, scene: Scene | None) -> NDArray[np.void]:
    """An element of :attr:`Model.chains`; parameters fill the fields of their names, a scene adds what it decides."""
    half = parameters.link_length / 2
    values = vars(parameters) | {
        "link_count": len(own.mass),
        "half_length": half,
        "inverse_square": 1 / (half * half),
        "mass": own.total_mass,
        "circle_radius": own.radius.max(),
        "inverse_smoothing": 1 / parameters.friction_smoothing,
    }
    if scene is not None:
        values["sprocket_radius"] = contact_radius(scene, parameters)
    numbers = np.zeros((), dtype=CHAIN_NUMBERS)
    for name in CHAIN_NUMBERS["names"]:
        if name in values:
            numbers[name] = values[name]
    return numbers
