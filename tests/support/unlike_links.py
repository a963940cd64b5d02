"""Chains whose links and joints all differ, for kernels and for the model in plain NumPy."""

from typing import Any

import numpy as np

from warpchain.chain.link_values import LinkValues
from warpchain.inputs.parameters import Parameters


class UnlikeLinks:
    """Parameters with values of each link and joint.

    Attributes:
        parameters: all that links have in common.
        own: what each has of its own.
        masses: of the links [kg].
        inertias: of the links [kg m²].
        viscous_friction: β of the joints [N m s].
        coulomb_friction: τ_c of the joints [N m].
        radii: of the circles of the links [m].
    """

    def __init__(self, parameters: Parameters, own: LinkValues) -> None:
        """Take both."""
        self.parameters, self.own = parameters, own
        self.masses, self.inertias = own.mass, own.inertia
        self.radii = own.radius
        self.viscous_friction, self.coulomb_friction = own.viscous_friction, own.coulomb_friction

    def __getattr__(self, name: str) -> Any:
        """What links have in common."""
        return getattr(self.parameters, name)


def unlike_links(links: int, parameters: Parameters, seed: int = 1) -> UnlikeLinks:
    """Links and joints with 0.3 to 3 times the values of the inner ones, and circles of 0.4 to 1 times the radius."""
    generator = np.random.default_rng(seed)
    usual = (parameters.inner_mass, parameters.inner_inertia, parameters.viscous_friction, parameters.coulomb_friction)
    values = [value * generator.uniform(0.3, 3.0, links) for value in usual]
    return UnlikeLinks(parameters, LinkValues(*values, parameters.circle_radius * generator.uniform(0.4, 1.0, links)))
