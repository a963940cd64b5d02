"""What figures of walks have in common: their names, titles, joints and centres in the room.

Room axes are X forward, Y up and Z = X × Y, to the right of the way the chain walks.
"""

import math
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from warpchain.inputs.arrays import Array

if TYPE_CHECKING:
    from warpchain.walks.walk_result import WalkResult

    Walk = WalkResult
else:
    Walk = object

Kind = Literal["film_strip", "height_and_speed", "loop", "energy", "tilt"]
"""Figures of a walk; `tilt` only of one whose plane tilts."""


def kinds_of(walk: Walk) -> tuple[Kind, ...]:
    """The figures that a walk has, if it was recorded."""
    kinds: tuple[Kind, ...] = get_args(Kind)
    return tuple(kind for kind in kinds if kind != "tilt" or walk.joints_in_room is not None)


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


def setting(walk: Walk) -> str:
    """Links and frequency, as a title."""
    return walk.setup.described.replace(" at ", ", ", 1)


def headline(walk: Walk) -> str:
    """Links, frequency and, if it came to rest, how far it walked."""
    return setting(walk) + (f": Δx = {walk.dx:.3f} m" if math.isfinite(walk.dx) else "")
