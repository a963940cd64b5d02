"""What figures need of a walk, whichever class holds it."""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from warpchain.loop.stationary_loop import HeldWalk
from warpchain.status import Status

Array = NDArray[np.float64]

Kind = Literal["figure5", "film_strip", "loop", "energy"]
"""Figures of a walk."""


@dataclass(frozen=True, kw_only=True)  # frozen: its attributes are only read
class Walk(HeldWalk, Protocol):
    """A walk with t instants and f frames of a chain of n links.

    Attributes:
        status: how it ended.
        dx: distance walked [m]; NaN unless the chain came to rest.
        time: time since the release [s], shape (t,).
        center: centre of mass x, y [m], shape (t, 2).
        center_velocity: its velocity [m/s], shape (t, 2).
        frame_time: times of the frames [s], shape (f,).
        frame_joints: joints x, y [m], shape (f, n, 2); joint i ends link i.
        sprocket_radius: radius of the sprocket that links touch [m]; NaN without one.
    """

    status: Status
    dx: float
    time: Array
    center: Array
    center_velocity: Array
    frame_time: Array
    frame_joints: Array
    sprocket_radius: float


class EnergyWalk(Walk, Protocol):
    """A walk with the energies of its chain.

    Attributes:
        energy: ledger of the walk [J], see `WalkResult.energy`.
        kinetic_energy: kinetic energy [J], shape (t,).
        gravitational_energy: energy in the field of gravity [J], shape (t,).
        spring_energy: energy of the joint springs [J], shape (t,).
    """

    energy: dict[str, float]
    kinetic_energy: Array
    gravitational_energy: Array
    spring_energy: Array


def setting(walk: Walk) -> str:
    """Links and frequency, as a title."""
    return f"{walk.setup.scene.links} links, {walk.setup.scene.frequency:g} Hz"
