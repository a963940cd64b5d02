"""A chain in the room and what is around it, as a viewer far away sees them.

A view is a matrix of three orthogonal unit vectors, shape (3, 3): what points to the right in the picture, what points
up, and what points towards the viewer.
"""

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from warpchain.inputs.floor import distances, heights
from warpchain.inputs.scene import floor_points
from warpchain.pictures.style import GROUND, INK

if TYPE_CHECKING:
    from warpchain.walks.walk_result import WalkResult

Array = NDArray[np.float64]

SIDE: Final = np.eye(3)
ABOVE: Final = np.eye(3)[[0, 2, 1]]
"""Its upper axis is z, which such a viewer sees grow downwards: invert it."""


def view_from(azimuth: float, elevation: float) -> Array:
    """A view with the vertical upright in the picture.

    Args:
        azimuth: angle [rad] of the viewer about the vertical: 0 beside the chain, a right angle in front of it.
        elevation: angle [rad] of the viewer above the floor.
    """
    sine, cosine, high, far = np.sin(azimuth), np.cos(azimuth), np.sin(elevation), np.cos(elevation)
    right, toward = np.array([cosine, 0.0, -sine]), np.array([sine * far, high, cosine * far])
    return np.stack([right, np.cross(toward, right), toward])


def link_outlines(joints: Array, radius: float) -> Array:
    """Outlines of the links of one chain in a picture: two circles and a waist between them.

    Args:
        joints: joint positions [m], shape (n, 2); link i reaches from joint i − 1 to joint i.
        radius: radius of the circles at the joints [m].

    Returns:
        Corners of a polygon for each link [m], anticlockwise, shape (n, c, 2).
    """
    half = (joints - np.roll(joints, 1, axis=0)) / 2
    middle = joints - half
    length = np.hypot(half[:, :1], half[:, 1:])
    # A link that points to the viewer has no direction in the picture: any will do.
    along = np.where(length > 0, half, (1.0, 0.0)) / np.where(length > 0, length, 1.0)
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


def draw_chain(
    axes: Axes, joints: Array, radius: float, view: Array, colors: Any, *, edge: float, halo: bool = True
) -> PolyCollection:
    """Draw one chain, its rearmost link first; odd links, the outer ones, cover their neighbours.

    Args:
        axes: where to draw.
        joints: joints in the room [m], shape (n, 3).
        radius: radius of the circles at the joints [m].
        view: where the viewer is.
        colors: of inner links, of outer links and of edges.
        edge: width of the edges [points].
        halo: whether to draw white around the chain, over what is behind it.
    """
    right, up, depth = view @ joints.T
    outlines = link_outlines(np.stack([right, up], axis=1), radius)
    behind = depth + np.roll(depth, 1)  # twice the depth of the middle of a link
    # Neighbours are at most a link apart in depth, where their circles meet; what else is so close hides nothing.
    behind[1::2] += 2 * np.linalg.norm(joints - np.roll(joints, 1, axis=0), axis=1).mean()
    order = np.argsort(behind, kind="stable")
    if halo:
        white: dict[str, Any] = {"facecolors": "white", "edgecolors": "white", "zorder": 2}
        axes.add_collection(PolyCollection(list(outlines), linewidths=4 * edge + 0.8, **white), autolim=False)
    fills = [colors[link % 2] for link in order]
    links = PolyCollection(list(outlines[order]), facecolors=fills, edgecolors=[colors[2]], linewidths=edge, zorder=2)
    axes.add_collection(links, autolim=False)
    return links


def sprocket_circle(walk: "WalkResult") -> Array | None:
    """Points of the sprocket's circle x, y, z [m], shape (100, 3); None without one."""
    if walk.sprocket_center is None:
        return None
    angle = np.linspace(0.0, 2 * np.pi, 100)
    circle = walk.sprocket_radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return np.asarray(circle + np.array([*walk.sprocket_center, 0.0]))


def walk_box(walk: "WalkResult", joints: Array) -> tuple[Array, Array]:
    """Least and greatest x, y, z of a walk and its sprocket, with a margin; from the floor on [m], each shape (3,)."""
    parameters = walk.setup.parameters
    margin = parameters.circle_radius + 2 * max(parameters.circle_radius, parameters.half_width)
    low, high = joints.min(axis=(0, 1)) - margin, joints.max(axis=(0, 1)) + margin
    circle = sprocket_circle(walk)
    if circle is not None:
        low, high = np.minimum(low, circle.min(axis=0)), np.maximum(high, circle.max(axis=0))
    low[1] = floor_line(walk, low[0], high[0])[:, 1].min()
    return low, high


def floor_line(walk: "WalkResult", left: float, right: float) -> Array:
    """The floor's profile from one x to another [m], shape (p, 2)."""
    points = floor_points(walk.setup.scene)
    inner = np.empty((0, 2)) if points is None else points[(points[:, 0] > left) & (points[:, 0] < right)]
    ends = np.array([left, right])
    first, last = np.column_stack([ends, floor_height(walk, ends)])
    return np.vstack([first, inner, last])


def floor_height(walk: "WalkResult", x: Any) -> Any:
    """Height of the floor at x [m]."""
    points = floor_points(walk.setup.scene)
    return 0.0 * x if points is None else heights(points, x)


def from_floor(walk: "WalkResult", joints: Array) -> Array:
    """Distance of joints x, y from the floor [m], shape (…, n, 2) → (…, n)."""
    points = floor_points(walk.setup.scene)
    return joints[..., 1] if points is None else distances(points, joints.reshape(-1, 2)).reshape(joints.shape[:-1])


def draw_ground(axes: Axes, line: Array, bottom: float) -> None:
    """The floor along a line from left to right, from the side, down to `bottom` [m]."""
    axes.add_patch(Polygon([(line[0, 0], bottom), *line, (line[-1, 0], bottom)], facecolor=GROUND, zorder=3))
    axes.plot(*line.T, color=INK, linewidth=1.0, zorder=3)
