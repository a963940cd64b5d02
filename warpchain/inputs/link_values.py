"""What each link and joint of a chain has of its own."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.parameters import Parameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinkValues:
    """Values of the n links of a chain and of its n joints, shape (n,) each; joint i is at the end of link i.

    Attributes:
        mass: of each link [kg].
        inertia: moment of inertia of each link about its centre [kg m²].
        viscous_friction: β of each joint [N m s].
        coulomb_friction: τ_c of each joint [N m].
    """

    mass: Array
    inertia: Array
    viscous_friction: Array
    coulomb_friction: Array

    @property
    def total_mass(self) -> float:
        """Mass of the chain [kg]; of two kinds of links as many times the rounded sum of a pair as there are pairs."""
        return math.fsum(np.add.reduceat(self.mass, range(0, len(self.mass), 2)))


def alternating(parameters: Parameters, links: int) -> LinkValues:
    """A chain of inner links 0, 2, 4, … and outer links 1, 3, 5, …, whose joints are alike."""
    return LinkValues(
        mass=np.resize([parameters.inner_mass, parameters.outer_mass], links),
        inertia=np.resize([parameters.inner_inertia, parameters.outer_inertia], links),
        viscous_friction=np.full(links, parameters.viscous_friction),
        coulomb_friction=np.full(links, parameters.coulomb_friction),
    )
