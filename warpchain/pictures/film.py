"""Single pictures of a film of a walk, drawn by matplotlib: what never moves once, the chain anew in each."""

import math
from typing import Any, Final, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray

from warpchain.pictures.room import (
    CORNER,
    SIDE,
    center_in_room,
    check_room,
    floor_of,
    link_solids,
    room_box,
    sprocket_circle,
    view_from,
)
from warpchain.pictures.room_figures import link_paths
from warpchain.pictures.style import BLUE, FAINT, GROUND, INK
from warpchain.pictures.walk_figures import extent
from warpchain.pictures.walk_shape import TiltingWalk, Walk, tilting

Array = NDArray[np.float64]

WIDTH: Final = 960
TALLEST: Final = 560
"""Greatest width and height of a picture [pixels]."""
DPI: Final = 100

OUTER: Final = BLUE
INNER: Final = "#9CCBE6"
EDGE: Final = "#00385A"
"""Colours of outer links, of inner links and of their edges."""
_WALLS: Final = ("#6495B0", "#00507E")
"""Colours of the walls of inner and outer links."""
_SHADOW: Final = "#BDBDBD"
_GRID: Final = "#C8C8C8"

_MARGIN: Final = 50
_HEADROOM: Final = 30
"""Pixels beside and below the floor of a room, for numbers, and above the walk, for the time."""
_CLOSEST: Final = 40
"""Least distance between two numbers on the floor [pixels]."""


def side_view(walk: Walk) -> tuple[float, float, float, float, tuple[float, ...]]:
    """Left, right, bottom and top of what is shown from the side, and the places of the marks on the floor [m]."""
    left, right, top = extent(walk)
    spacing = next((step for step in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if (right - left) / step <= 9), 10.0)
    numbers = range(math.ceil(left / spacing), math.floor(right / spacing) + 1)
    bottom = -0.045 * max(right - left, top)
    return left, right, bottom, top, tuple(round(number * spacing, 6) for number in numbers)


class Film:
    """Draws the frames of one walk, all to the same scale: from the side, or a plane that tilts from a corner.

    Attributes:
        size: width and height of a picture in pixels, even numbers for video.
    """

    def __init__(self, walk: Walk) -> None:
        """Fit the walk and the floor below it into the picture.

        Raises:
            ValueError: joints in the room are missing for some frames, or broken.
        """
        self._walk, in_room = walk, tilting(walk)
        if in_room is None:
            left, right, bottom, top, marks = side_view(walk)
            self._view, flat = SIDE, walk.frame_joints
            self._joints = np.insert(flat, 2, 0.0, axis=2)
            self._center = np.insert(walk.center, 2, 0.0, axis=1)
            box, pad = np.array([[left, bottom], [right, top]]), np.zeros((2, 2))
        else:
            self._view, self._joints = view_from(*np.radians(CORNER)), check_room(in_room)
            self._center = center_in_room(in_room)
            floor = floor_of(*room_box(in_room, self._joints))
            corners = np.array([[x, 0.0, z] for x in floor.ends_x for z in floor.ends_z])[[0, 2, 3, 1]]
            shown = self._view.project(np.concatenate([corners, self._joints.reshape(-1, 3)]))
            rim = 2 * walk.setup.parameters.circle_radius
            box = np.array([shown.min(axis=0) - rim, shown.max(axis=0) + rim])
            pad = np.array([[_MARGIN, _MARGIN], [_MARGIN, _HEADROOM]])
        room = np.array([WIDTH, TALLEST]) - pad.sum(axis=0)
        self._scale = float((room / np.diff(box, axis=0)[0]).min())
        box += np.array([[-1], [1]]) * pad / self._scale
        width, height = (2 * round(side * self._scale / 2) for side in np.diff(box, axis=0)[0])
        self.size = width, height
        self._canvas = cast(Any, FigureCanvasAgg(Figure(figsize=(width / DPI, height / DPI), dpi=DPI)))
        axes = self._canvas.figure.add_axes((0, 0, 1, 1), xlim=box[:, 0], ylim=box[:, 1])
        axes.set_axis_off()
        if in_room is None:
            self._draw_ground(axes, box, marks)
        else:
            self._draw_floor(axes, in_room, corners)
        thick = max(0.7, walk.setup.parameters.half_width * self._scale * 72 / DPI)
        (self._shadow,) = axes.plot([], [], color=_SHADOW, linewidth=thick)
        self._links = PathCollection([], linewidths=0.45)
        axes.add_collection(self._links)
        (self._path,) = axes.plot([], [], color=INK, linewidth=0.8)
        (self._dot,) = axes.plot([], [], "o", color=INK, markersize=5)
        self._clock = axes.text(
            0.985, 0.975, "", transform=axes.transAxes, ha="right", va="top", fontsize=11, color=INK
        )
        self._canvas.draw()
        self._backdrop: Any = self._canvas.copy_from_bbox(self._canvas.figure.bbox)

    def picture(self, frame: int) -> NDArray[np.uint8]:
        """One frame in colour: the chain, the path of its centre of mass so far, the time; shape (height, width, 3)."""
        walk, joints, parameters = self._walk, self._joints[frame], self._walk.setup.parameters
        solids = link_solids(joints, parameters.circle_radius, parameters.half_width, self._view)
        walls, faces = link_paths(solids, self._view.project)
        self._links.set_paths([part for link in solids.order for part in (walls[link], faces[link])])
        fills = [color for link in solids.order for color in ((_WALLS[1], OUTER) if link % 2 else (_WALLS[0], INNER))]
        self._links.set_facecolor(fills)
        self._links.set_edgecolor([EDGE if fill in (OUTER, INNER) else fill for fill in fills])
        if self._view is not SIDE:
            self._shadow.set_data(*self._view.project(np.concatenate([joints, joints[:1]]) * (1.0, 0.0, 1.0)).T)
        moment = walk.frame_time[frame]
        path = self._view.project(self._center[: max(1, int(np.searchsorted(walk.time, moment, side="right")))])
        self._path.set_data(*path.T)
        self._dot.set_data(*path[-1:].T)
        self._clock.set_text(f"{moment:.3f} s")
        self._canvas.restore_region(self._backdrop)
        for artist in (self._shadow, self._links, self._path, self._dot, self._clock):
            artist.draw(self._canvas.get_renderer())
        return np.array(np.asarray(self._canvas.buffer_rgba())[..., :3])

    def _draw_ground(self, axes: Axes, box: Array, marks: tuple[float, ...]) -> None:
        """The floor from the side with its marks, and the sprocket."""
        if self._walk.sprocket_center is not None:
            x, y = self._walk.sprocket_center
            axes.add_patch(Circle((x, y), self._walk.sprocket_radius, fill=False, edgecolor=FAINT, linewidth=0.8))
            axes.plot([x], [y], "o", color=FAINT, markersize=3)
        (left, bottom), (right, _) = box
        axes.add_patch(Rectangle((left, bottom), right - left, -bottom, color=GROUND, linewidth=0))
        axes.plot([left, right], [0, 0], color=INK, linewidth=0.8)
        for mark in marks:
            axes.plot([mark, mark], [0, -6 / self._scale], color=INK, linewidth=0.8)
            axes.text(mark, -9 / self._scale, f"{mark:g} m", ha="center", va="top", fontsize=11, color=INK)

    def _draw_floor(self, axes: Axes, walk: TiltingWalk, corners: Array) -> None:
        """The floor with its grid and numbers along the two edges that are nearest to the viewer, and the sprocket."""
        view, floor = self._view, floor_of(*room_box(walk, self._joints))
        axes.add_patch(Polygon(view.project(corners), closed=True, color=GROUND, linewidth=0))
        lines = [np.array([[place, 0, end] for end in floor.ends_z]) for place in floor.x]
        lines += [np.array([[end, 0, place] for end in floor.ends_x]) for place in floor.z]
        axes.add_collection(LineCollection([view.project(line) for line in lines], colors=_GRID, linewidths=0.8))
        circle = sprocket_circle(walk)
        if circle is not None:
            center = circle[:-1].mean(axis=0)
            for path in (circle, np.stack([center, center * (1.0, 0.0, 1.0)])):
                axes.plot(*view.project(path).T, color=FAINT, linewidth=0.8)
        for axis, name, marks, ends, edge in (
            (0, "x", floor.x, floor.ends_x, floor.ends_z[1]),
            (2, "z", floor.z, floor.ends_z, floor.ends_x[1]),
        ):
            along, outward = np.eye(3)[axis], np.eye(3)[2 - axis]
            away = view.project(outward) / np.linalg.norm(view.project(outward)) / self._scale
            every = math.ceil(_CLOSEST / (self._scale * floor.spacing * float(np.linalg.norm(view.project(along)))))
            texts = [(mark, f"{mark:g} m", (30, 16)) for mark in marks if round(mark / floor.spacing) % every == 0]
            for mark, text, pixels in (*texts, (sum(ends) / 2, name, (74, 36))):
                place = view.project(mark * along + edge * outward) + away * pixels
                axes.text(float(place[0]), float(place[1]), text, ha="center", va="center", fontsize=11, color=INK)
