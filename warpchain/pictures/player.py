"""The player of walks in a browser: its data, a page with it, and a frame with that page.

HTML animations, reports and notebooks show the page; the live page has the player as well. Nothing heavy is imported.
"""

import html
import json
import math
import re
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.arrays import Array
from warpchain.pictures.labels import headline
from warpchain.pictures.places import checked_joints, circle_radii, sprocket_centers, stretches, walk_box
from warpchain.walks.walk_numbers import WalkNumbers as Walk

INNER, OUTER, EDGE = "#9CCBE6", "#0072B2", "#00385A"
"""Colours of inner links, of outer links and of their edges."""

_PAGE: Final = Path(__file__).with_name("player.html")
"""The page with a player."""
PLAYER: Final = Path(__file__).with_name("player.js")
"""The player, which says what its data are; other pages have it as well."""


def framed_player(walk: Walk, most: int = 2000) -> str:
    """An HTML element, a frame with the page of `player`, as high as it needs on a page of some 1000 pixels.

    A `ValueError` is raised as by `player`.
    """
    content = html.escape(player(walk, most=most))
    wide, high = np.ptp(walk.frame_joints[..., 0]), walk.frame_joints[..., 1].max()
    height = round(min(600.0, 170.0 + 960.0 * high / wide))  # of the drawing at full width, and of its controls
    # No sandbox: browsers run sandboxed frames in another process, where the player may draw before it has a size.
    style = f'style="width:100%;height:{height}px;border:1px solid #ccc" loading="lazy"'
    return f'<iframe title="the walk in motion" {style} srcdoc="{content}"></iframe>'


def player(walk: Walk, slow: float = 4.0, most: int = 2000) -> str:
    """A page with a player of the frames from the side, which starts `slow` times slower than the walk.

    A `ValueError` says that the walk has no frames or broken ones.
    """
    title = html.escape(headline(walk) + ", from the side" * (walk.joints_lab is not None))
    content = json.dumps(player_data(walk, most) | {"slow": slow}, separators=(",", ":"), allow_nan=False)
    parts = {"title": title, "player": PLAYER.read_text(encoding="utf-8"), "data": content}
    return re.sub(r"{{(\w+)}}", lambda found: parts[found[1]], _PAGE.read_text(encoding="utf-8"))


def player_data(walk: Walk, most: int = 2000) -> dict[str, Any]:
    """What a player needs: lengths in tenths of a millimetre, times in microseconds; with so many frames at most.

    With 60 links 2000 frames make a page of about 1 MB. A `ValueError` is raised as by `player`.
    """
    joints, sprocket = checked_joints(walk), walk.sprocket_center
    count = min(len(walk.frame_time), most)
    frames = np.rint(np.linspace(0, len(walk.frame_time) - 1, count)).astype(int)
    times, box = walk.frame_time[frames], side_box(walk, joints)
    marks = floor_marks(*box[0])
    center = np.stack([np.interp(times, walk.time, walk.center[:, axis]) for axis in (0, 1)], axis=1)
    places, ends = sprocket_centers(walk, times), box[0] + np.array([-3, 3]) * np.ptp(box[0])
    return {
        "time": _whole(times, 1e6),
        "joints": _whole(joints[frames, :, :2].reshape(count, -1)),
        "center": _whole(center),
        "radii": _whole(circle_radii(walk)),
        "sprocket": None if sprocket is None else _whole(np.array([*sprocket, walk.sprocket_radius])),
        "places": _whole(places[~np.isnan(places[:, 0])]),
        "view": _whole(box.ravel()),
        "marks": marks,
        "heights": _whole(np.array(walk.setup.floor.heights(np.array(marks)))),
        "floor": _whole(walk.setup.floor.line(*ends)),
        "stretches": [[color, label, _whole(faces)] for color, label, faces in stretches(walk, *ends)],
        "colors": {"inner": INNER, "outer": OUTER, "edge": EDGE},
    }


def _whole(values: NDArray[np.float64], parts: float = 1e4) -> list[int] | list[list[int]]:
    """Numbers in whole parts, as lists: lengths [m] in tenths of a millimetre."""
    whole: list[int] | list[list[int]] = np.rint(values * parts).astype(int).tolist()
    return whole


def floor_marks(low: float, high: float, most: int = 9) -> list[float]:
    """Round numbers [m] along the floor between two ends, in steps of 1, 2 or 5: some more than half of the most."""
    least = (high - low) / most
    power = 10.0 ** math.floor(math.log10(least))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least)
    return [round(k * step, 6) for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def side_box(walk: Walk, joints: Array) -> Array:
    """Left and right, bottom and top of what is shown from the side [m], shape (2, 2), with some of the floor.

    It is at least as broad as high, so that titles and marks have room.
    """
    low, high = walk_box(walk, joints)
    broad = max(0.0, (high[1] - low[1]) - (high[0] - low[0])) / 2
    low[0], high[0] = low[0] - broad, high[0] + broad
    return np.array([[low[0], low[1] - 0.045 * max(high[:2] - low[:2])], high[:2]]).T
