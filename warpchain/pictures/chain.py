"""A chain in the room and what is around it, as a viewer far away sees them.

A view is a matrix of three orthogonal unit vectors, shape (3, 3): what points to the right in the picture, what points
up, and what points towards the viewer. Room axes are X forward, Y up and Z = X × Y, to the right of the way the chain
walks.
"""

from typing import Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.patches import Circle, Patch, Polygon

from warpchain.chain.sprocket_motion import sprocket_places
from warpchain.inputs.arrays import Array
from warpchain.pictures.style import DASHES, FAINT, GROUND, INK
from warpchain.walks.walk_numbers import WalkNumbers as Walk

SIDE: Final = np.eye(3)
ABOVE: Final = np.eye(3)[[0, 2, 1]]
"""Its upper axis is z, which such a viewer sees grow downwards: invert it."""


def checked_joints(walk: Walk) -> Array:
    """The joints of a walk in the room [m], shape (f, n, 3); z = 0 if its plane is fixed.

    A `ValueError` says that the walk has no frames or broken ones.
    """
    if len(walk.frame_time) == 0:
        never = f"it was not released. {walk.status.sentence}"
        remedy = "run it again with a frame_interval" if len(walk.time) else never
        raise ValueError(f"walk: it has no frames; {remedy}")
    in_room = walk.joints_in_room
    joints = np.insert(walk.frame_joints, 2, 0.0, axis=2) if in_room is None else np.asarray(in_room)
    if not np.all(np.isfinite(joints)):
        raise ValueError(f"walk: its frames are not all finite numbers. {walk.status.sentence}")
    return joints


def center_in_room(walk: Walk) -> Array:
    """Centre of mass x, y, z [m], shape (t, 3); z = 0 if the plane is fixed."""
    return np.column_stack([walk.center, np.zeros(len(walk.time)) if walk.joints_in_room is None else walk.center_z])


def circle_radii(walk: Walk) -> Array:
    """Radius of the circles of each link [m], shape (n,)."""
    return walk.setup.link_values.radius


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

    Given are joints in the room [m], (n, 3), the radius of the circles of each link [m], (n,), colours of inner links,
    of outer links and of edges, and the width of these [points]. A halo is white, over what is behind the chain.
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


def sprocket_circle(walk: Walk) -> Array | None:
    """Points of the sprocket's circle at the release x, y, z [m], shape (100, 3); None without one."""
    if walk.sprocket_center is None:
        return None
    angle = np.linspace(0.0, 2 * np.pi, 100)
    circle = walk.sprocket_radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return np.asarray(circle + np.array([*walk.sprocket_center, 0.0]))


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


def sprocket_centers(walk: Walk, times: Array) -> Array:
    """The sprocket's centre x, y at times since the release [m], shape (t, 2); NaN where it has vanished."""
    center = (np.nan, np.nan) if walk.sprocket_center is None else walk.sprocket_center
    return sprocket_places(walk.setup.scene.release, times) + center


def draw_sprocket(axes: Axes, walk: Walk, time: float, **style: Any) -> list[Patch]:
    """The sprocket at a time since the release [s], if it has not vanished."""
    (center,) = sprocket_centers(walk, np.array([time]))
    if np.isnan(center[0]):
        return []
    style = {"facecolor": GROUND, "edgecolor": FAINT, "zorder": 1.5, **style}
    return [axes.add_patch(Circle(tuple(center), walk.sprocket_radius, **style))]


def walk_box(walk: Walk, joints: Array) -> tuple[Array, Array]:
    """Least and greatest x, y, z of a walk and its sprocket, with a margin; from the floor on [m], each shape (3,)."""
    widest = circle_radii(walk).max()
    margin = widest + 2 * max(widest, walk.setup.parameters.half_width)
    low, high = joints.min(axis=(0, 1)) - margin, joints.max(axis=(0, 1)) + margin
    circle = sprocket_circle(walk)
    if circle is not None:
        low, high = np.minimum(low, circle.min(axis=0)), np.maximum(high, circle.max(axis=0))
        moved = sprocket_centers(walk, walk.frame_time)
        low[:2] = np.fmin(low[:2], np.fmin.reduce(moved) - walk.sprocket_radius)
        high[:2] = np.fmax(high[:2], np.fmax.reduce(moved) + walk.sprocket_radius)
    low[1] = walk.setup.floor.line(low[0], high[0])[:, 1].min()
    return low, high


def stretches(walk: Walk, left: float, right: float) -> list[tuple[str, str, Array]]:
    """What of the floor has coefficients of its own, between two x [m].

    For each pair of coefficients a colour, a label, and ends of the straight faces that have it [m], (f, 2, 2).
    """
    floor, parameters = walk.setup.floor, walk.setup.parameters
    points, laws = floor.points.copy(), floor.laws
    usual = parameters.floor_restitution, parameters.floor_friction
    own = [law for law in dict.fromkeys(map(tuple, laws.tolist())) if law != usual]
    if not own:
        return []
    ends = np.array([min(left, points[0, 0]), max(right, points[-1, 0])])
    points[[0, -1]] = np.column_stack([ends, floor.heights(ends)])
    faces = np.stack([points[:-1], points[1:]], axis=1)
    in_sight = (faces[:, 0, 0] < right) & (faces[:, 1, 0] > left)
    colors = colormaps["plasma"](np.linspace(0.6, 0.0, len(own)))
    found = ((color, law, faces[in_sight & (laws == law).all(axis=1)]) for color, law in zip(colors, own, strict=True))
    return [(to_hex(color), "e = {:g}, μ = {:g}".format(*law), its) for color, law, its in found if len(its)]


def draw_ground(axes: Axes, walk: Walk, line: Array, bottom: float) -> None:
    """The floor along its `Floor.line`, from the side, down to `bottom` [m], with labelled `stretches`."""
    axes.add_patch(Polygon([(line[0, 0], bottom), *line, (line[-1, 0], bottom)], facecolor=GROUND, zorder=3))
    axes.plot(*line.T, color=INK, linewidth=1.0, zorder=3)
    for color, label, faces in stretches(walk, line[0, 0], line[-1, 0]):
        lines = LineCollection(list(faces), colors=color, linewidths=3.5, label=label, zorder=3)
        axes.add_collection(lines, autolim=False)
