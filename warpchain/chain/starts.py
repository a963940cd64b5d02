"""Initial positions and velocities of chains, for many walks at once."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from warpchain.chain.setup import Setup
from warpchain.chain.start_shapes import Curve, ellipse, lay_chains, stadium
from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError


class Shape(NamedTuple):
    """The curves along which chains start, and the refusal of one that no chain of the scene's number of links fits."""

    curve: Callable[[Sequence[Setup]], Curve]
    refusal: str


HUNG: Final = Shape(
    lambda setups: stadium([setup.joint_radius for setup in setups]),
    "scene.links: {links} links do not reach around the sprocket; use more",
)
"""The shape of starts on a sprocket."""
SHAPES: Final[Mapping[str, Shape]] = {
    "ellipse": Shape(
        lambda setups: ellipse([setup.scene.ellipse_aspect for setup in setups]),
        "scene.ellipse_aspect: too far from 1 for {links} links; use a value closer to 1",
    ),
}
"""Start without a sprocket, as in `warpchain.inputs.starts.STARTS` → its shape."""


def first_motions(setups: Sequence[Setup]) -> tuple[Array, Array]:
    """How chains of equal length and start lie and move at first, about the centre of their sprockets or curves.

    Positions x, y [m], θ [rad] of each link and their rates, (w, n, 3) each. Chains are laid together, which takes a
    tenth of the time, and to the bit as alone. An `InputError` says that a chain does not fit its curve.
    """
    links, start = setups[0].scene.links, setups[0].scene.start
    shape = HUNG if setups[0].has_drive else SHAPES[start]
    length = np.array([setup.parameters.link_length for setup in setups])
    speed = 2 * np.pi * np.array([setup.scene.frequency * setup.joint_radius for setup in setups])
    phase = np.zeros(len(setups)) if shape is HUNG else np.array([setup.scene.phase for setup in setups])
    curve = shape.curve(setups)
    position, velocity, fits = lay_chains(curve, links, length, 0.0 * speed if start == "rest" else speed, phase)
    if not fits.all():
        raise InputError(shape.refusal.format(links=links))
    return position, velocity
