"""Initial positions and velocities of chains, for many walks at once."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from warpchain.chain.setup import Setup
from warpchain.chain.start_shapes import Curve, ellipse, lay_chains, stadium
from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError

Motion = tuple[Array, Array]
"""Position x, y [m], θ [rad] of each link and their rates, (n, 3) each."""


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


def first_motions(setups: Sequence[Setup]) -> list[Motion | None]:
    """How the chain of each walk lies and moves when the walk begins, about the centre of its sprocket or its curve.

    A walk that begins from a given state has None. Chains of equal length and start are laid together, which takes a
    fifth of the time, and to the bit as alone. An `InputError` says that a chain does not fit its curve.
    """
    alike: dict[tuple[int, str], list[int]] = defaultdict(list)
    for place, setup in enumerate(setups):
        if setup.start is None:
            alike[setup.scene.links, setup.scene.start].append(place)
    motions: list[Motion | None] = [None] * len(setups)
    for (links, start), places in alike.items():
        chosen = [setups[place] for place in places]
        shape = HUNG if chosen[0].has_drive else SHAPES[start]
        length = np.array([setup.parameters.link_length for setup in chosen])
        speed = 2 * np.pi * np.array([setup.scene.frequency * setup.joint_radius for setup in chosen])
        phase = np.zeros(len(chosen)) if shape is HUNG else np.array([setup.scene.phase for setup in chosen])
        laid = lay_chains(shape.curve(chosen), links, length, 0.0 * speed if start == "rest" else speed, phase)
        for place, position, velocity, fits in zip(places, *laid, strict=True):
            if not fits:
                raise InputError(shape.refusal.format(links=links))
            motions[place] = position, velocity
    return motions
