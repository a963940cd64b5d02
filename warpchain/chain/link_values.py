"""What each link and joint of a chain has of its own: two kinds of links in turn, values for each, or a rule.

A link of a chain of two kinds has its kind's mass and inertia; all circles are alike, and all joints have the same
friction. `Scene` may give values for each link instead (`link_masses` …), let masses grow along the chain, hang a charm
on one link and make one joint stiff.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from warpchain.inputs.arrays import Array
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import OF_LINKS, Scene

LEAST_INERTIA: Final = 0.5
"""Part of its rotary inertia that a link must keep under multiplied loads."""


@dataclass(frozen=True)
class LinkValues:
    """Values of the n links of a chain and of its n joints, shape (n,) each; joint i is at the end of link i.

    Mass [kg] and moment of inertia about its centre [kg m²] of each link, β [N m s] and τ_c [N m] of each joint, radius
    of both circles of each link [m].
    """

    mass: Array
    inertia: Array
    viscous_friction: Array
    coulomb_friction: Array
    radius: Array

    @property
    def alternates(self) -> bool:
        """Whether each link is like the next but one, as in a chain of two kinds, and each joint likewise."""
        return all(np.array_equal(row[2:], row[:-2]) for row in vars(self).values())

    @property
    def total_mass(self) -> float:
        """Mass of the chain [kg]; of two kinds of links as many times the rounded sum of a pair as there are pairs."""
        return math.fsum(np.add.reduceat(self.mass, range(0, len(self.mass), 2)))

    def greatest_load(self, link_length: float) -> float:
        """Greatest `Scene.load_factor` that leaves every link `LEAST_INERTIA` of its rotary inertia.

        It is I − mℓ²/6 that is multiplied: point-like links lose inertia. Infinite where I ≥ mℓ²/6.
        """
        missing = self.mass * link_length**2 / 6 - self.inertia
        short = missing > 0
        return float(np.min(1 + (1 - LEAST_INERTIA) * self.inertia[short] / missing[short], initial=math.inf))


def mean_value(values: Array) -> float:
    """Mean of values of links or joints; of two kinds in turn half of the rounded sum of a pair."""
    if len(values) % 2:
        return math.fsum(values) / len(values)
    pairs = values[::2] + values[1::2]
    return float(pairs[0] + math.fsum(pairs - pairs[0]) / len(pairs)) / 2


def alternating(parameters: Parameters, links: int) -> LinkValues:
    """A chain of inner links 0, 2, 4, … and outer links 1, 3, 5, …, whose joints are alike."""
    mass, inertia = np.full(links, parameters.inner_mass), np.full(links, parameters.inner_inertia)
    mass[1::2], inertia[1::2] = parameters.outer_mass, parameters.outer_inertia
    others = parameters.viscous_friction, parameters.coulomb_friction, parameters.circle_radius
    return LinkValues(mass, inertia, *(np.full(links, value) for value in others))


def link_values(scene: Scene, parameters: Parameters) -> LinkValues:
    """What each link and joint of the chain of a walk has of its own."""
    values = alternating(parameters, scene.links)
    for row, name in zip(vars(values).values(), OF_LINKS, strict=True):
        if (own := getattr(scene, name)) is not None:
            row[:] = own
    if scene.mass_gradient:
        growth = 1 + scene.mass_gradient * np.linspace(-1.0, 1.0, scene.links)
        values.mass[:] *= growth
        values.inertia[:] *= growth
    values.mass[scene.charm_link] += scene.charm_mass
    values.inertia[scene.charm_link] += scene.charm_inertia
    if scene.charm_radius is not None:
        values.radius[scene.charm_link] = scene.charm_radius
    values.viscous_friction[scene.stiff_joint] *= scene.joint_friction_factor
    values.coulomb_friction[scene.stiff_joint] *= scene.joint_friction_factor
    return values
