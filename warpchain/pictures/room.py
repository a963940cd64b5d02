"""A chain in the room: views of it, its plane, and its links as solid bodies.

Room axes are X forward, Y up and Z = X × Y, to the right of the way the chain walks.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from warpchain.pictures.walk_shape import TiltingWalk, Walk

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class View:
    """A parallel projection, as a viewer far away sees the room: three orthogonal unit vectors, each of shape (3,).

    Attributes:
        right: what points to the right in the picture.
        up: what points up in the picture.
        toward: what points towards the viewer.
    """

    right: Array
    up: Array
    toward: Array

    def project(self, points: Array) -> Array:
        """Points x, y, z [m], shape (…, 3), in the picture: to the right and up [m], shape (…, 2)."""
        return np.stack([points @ self.right, points @ self.up], axis=-1)


def view_from(azimuth: float, elevation: float) -> View:
    """A view with the vertical upright in the picture.

    Args:
        azimuth: angle [rad] of the viewer about the vertical: 0 beside the chain, where it walks to the right; a right
            angle in front of it.
        elevation: angle [rad] of the viewer above the floor.
    """
    sine, cosine, high, far = np.sin(azimuth), np.cos(azimuth), np.sin(elevation), np.cos(elevation)
    right = np.array([cosine, 0.0, -sine])
    toward = np.array([sine * far, high, cosine * far])
    return View(right, np.cross(toward, right), toward)


SIDE: Final = view_from(0.0, 0.0)
ABOVE: Final = view_from(0.0, np.pi / 2)
FRONT: Final = view_from(np.pi / 2, 0.0)
CORNER: Final = (35.0, 22.0)
"""Azimuth and elevation [degrees] of the view that moving pictures begin with: from the front right, slightly above."""


def check_room(walk: TiltingWalk) -> Array:
    """The joints of a walk in the room [m], shape (f, n, 3).

    Raises:
        ValueError: they are not as many as the frames, or not all finite numbers.
    """
    joints = np.asarray(walk.joints_in_room)
    if joints.shape != (*walk.frame_joints.shape[:2], 3):
        raise ValueError(
            f"joints_in_room: its shape is {joints.shape}; give three coordinates for each joint of a frame"
        )
    if not np.all(np.isfinite(joints)):
        raise ValueError(f"walk: its frames are not all finite numbers. {walk.status.sentence}")
    return joints


def planes(joints: Array) -> tuple[Array, Array]:
    """The plane in which the joints of a chain lie.

    Args:
        joints: joints in the room [m], shape (…, n, 3).

    Returns:
        The mean of the joints [m], shape (…, 3), and two unit vectors at right angles in the plane, shape (…, 2, 3).
    """
    middle = joints.mean(axis=-2)
    offset = joints - middle[..., None, :]
    # Ascending: the first of the principal axes is across the plane, along which nothing extends.
    _, principal = np.linalg.eigh(np.swapaxes(offset, -1, -2) @ offset)
    return middle, np.swapaxes(principal[..., :0:-1], -1, -2)


def link_outlines(joints: Array, radius: float) -> Array:
    """Outlines of the links of one chain: two circles and a waist between them.

    Args:
        joints: joint positions [m], shape (n, 2); link i reaches from joint i − 1 to joint i.
        radius: radius of the circles at the joints [m].

    Returns:
        Corners of a polygon for each link [m], anticlockwise, shape (n, c, 2).
    """
    half = (joints - np.roll(joints, 1, axis=0)) / 2
    middle = joints - half
    along = half / np.hypot(half[:, :1], half[:, 1:])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    # Each corner: half lengths along the link, then radii along and across it.
    angle, ramp = np.linspace(-np.pi / 2, np.pi / 2, 9), np.linspace(1, -1, 7)[1:-1]
    cap = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
    waist = np.stack([ramp, np.zeros_like(ramp), 0.62 + 0.38 * ramp**2], axis=1)
    corners = np.concatenate([cap, waist, -cap, -waist])
    outlines: Array = (
        middle[:, None]
        + corners[:, :1] * half[:, None]
        + radius * (corners[:, 1:2] * along[:, None] + corners[:, 2:] * across[:, None])
    )
    return outlines


@dataclass(frozen=True, eq=False)
class Solids:
    """What a viewer sees of the links of one chain, each a flat body with two faces and a wall around it.

    Attributes:
        faces: corners of the face that is turned to the viewer [m], shape (n, c, 3).
        walls: corners of the pieces of the wall [m], shape (n, c, 4, 3).
        seen: which of these pieces are turned to the viewer, shape (n, c).
        order: numbers of the links, those behind first, shape (n,); odd links, the outer ones, cover their neighbours.
    """

    faces: Array
    walls: Array
    seen: NDArray[np.bool_]
    order: NDArray[np.intp]


def link_solids(joints: Array, radius: float, half_width: float, view: View) -> Solids:
    """The links of one chain as solid bodies.

    Args:
        joints: joints in the room [m], shape (n, 3); they lie in a plane.
        radius: radius of the circles at the joints [m].
        half_width: half of the width of a link, across the plane [m].
        view: where the viewer is.
    """
    middle, axes = planes(joints)
    outlines = link_outlines((joints - middle) @ axes.T, radius)
    normal = np.cross(*axes)
    normal *= half_width if normal @ view.toward >= 0 else -half_width
    corners = middle + outlines @ axes
    faces, backs = corners + normal, corners - normal
    edge = np.roll(outlines, -1, axis=1) - outlines
    outward = np.stack([edge[..., 1], -edge[..., 0]], axis=-1) @ axes
    walls = np.stack([faces, np.roll(faces, -1, axis=1), np.roll(backs, -1, axis=1), backs], axis=2)
    half = (joints - np.roll(joints, 1, axis=0)) / 2
    depth = (joints - half) @ view.toward
    # Neighbours are at most one link apart in depth, where their circles meet; what else is so close hides nothing.
    depth[1::2] += 2 * np.linalg.norm(half, axis=1).mean()
    return Solids(faces, walls, outward @ view.toward > 1e-9 * radius, np.argsort(depth, kind="stable"))


def center_in_room(walk: TiltingWalk) -> Array:
    """Centre of mass x, y, z [m], shape (t, 3)."""
    return np.column_stack([walk.center, walk.center_z])


def sprocket_circle(walk: Walk) -> Array | None:
    """Points of the sprocket's circle x, y, z [m], shape (100, 3); None without one."""
    if walk.sprocket_center is None:
        return None
    angle = np.linspace(0.0, 2 * np.pi, 100)
    x, y = walk.sprocket_center
    circle = walk.sprocket_radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return np.asarray(circle + np.array([x, y, 0.0]))


def room_box(walk: TiltingWalk, joints: Array) -> tuple[Array, Array]:
    """Least and greatest x, y, z of the whole walk, with a margin; from the floor on [m], each of shape (3,)."""
    parameters = walk.setup.parameters
    margin = 2 * max(parameters.circle_radius, parameters.half_width) + parameters.circle_radius
    low, high = joints.min(axis=(0, 1)) - margin, joints.max(axis=(0, 1)) + margin
    circle = sprocket_circle(walk)
    if circle is not None:  # what shows where the walk began
        low, high = np.minimum(low, circle.min(axis=0)), np.maximum(high, circle.max(axis=0))
    low[1] = 0.0
    return low, high


@dataclass(frozen=True)
class Floor:
    """The part of the floor that is shown, with the lines of a square grid [m].

    Attributes:
        spacing: of the lines.
        ends_x: its least and greatest x.
        ends_z: its least and greatest z.
        x: places of the lines across the way.
        z: places of the lines along the way.
    """

    spacing: float
    ends_x: tuple[float, float]
    ends_z: tuple[float, float]
    x: tuple[float, ...]
    z: tuple[float, ...]


def floor_of(low: Array, high: Array) -> Floor:
    """The floor below a box with these least and greatest x, y, z [m], at least as broad as the box is high."""
    missing = max(0.0, float(high[1] - low[1]) - float(high[2] - low[2])) / 2
    ends = [(float(low[0]), float(high[0])), (float(low[2]) - missing, float(high[2]) + missing)]
    longest = max(last - first for first, last in ends)
    spacing = next((step for step in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if longest / step <= 11), 10.0)
    x, z = (
        tuple(round(k * spacing, 6) for k in range(math.ceil(first / spacing), math.floor(last / spacing) + 1))
        for first, last in ends
    )
    return Floor(spacing, ends[0], ends[1], x, z)
