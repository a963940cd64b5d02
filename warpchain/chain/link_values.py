"""Properties of each link and joint of a chain: two kinds of links in turn, values for each, or a rule.

A link of a chain of two kinds has its kind's mass and inertia; all circles are alike, and all joints have the same
friction. `Scene` may give values for each link instead (`link_masses` …), let masses grow along the chain, hang a charm
on one link and make one joint stiff.

Arrays are of one chain of n links, (n,), or of w chains of as many links each, (w, n); so a number is one, or (w,).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from warpchain.inputs.arrays import Array
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import OF_LINKS, Scene

LEAST_INERTIA: Final = 0.5
"""Part of its rotary inertia that a link must keep under scaled loads."""


@dataclass(frozen=True)
class LinkValues:
    """Values of the n links of a chain and of its n joints, (…, n) each; joint i is at the end of link i.

    Mass [kg] and moment of inertia about its centre [kg m²] of each link, β [N m s] and τ_c [N m] of each joint, radius
    of both circles of each link [m].
    """

    mass: Array
    inertia: Array
    viscous_friction: Array
    coulomb_friction: Array
    radius: Array

    @property
    def alternates(self) -> Any:
        """Whether each link is like the next but one, as in a chain of two kinds, and each joint likewise."""
        rows = vars(self).values()
        return np.logical_and.reduce([(row[..., 2:] == row[..., :-2]).all(-1) for row in rows])

    @property
    def total_mass(self) -> Any:
        """Mass of the chain [kg]; of two kinds of links as many times the rounded sum of a pair as there are pairs."""
        pairs = self.mass[..., ::2].copy()
        pairs[..., : self.mass.shape[-1] // 2] += self.mass[..., 1::2]
        return _of_rows(pairs, lambda pair: pair * pairs.shape[-1], math.fsum)

    @property
    def mean_mass(self) -> Any:
        """Mean mass of the links [kg], see `mean_value`."""
        if self.mass.shape[-1] % 2:
            count = self.mass.shape[-1]
            return _of_rows(self.mass, lambda mass: mass * count / count, mean_value)
        pairs = self.mass[..., ::2] + self.mass[..., 1::2]
        return _of_rows(pairs, lambda pair: pair / 2, _mean_of_pairs)

    def greatest_load(self, link_length: ArrayLike) -> Any:
        """Greatest `Scene.load_factor` that leaves every link `LEAST_INERTIA` of its rotary inertia.

        It is I − mℓ²/6 that is multiplied: point-like links lose inertia. Infinite where I ≥ mℓ²/6.
        """
        missing = self.mass * np.asarray(link_length)[..., np.newaxis] ** 2 / 6 - self.inertia
        with np.errstate(divide="ignore"):
            bearable = 1 + (1 - LEAST_INERTIA) * self.inertia / missing
        return np.where(missing > 0, bearable, math.inf).min(-1)


def _of_rows(values: Array, alike: Callable[[Array], Array], unlike: Callable[[Array], float]) -> Any:
    """A number of each row of values (…, k): of rows of equal values by that value, as arrays, of others one by one."""
    found = np.array(alike(values[..., 0]))
    is_unlike = (values != values[..., :1]).any(-1)
    for place in map(tuple, np.argwhere(is_unlike)) if is_unlike.any() else ():
        found[place] = unlike(values[place])
    return found[()]


def mean_value(values: Array) -> float:
    """Mean of values of links or joints; of two kinds in turn half of the rounded sum of a pair."""
    if len(values) % 2:
        return math.fsum(values) / len(values)
    return _mean_of_pairs(values[::2] + values[1::2])


def _mean_of_pairs(pairs: Array) -> float:
    """Half of the mean of sums of pairs."""
    return float(pairs[0] + math.fsum(pairs - pairs[0]) / len(pairs)) / 2


_INNER: Final = attrgetter("inner_mass", "inner_inertia", "viscous_friction", "coulomb_friction", "circle_radius")
_OUTER: Final = attrgetter("outer_mass", "outer_inertia", "viscous_friction", "coulomb_friction", "circle_radius")
_OWN: Final = (*OF_LINKS, "mass_gradient", "charm_radius", "charm_mass", "charm_inertia", "joint_friction_factor")
"""Fields of a scene by which a link or a joint may have values of its own."""
_UNLIKE: Final = attrgetter(*_OWN)
_ALIKE: Final = tuple(Scene.model_fields[name].default for name in _OWN)


def alternating(parameters: Parameters | Sequence[Parameters], links: int) -> LinkValues:
    """Chains of inner links 0, 2, 4, … and outer links 1, 3, 5, …, whose joints are alike."""
    given = [parameters] if isinstance(parameters, Parameters) else parameters
    first, second = (np.array([*map(kind, given)]).T[..., np.newaxis] for kind in (_INNER, _OUTER))
    values = np.empty((len(first), len(given), links))
    values[:, :, ::2], values[:, :, 1::2] = first, second
    return LinkValues(*(values[:, 0] if isinstance(parameters, Parameters) else values))


def link_values(scenes: Sequence[Scene], parameters: Sequence[Parameters]) -> LinkValues:
    """What each link and joint of the chains of some walks has of its own, (w, n)."""
    values = alternating(parameters, scenes[0].links)
    for place, scene in enumerate(scenes):
        if _UNLIKE(scene) == _ALIKE:
            continue
        for row, name in zip(vars(values).values(), OF_LINKS, strict=True):
            if (own := getattr(scene, name)) is not None:
                row[place] = own
        if scene.mass_gradient:
            growth = 1 + scene.mass_gradient * np.linspace(-1.0, 1.0, scene.links)
            values.mass[place] *= growth
            values.inertia[place] *= growth
        if scene.charm_radius is not None:
            values.radius[place, scene.charm_link] = scene.charm_radius
        if scene.charm_mass or scene.charm_inertia:
            values.mass[place, scene.charm_link] += scene.charm_mass
            values.inertia[place, scene.charm_link] += scene.charm_inertia
        if scene.joint_friction_factor != 1:
            values.viscous_friction[place, scene.stiff_joint] *= scene.joint_friction_factor
            values.coulomb_friction[place, scene.stiff_joint] *= scene.joint_friction_factor
    return values
