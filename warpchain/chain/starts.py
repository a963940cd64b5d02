"""Shapes of chains that start without a sprocket, circulating along a closed curve."""

import math
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from warpchain.chain.setup import Setup
from warpchain.chain.start_shapes import Curve, ellipse, lay_chain
from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError


class Shape(NamedTuple):
    """The curve of a start, and the refusal of one that no chain of the scene's number of links fits."""

    curve: Callable[[Setup], Curve]
    refusal: str


SHAPES: Final[Mapping[str, Shape]] = {
    "ellipse": Shape(
        lambda setup: ellipse(setup.scene.ellipse_aspect),
        "scene.ellipse_aspect: too far from 1 for {links} links; give one closer to it",
    ),
}
"""Start without a sprocket, as in `warpchain.inputs.starts.STARTS` → its shape."""


def laid_start(setup: Setup) -> tuple[Array, Array]:
    """Position and velocity (n, 3) of a chain that starts without a sprocket, about the origin, or an `InputError`."""
    scene, shape = setup.scene, SHAPES[setup.scene.start]
    speed = 2 * math.pi * scene.frequency * setup.joint_radius
    try:
        return lay_chain(shape.curve(setup), scene.links, setup.parameters.link_length, speed, scene.phase)
    except ValueError:
        raise InputError(shape.refusal.format(links=scene.links)) from None
