"""Derived quantities of a walk: the loop at the release, bounces, and inaccuracies."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpchain.chain.floor import slope_points
from warpchain.chain.setup import Setup
from warpchain.inputs.arrays import Array

RELEASE: Final = {
    "center_x": "x of the centre of mass",
    "center_y": "y of the centre of mass",
    "width": "width of the joints' outline",
    "height": "height of the joints' outline, in their plane",
    "lowest": "y of the lowest point of all contact circles",
}
"""Keys of `WalkResult.release`."""
PAUSE: Final = 0.01
"""A floor impulse so long [s] after the one before begins a new bounce, as kernels count them."""
SLIDES: Final = 1e-6
"""By how much less, relative to friction times its normal part, an impulse shows that something sticks …"""
FAINT: Final = 1e-9
"""… and how small it is, relative to the momentum of the walk, if nothing touches: rounding is 1e-13."""
BOUNCE: Final = ("start", "end", "impulse_x", "impulse_y", "sticks_at")
"""Columns of a table of bounces."""
MOST_ENERGY_ERROR: Final = 0.05
"""Greatest energy error of a walk that nothing warns of."""
FAULTS: Final = {
    "energy": f"the energy balance lacks more than {100 * MOST_ENERGY_ERROR:g} % of the energy at the release; "
    "lower options.tolerance",
    "opening": "joints separated by more than a link length, so the chain came apart; lower the masses or "
    "options.tolerance, or raise parameters.joint_stiffness",
    "penetration": "contact circles penetrated by more than the smallest radius, i.e. completely; "
    "lower options.contact_step",
}
"""Faults of a walk → what happened, and what to try."""
LENGTHS: Final = ("link_length", "circle_radius", "link_radii", "charm_radius")
"""Quantities against which openings and penetrations are held."""


def bounces(time: Array, velocity: Array, setup: Setup) -> dict[str, Array]:
    """`WalkResult.bounce_table` from times and velocities of the centre of mass.

    Gravity and floor alone push the centre: J = m Δv + m g Δt, and a velocity between two samples is linear in time.
    Whether something sticks shows if all contacts have one normal, and friction has one direction.
    """
    scene, parameters = setup.scene, setup.parameters
    free = time >= (scene.release[-1][0] if scene.release else 0.0)  # of a sprocket that moves on after the release
    time, speed = time[free], np.abs(velocity).max(initial=0.0)
    mass = setup.link_values.total_mass
    gained = mass * (velocity[free] + np.outer(time, [0.0, parameters.gravity]))
    impulse, (along_x, along_y) = np.diff(gained, axis=0), slope_points(scene.slope)[1]
    pushed, pressed = impulse @ [along_x, along_y], impulse @ [-along_y, along_x]
    sticks = np.abs(pushed) < (1 - SLIDES) * parameters.floor_friction * pressed
    touched = np.flatnonzero(np.hypot(*impulse.T) > FAINT * mass * speed)
    begins = (np.diff(touched, prepend=-2) > 1) & (np.diff(time[touched], prepend=-np.inf) > PAUSE)
    parts = np.split(touched, np.flatnonzero(begins)[1:]) if len(touched) else []
    rows = [
        (time[part[0]], time[part[-1] + 1], *gained[part[-1] + 1] - gained[part[0]], *time[part[sticks[part]] + 1][:1])
        for part in parts
    ]
    table = np.array([(*row, np.nan)[: len(BOUNCE)] for row in rows]).reshape(-1, len(BOUNCE))
    columns = BOUNCE if scene.plane == "fixed" and scene.floor == "flat" else BOUNCE[:-1]
    return dict(zip(columns, table.T[: len(columns)], strict=True))


def energy_error(at_release: ArrayLike, residual: ArrayLike) -> NDArray[np.float64]:
    """Size of the energy unaccounted for [J], relative to kinetic and potential energy at release; NaN before it."""
    with np.errstate(divide="ignore", invalid="ignore"):  # infinite if there was none
        return np.asarray(np.abs(residual) / np.maximum(at_release, 0.0))


def least(value: Any) -> float:
    """The least of a number or of several; ∞ for None."""
    return float(np.min(np.inf if value is None else value))


def faults(energy_error: Any, opening: Any, penetration: Any, lengths: Mapping[str, Any]) -> dict[str, Any]:
    """Whether walks have each of `FAULTS`: of numbers or arrays; NaN is no fault.

    Given are the greatest opening of a joint and penetration of a circle [m], and the `least` of each of `LENGTHS` [m].
    """
    link_length, circle_radius, link_radii, charm_radius = (lengths[name] for name in LENGTHS)
    radius = np.minimum(charm_radius, np.where(np.isinf(link_radii), circle_radius, link_radii))
    found = energy_error > MOST_ENERGY_ERROR, opening > link_length, penetration > radius
    return dict(zip(FAULTS, found, strict=True))
