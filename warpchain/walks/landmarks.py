"""What is told of a walk beside its motion: the loop at the release, a plane that tilts, bounces, what is inaccurate.

The values of a plane are those of :mod:`warpchain.kernels.layout`: lateral speed, two rates, the components of the
room's X and Y axes along the plane's axes e1, e2, e3, and the origin in the room. Z = X × Y points to the right of the
way that the chain walks.
"""

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpchain.inputs.arrays import Array
from warpchain.inputs.floor import slope_points
from warpchain.inputs.scene import link_values
from warpchain.inputs.setup import Setup
from warpchain.inputs.validation import InputError
from warpchain.kernels import layout

RELEASE: Final = {
    "center_x": "x of the centre of mass",
    "center_y": "y of the centre of mass",
    "width": "width of the joints' outline",
    "height": "height of the joints' outline, in their plane",
    "lowest": "y of the lowest point of all circles",
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
ENERGY_REMEDY: Final = (
    f"more than {100 * MOST_ENERGY_ERROR:g} % of the energy at release is unaccounted for; lower options.tolerance"
)
FAULTS: Final = {
    "energy": ENERGY_REMEDY,
    "opening": "joints opened by more than a link length, so that the chain came apart; lower the masses or "
    "options.tolerance, or raise parameters.joint_stiffness",
    "penetration": "circles sank in by more than the least radius, through what they touched; "
    "lower options.contact_step",
}
"""Faults of a walk, each with what it means and what to try."""
LENGTHS: Final = ("link_length", "circle_radius", "link_radii", "charm_radius")
"""Quantities against which openings and penetrations are held."""


def bounces(time: Array, velocity: Array, setup: Setup) -> dict[str, Array]:
    """`WalkResult.bounce_table` from times and velocities of the centre of mass.

    Gravity and floor alone push the centre: J = m Δv + m g Δt, and a velocity between two samples is linear in time.
    """
    scene, parameters = setup.scene, setup.parameters
    if scene.plane == "tilting" or scene.floor != "flat":
        raise InputError("bounces: the plane tilts, or the floor is a profile; give a walk on a flat floor or a slope")
    free = time >= (scene.release[-1][0] if scene.release else 0.0)  # of a sprocket that moves on after the release
    time, speed = time[free], np.abs(velocity).max(initial=0.0)
    mass = link_values(scene, parameters).total_mass
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
    return dict(zip(BOUNCE, table.T, strict=True))


def released_plane(setup: Setup, position: Array) -> Array:
    """The plane of a chain at its release, (PLANE_VALUES,).

    It is tilted about a line along the room's X axis. Its lowest point stays at its height, and the centre of mass
    stays above z = 0 and moves sideways at the scene's lateral speed. The position, (n, 3), is in the upright plane.
    """
    scene, parameters = setup.scene, setup.parameters
    links = link_values(scene, parameters)
    masses = links.mass
    center_x, center_y, _ = masses @ position / masses.sum()
    ends = position[:, 1] - parameters.link_length / 2 * np.abs(np.sin(position[:, 2]))  # the lower ones of all links
    lowest = float(np.min(ends - links.radius))
    sine, cosine = math.sin(scene.tilt), math.cos(scene.tilt)
    turn_x, turn_y = -scene.tilt_rate, scene.yaw_rate
    plane = np.zeros(layout.PLANE_VALUES)
    plane[layout.PLANE_SPEED] = scene.lateral_speed - turn_x * center_y + turn_y * center_x
    plane[layout.PLANE_TURN_X], plane[layout.PLANE_TURN_Y] = turn_x, turn_y
    plane[layout.AHEAD : layout.AHEAD + 3] = 1.0, 0.0, 0.0
    plane[layout.UP : layout.UP + 3] = 0.0, cosine, sine
    raised = lowest * (1 - cosine) + parameters.half_width * abs(sine)
    plane[layout.ORIGIN : layout.ORIGIN + 3] = 0.0, raised, center_y * sine
    return plane


def angles(planes: Array) -> tuple[Array, Array]:
    """Tilt and yaw [rad] of planes, shape (…, ≥ PLANE_VALUES); yaw within (−π, π], anticlockwise from above."""
    ahead, up = (planes[..., first : first + 3] for first in (layout.AHEAD, layout.UP))
    sideways = np.cross(ahead, up)
    return np.arcsin(np.clip(up[..., 2], -1.0, 1.0)), np.arctan2(-sideways[..., 0], ahead[..., 0])


def frame_axes(planes: Array) -> Array:
    """e1 and e2 in the room, shape (f, 2, 3), of planes (f, PLANE_VALUES)."""
    ahead, up = (planes[:, first : first + 3] for first in (layout.AHEAD, layout.UP))
    axes = np.stack([ahead, up, np.cross(ahead, up)], axis=1)  # room axes along axis 1, components along axis 2
    return np.ascontiguousarray(axes[:, :, :2].transpose(0, 2, 1))


def state_of_plane(plane: Array) -> dict[str, Array]:
    """The fields of a `State` that tell its plane, (PLANE_VALUES,)."""
    origin = plane[layout.ORIGIN : layout.ORIGIN + 3]
    return {"origin": origin, "axes": frame_axes(plane[None])[0], "plane_rates": plane[:3]}


def energy_error(at_release: ArrayLike, residual: ArrayLike) -> NDArray[np.float64]:
    """Size of the energy unaccounted for [J], relative to kinetic and potential energy at release; NaN before it."""
    energy = np.asarray(at_release, np.float64)
    return np.abs(residual) / np.where(energy > 0, energy, np.nan)


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
