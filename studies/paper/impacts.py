"""What the first impact on the floor does to the loop: its shape and the speed of its links along it.

Everything follows from the frames of walks that a sweep kept.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.common import Array, Block, area_of

TOUCH = 3e-4  # A loop touches the floor while its lowest circle is less than this above it [m]
APART = 0.02  # Touches less apart [s] are one impact: fast loops lose the floor for 10 ms while they roll over it


@dataclass(frozen=True)
class Impact:
    """The loop just before its first impact and just after it has left the floor again."""

    before: Array  # Joints x, y from the centroid of the joints [m], shape (n, 2)
    after: Array
    duration: float  # Time between the two frames [s]
    area: float  # Relative changes: of the enclosed area, …
    height: float
    width: float
    speed: float  # … and of the mean speed of the links along the loop


def first_impact(walk: Any) -> Impact | None:
    """The first impact of a kept motion; None if its loop did not rise again or no frame lies before the impact."""
    joints, time = walk.frame_joints, walk.frame_time
    lowest = joints[:, :, 1].min(axis=1) - walk.setup.parameters.circle_radius
    touches = np.flatnonzero((lowest < TOUCH) & (time > 0))
    if not len(touches) or touches[0] < 2:
        return None
    first, interval = int(touches[0]), float(np.diff(time).mean())
    # The last touch of the first impact is followed by none for a while.
    ends = touches[np.append(np.diff(touches) * interval > APART, len(time) - 2 > touches[-1] + APART / interval)]
    if not len(ends) or ends[0] + 2 >= len(time):
        return None
    last = int(ends[0])
    before, after = (joints[place] - joints[place].mean(axis=0) for place in (first - 1, last + 1))
    sizes = [(area_of(each), *np.ptp(each, axis=0)) for each in (before, after)]
    area, width, height = (float(new / old - 1) for old, new in zip(*sizes, strict=True))
    return Impact(
        before=before,
        after=after,
        duration=float(time[last + 1] - time[first - 1]),
        area=area,
        height=height,
        width=width,
        speed=_speed(joints, time, last + 1) / _speed(joints, time, first - 2) - 1,
    )


def impacts(block: Block) -> tuple[dict[tuple[int, ...], list[Impact]], int]:
    """The first impacts of all walks whose motion was kept, by cell; and the number of walks without one."""
    found: dict[tuple[int, ...], list[Impact]] = {}
    without = 0
    for *cell, sample in np.argwhere(block.kept).tolist():
        impact = first_impact(block.walk_motion((*cell, sample)))
        if impact is None:
            without += 1
        else:
            found.setdefault(tuple(cell), []).append(impact)
    return found, without


def _speed(joints: Array, time: Array, place: int) -> float:
    """Mean speed of the joints along the tangents half-way to the next frame, seen from the centroid [m/s]."""
    now, then = (joints[number] - joints[number].mean(axis=0) for number in (place, place + 1))
    middle = (now + then) / 2
    tangent = np.roll(middle, -1, axis=0) - np.roll(middle, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    along = np.sum((then - now) * tangent, axis=1).mean()
    return float(along / (time[place + 1] - time[place]))
