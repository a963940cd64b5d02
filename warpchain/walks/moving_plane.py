"""A plane that tilts, as seen from the host: at the release, its angles, positions in the laboratory frame.

The values of a plane are those of :mod:`warpchain.kernels.layout`: lateral speed, two rates, the components of the
room's X and Y axes along the plane's axes e1, e2, e3, and the origin in the room. Z = X × Y points to the right of the
way that the chain walks.
"""

import math

import numpy as np

from warpchain.chain.setup import Setup
from warpchain.inputs.arrays import Array
from warpchain.kernels import layout


def released_plane(setup: Setup, position: Array) -> Array:
    """The plane of a chain at its release, (PLANE_VALUES,).

    It is tilted about a line along the room's X axis. Its lowest point stays at its height, and the centre of mass
    stays above z = 0 and moves sideways at the scene's lateral speed. The position, (n, 3), is in the upright plane.
    """
    scene, parameters = setup.scene, setup.parameters
    links = setup.link_values
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
    """e1 and e2 in the laboratory frame, shape (f, 2, 3), of planes (f, PLANE_VALUES)."""
    ahead, up = (planes[:, first : first + 3] for first in (layout.AHEAD, layout.UP))
    axes = np.stack([ahead, up, np.cross(ahead, up)], axis=1)  # room axes along axis 1, components along axis 2
    return np.ascontiguousarray(axes[:, :, :2].transpose(0, 2, 1))


def state_of_plane(plane: Array) -> dict[str, Array]:
    """The fields of a `State` that tell its plane, (PLANE_VALUES,)."""
    origin = plane[layout.ORIGIN : layout.ORIGIN + 3]
    return {"origin": origin, "axes": frame_axes(plane[None])[0], "plane_rates": plane[:3]}
