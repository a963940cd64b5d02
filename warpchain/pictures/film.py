"""Single pictures of a film of a walk, all to the same scale: from the side, or a plane that tilts from a corner."""

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from warpchain.pictures.chain import (
    SIDE,
    draw_chain,
    draw_ground,
    floor_height,
    floor_line,
    sprocket_circle,
    view_from,
    walk_box,
)
from warpchain.pictures.style import BLUE, FAINT, GROUND, INK, tidy
from warpchain.pictures.walk_shape import center_in_room, checked_joints, headline

if TYPE_CHECKING:
    from warpchain.walks.walk_result import WalkResult

Array = NDArray[np.float64]

WIDTH, TALLEST = 960, 560
"""Greatest width and height of a picture [pixels]."""
DPI: Final = 100

INNER, OUTER, EDGE = "#9CCBE6", BLUE, "#00385A"
"""Colours of inner links, of outer links and of their edges."""

_CORNER: Final = view_from(*np.radians((35.0, 22.0)))
"""The view from the front right, slightly above."""
_PADDING: Final = np.array([[50, 50], [50, 30]])
"""Pixels to the left and below, and to the right and above."""


def floor_marks(low: float, high: float, most: int = 9) -> list[float]:
    """Round numbers [m] along the floor between two ends."""
    marks = MaxNLocator(most, steps=[1, 2, 5, 10]).tick_values(low, high)
    return [round(float(mark), 6) for mark in marks if low <= mark <= high]


def side_box(walk: "WalkResult", joints: Array) -> Array:
    """Left and right, bottom and top of what is shown from the side [m], shape (2, 2), with some of the floor."""
    low, high = walk_box(walk, joints)
    return np.array([[low[0], low[1] - 0.045 * max(high[:2] - low[:2])], high[:2]]).T


class Film:
    """Draws the frames of one walk.

    Attributes:
        figure: the picture of the frame that was drawn last; an even number of pixels wide and high, for video.
    """

    def __init__(self, walk: "WalkResult") -> None:
        """Fit the walk and the floor below it into the picture.

        Raises:
            ValueError: the walk has no frames or broken ones.
        """
        self._walk, self._joints, self._center = walk, checked_joints(walk), center_in_room(walk)
        self._view = SIDE if walk.joints_in_room is None else _CORNER
        low, high = walk_box(walk, self._joints)
        if self._view is SIDE:
            box = side_box(walk, self._joints)
        else:  # the floor at least as broad as the chain is high
            broad = max(0.0, high[1] - (high[2] - low[2])) / 2
            low[2], high[2] = low[2] - broad, high[2] + broad
            corners = np.array([[x, 0.0, z] for z in (low[2], high[2]) for x in (low[0], high[0])])
            seen = np.concatenate([corners, self._joints.reshape(-1, 3)]) @ self._view[:2].T
            box = np.array([seen.min(axis=0), seen.max(axis=0)]).T
        space = np.array([WIDTH, TALLEST]) - _PADDING.sum(axis=0)
        scale = float((space / np.diff(box)[:, 0]).min())
        size = 2 * np.rint((np.diff(box)[:, 0] * scale + _PADDING.sum(axis=0)) / 2)
        self.figure = Figure(figsize=tuple(size / DPI), dpi=DPI)
        self._canvas: Any = FigureCanvasAgg(self.figure)
        share = _PADDING / size
        self._axes = self.figure.add_axes((*share[0], *(1 - share.sum(axis=0))), xlim=box[0], ylim=box[1])
        if self._view is SIDE:
            draw_ground(self._axes, floor_line(walk, *box[0]), box[1, 0])
            self._axes.set(xlabel="$x$ / m", yticks=[], xticks=floor_marks(*box[0]))
            tidy(self._axes)
            self._axes.spines[["left", "bottom"]].set_visible(False)
        else:
            self._axes.set_axis_off()
            self._draw_floor(low, high)
        circle = sprocket_circle(walk)
        if circle is not None:
            center = circle[:-1].mean(axis=0)
            foot = np.array([center[0], floor_height(walk, center[0]), center[2]])
            for path in (circle, np.stack([center, foot])):
                self._axes.plot(*self._project(path), color=FAINT, linewidth=0.8)
        self.figure.text(0.015, 0.975, headline(walk), va="top", fontsize=11, color=INK)
        self._moving: list[Any] = []

    def draw(self, frame: int) -> None:
        """Draw one frame: the chain, its shadow on the floor, the path of its centre of mass so far, the time."""
        for artist in self._moving:
            artist.remove()
        walk, axes, joints = self._walk, self._axes, self._joints[frame]
        parameters, moment = walk.setup.parameters, walk.frame_time[frame]
        path = self._project(self._center[: max(1, int(np.searchsorted(walk.time, moment, side="right")))])
        clock: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": 11, "color": INK}
        self._moving = [
            draw_chain(axes, joints, parameters.circle_radius, self._view, (INNER, OUTER, EDGE), edge=0.45, halo=False),
            *axes.plot(*path, color=INK, linewidth=0.8, zorder=4),
            *axes.plot(*path[:, -1:], "o", color=INK, markersize=5, zorder=4),
            self.figure.text(0.985, 0.975, f"{moment:.3f} s", **clock),
        ]
        if self._view is not SIDE:
            shadow = self._project(np.concatenate([joints, joints[:1]]) * (1.0, 0.0, 1.0))
            self._moving += axes.plot(*shadow, color="#BDBDBD", linewidth=3.0, zorder=1.5)

    def picture(self, frame: int) -> NDArray[np.uint8]:
        """One frame in colour, shape (height, width, 3)."""
        self.draw(frame)
        self._canvas.draw()
        return np.array(np.asarray(self._canvas.buffer_rgba())[..., :3])

    def _project(self, points: Array) -> Array:
        """Points x, y, z [m], shape (p, 3), in the picture: to the right and up [m], shape (2, p)."""
        projected: Array = self._view[:2] @ points.T
        return projected

    def _draw_floor(self, low: Array, high: Array) -> None:
        """The floor with a square grid, and what its squares measure."""
        (left, _, back), (right, _, front) = low, high
        spacing = float(np.diff(floor_marks(left, right, 12)[:2])[0])
        marks = [spacing * np.arange(np.ceil(low[axis] / spacing), high[axis] / spacing) for axis in (0, 2)]
        corners = np.array([[left, 0, back], [left, 0, front], [right, 0, front], [right, 0, back]])
        self._axes.fill(*self._project(corners), color=GROUND, linewidth=0, zorder=1)
        lines = [[(x, 0, back), (x, 0, front)] for x in marks[0]] + [[(left, 0, z), (right, 0, z)] for z in marks[1]]
        for line in lines:
            self._axes.plot(*self._project(np.array(line)), color="#C8C8C8", linewidth=0.8, zorder=1.2)
        self.figure.text(0.015, 0.02, f"squares of {spacing:g} m", va="bottom", fontsize=11, color=INK)
