"""Drawing of a chain and its surroundings in the laboratory frame, as a distant viewer sees them.

A view is a matrix of three orthogonal unit vectors, shape (3, 3): what points to the right in the picture, what points
up, and what points towards the viewer. Room axes are X forward, Y up and Z = X × Y, to the right of the way the chain
walks.
"""

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Circle, Patch, Polygon

from warpchain.inputs.arrays import Array
from warpchain.pictures.places import sprocket_centers, sprocket_circle, stretches
from warpchain.pictures.style import DASHES, FAINT, GROUND, INK
from warpchain.walks.walk_numbers import WalkNumbers as Walk

SIDE: Final = np.eye(3)
ABOVE: Final = np.eye(3)[[0, 2, 1]]
"""Its upper axis is z, which such a viewer sees grow downwards: invert it."""


def link_outlines(joints: Array, radius: Array | float) -> Array:
    """Outlines of links between joints, (n, 2) [m], in a picture: two circles of a radius [m] and a waist between them.

    Each is a polygon with corners [m], anticlockwise, (n, c, 2); link i reaches from joint i − 1 to joint i.
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
        + np.reshape(radius, (-1, 1, 1)) * (corners[:, 1:2] * along[:, None] + corners[:, 2:] * across[:, None])
    )
    return outlines


def draw_chain(
    axes: Axes, joints: Array, radius: Array, view: Array, colors: Any, *, edge: float, halo: bool = True
) -> PolyCollection:
    """Draw one chain, its rearmost link first; odd links, the outer ones, cover their neighbours.

    Given are joints in the laboratory frame [m], (n, 3), the radius of each link's contact circles [m], (n,), colours
    of inner links, outer links and edges, and the width of the edges [points]. A white halo separates the chain from
    what is behind it.
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


def draw_release(axes: Axes, walk: Walk, view: Array) -> None:
    """Dashed, where the sprocket was at the release, if there was one, and how high above the floor."""
    circle = sprocket_circle(walk)
    if circle is None:
        return
    middle = circle[:-1].mean(axis=0)
    upright = np.stack([middle, [middle[0], walk.setup.floor.heights(middle[0]), middle[2]]])
    if view is ABOVE:  # from its edge the circle is a line
        circle = np.stack([circle.min(axis=0), circle.max(axis=0)])
    title = "sprocket until release" if walk.setup.scene.release is None else "sprocket at the release"
    for part, label in ((circle, title), (upright, "_")):
        axes.plot(*(view @ part.T)[:2], color=FAINT, linewidth=1.0, linestyle=DASHES, zorder=1.5, label=label)


def draw_sprocket(axes: Axes, walk: Walk, time: float, **style: Any) -> list[Patch]:
    """The sprocket at a time since the release [s], if it has not vanished."""
    (center,) = sprocket_centers(walk, np.array([time]))
    if np.isnan(center[0]):
        return []
    style = {"facecolor": GROUND, "edgecolor": FAINT, "zorder": 1.5, **style}
    return [axes.add_patch(Circle(tuple(center), walk.sprocket_radius, **style))]


def draw_ground(axes: Axes, walk: Walk, line: Array, bottom: float) -> None:
    """The floor along its `Floor.line`, from the side, down to `bottom` [m], with labelled `stretches`."""
    axes.add_patch(Polygon([(line[0, 0], bottom), *line, (line[-1, 0], bottom)], facecolor=GROUND, zorder=3))
    axes.plot(*line.T, color=INK, linewidth=1.0, zorder=3)
    for color, label, faces in stretches(walk, line[0, 0], line[-1, 0]):
        lines = LineCollection(list(faces), colors=color, linewidths=3.5, label=label, zorder=3)
        axes.add_collection(lines, autolim=False)
