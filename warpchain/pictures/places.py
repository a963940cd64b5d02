"""Positions of chain, sprocket and floor for all figures; this module imports nothing heavy."""

import numpy as np

from warpchain.chain.sprocket_motion import sprocket_places
from warpchain.inputs.arrays import Array
from warpchain.walks.walk_numbers import WalkNumbers as Walk


def checked_joints(walk: Walk) -> Array:
    """Joints of a walk in the laboratory frame [m], shape (f, n, 3); z = 0 if its plane is fixed.

    A `ValueError` says that the walk has no frames or broken ones.
    """
    if len(walk.frame_time) == 0:
        never = f"it was not released. {walk.status.sentence}"
        remedy = "run it again with a frame_interval" if len(walk.time) else never
        raise ValueError(f"walk: it has no frames; {remedy}")
    in_room = walk.joints_lab
    joints = np.insert(walk.frame_joints, 2, 0.0, axis=2) if in_room is None else np.asarray(in_room)
    if not np.all(np.isfinite(joints)):
        raise ValueError(f"walk: its frames are not all finite numbers. {walk.status.sentence}")
    return joints


def center_in_room(walk: Walk) -> Array:
    """Centre of mass x, y, z [m], shape (t, 3); z = 0 if the plane is fixed."""
    return np.column_stack([walk.center, np.zeros(len(walk.time)) if walk.joints_lab is None else walk.center_z])


def circle_radii(walk: Walk) -> Array:
    """Radius of the circles of each link [m], shape (n,)."""
    return walk.setup.link_values.radius


def sprocket_circle(walk: Walk) -> Array | None:
    """Points of the sprocket's circle at the release x, y, z [m], shape (100, 3); None without one."""
    if walk.sprocket_center is None:
        return None
    angle = np.linspace(0.0, 2 * np.pi, 100)
    circle = walk.sprocket_radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return np.asarray(circle + np.array([*walk.sprocket_center, 0.0]))


def sprocket_centers(walk: Walk, times: Array) -> Array:
    """The sprocket's centre x, y at times since the release [m], shape (t, 2); NaN where it has vanished."""
    center = (np.nan, np.nan) if walk.sprocket_center is None else walk.sprocket_center
    return sprocket_places(walk.setup.scene.release, times) + center


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
    from matplotlib import colormaps  # which takes long to import
    from matplotlib.colors import to_hex

    ends = np.array([min(left, points[0, 0]), max(right, points[-1, 0])])
    points[[0, -1]] = np.column_stack([ends, floor.heights(ends)])
    faces = np.stack([points[:-1], points[1:]], axis=1)
    in_sight = (faces[:, 0, 0] < right) & (faces[:, 1, 0] > left)
    colors = colormaps["plasma"](np.linspace(0.6, 0.0, len(own)))
    found = ((color, law, faces[in_sight & (laws == law).all(axis=1)]) for color, law in zip(colors, own, strict=True))
    return [(to_hex(color), "e = {:g}, μ = {:g}".format(*law), its) for color, law, its in found if len(its)]
