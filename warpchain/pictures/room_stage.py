"""Pictures of a chain whose plane tilts for GIF and MP4: from the front right and slightly above, never turned."""

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.pictures.player_page import EDGE, ENLARGEMENT, INNER, OUTER, TALLEST, WIDTH
from warpchain.pictures.room import (
    CORNER,
    center_in_room,
    check_room,
    floor_of,
    link_solids,
    room_box,
    sprocket_circle,
    view_from,
)
from warpchain.pictures.style import FAINT, GROUND, INK
from warpchain.pictures.walk_shape import TiltingWalk

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

Array = NDArray[np.float64]

OUTER_WALL: Final = "#00507E"
INNER_WALL: Final = "#6495B0"
"""Colours of the walls of outer and inner links."""
SHADOW: Final = "#BDBDBD"
GRID: Final = "#C8C8C8"
"""Colours of the chain's shadow and of the lines on the floor."""

_MARGIN: Final = 50
_HEADROOM: Final = 30
"""Pixels beside and below the floor, for numbers, and above the walk, for the time."""

_CLOSEST: Final = 40
"""Least distance between two numbers on the floor [pixels]."""


class RoomStage:
    """Draws the frames of one walk, all to the same scale.

    Attributes:
        size: width and height of a picture in pixels, even numbers for video.
    """

    def __init__(self, walk: TiltingWalk) -> None:
        """Fit the walk and the floor below it into the picture.

        Raises:
            ValueError: joints in the room are missing for some frames, or broken.
        """
        from PIL import ImageFont

        self._walk, self._joints = walk, check_room(walk)
        self._view = view_from(*np.radians(CORNER))
        low, high = room_box(walk, self._joints)
        self._floor = floor_of(low, high)
        (left, right), (far, near) = self._floor.ends_x, self._floor.ends_z
        self._corners = np.array([[left, 0, far], [right, 0, far], [right, 0, near], [left, 0, near]])
        rim = 2 * walk.setup.parameters.circle_radius
        shown = self._view.project(np.concatenate([self._corners, self._joints.reshape(-1, 3)]))
        left, bottom = shown.min(axis=0) - rim
        right, top = shown.max(axis=0) + rim
        self._scale = min((WIDTH - 2 * _MARGIN) / (right - left), (TALLEST - _MARGIN - _HEADROOM) / (top - bottom))
        self._origin = np.array([left - _MARGIN / self._scale, top + _HEADROOM / self._scale])
        width = self._scale * (right - left) + 2 * _MARGIN
        height = self._scale * (top - bottom) + _MARGIN + _HEADROOM
        self.size = 2 * round(width / 2), 2 * round(height / 2)
        self._font = ImageFont.load_default(16)
        self._center = center_in_room(walk)
        self._backdrop = self._draw_backdrop()

    def _pixels(self, points: Array) -> Array:
        """Pixels in the enlarged picture of points x, y, z [m], shape (…, 3): (…, 2)."""
        scale = self._scale * ENLARGEMENT
        return np.asarray((self._view.project(points) - self._origin) * (scale, -scale))

    def _draw_backdrop(self) -> "Image":
        """What never moves, enlarged: the floor with its grid, and the sprocket."""
        from PIL import Image, ImageDraw

        backdrop = Image.new("RGB", tuple(ENLARGEMENT * side for side in self.size), "white")
        draw = ImageDraw.Draw(backdrop)
        draw.polygon(self._pixels(self._corners).ravel().tolist(), fill=GROUND)
        floor = self._floor
        lines = [np.array([[place, 0, end] for end in floor.ends_z]) for place in floor.x]
        lines += [np.array([[end, 0, place] for end in floor.ends_x]) for place in floor.z]
        for line in lines:
            draw.line(self._pixels(line).ravel().tolist(), fill=GRID, width=ENLARGEMENT)
        circle = sprocket_circle(self._walk)
        if circle is not None and self._walk.sprocket_center is not None:
            center = np.array([*self._walk.sprocket_center, 0.0])
            foot = np.stack([center, center * (1.0, 0.0, 1.0)])
            for path in (circle, foot):
                draw.line(self._pixels(path).ravel().tolist(), fill=FAINT, width=ENLARGEMENT)
        return backdrop

    def picture(self, frame: int) -> "Image":
        """One frame in colour: the chain and its shadow, the path of its centre of mass so far, time and marks."""
        from PIL import ImageDraw

        image = self._backdrop.copy()
        draw = ImageDraw.Draw(image)
        self._draw_chain(draw, frame)
        moment = self._walk.frame_time[frame]
        path = self._pixels(self._center[: max(1, int(np.searchsorted(self._walk.time, moment, side="right")))])
        draw.line(path.ravel().tolist(), fill=INK, width=ENLARGEMENT)
        draw.circle(tuple(path[-1]), 3.5 * ENLARGEMENT, fill=INK)
        image = image.reduce(ENLARGEMENT)
        draw = ImageDraw.Draw(image)
        draw.text((self.size[0] - 12, 10), f"{moment:.3f} s", fill=INK, font=self._font, anchor="rt")
        self._draw_marks(draw)
        return image

    def _draw_chain(self, draw: "ImageDraw", frame: int) -> None:
        """The shadow that light from above throws, then the links from the rearmost to the foremost."""
        joints, parameters = self._joints[frame], self._walk.setup.parameters
        shadow = self._pixels(np.concatenate([joints, joints[:2]]) * (1.0, 0.0, 1.0))
        width = max(1, round(parameters.half_width * self._scale * ENLARGEMENT))
        draw.line(shadow.ravel().tolist(), fill=SHADOW, width=width, joint="curve")
        solids = link_solids(joints, parameters.circle_radius, parameters.half_width, self._view)
        walls, faces = self._pixels(solids.walls), self._pixels(solids.faces)
        rim = round(0.6 * ENLARGEMENT)
        for link in solids.order:
            wall, face = (OUTER_WALL, OUTER) if link % 2 else (INNER_WALL, INNER)
            for piece in walls[link][solids.seen[link]].reshape(-1, 8).tolist():
                draw.polygon(piece, fill=wall)
            draw.polygon(faces[link].ravel().tolist(), fill=face, outline=EDGE, width=rim)

    def _draw_marks(self, draw: "ImageDraw") -> None:
        """Numbers along the two edges of the floor that are nearest to the viewer, and names of their axes."""
        floor = self._floor
        edges = ((0, floor.x, floor.ends_x, floor.ends_z[1]), (2, floor.z, floor.ends_z, floor.ends_x[1]))
        for axis, marks, ends, edge in edges:
            places = np.array([*marks, sum(ends) / 2])
            points = np.zeros((len(places), 3))
            points[:, axis], points[:, 2 - axis] = places, edge
            outward = points.copy()
            outward[:, 2 - axis] += 1.0
            pixels = self._pixels(points) / ENLARGEMENT
            away = self._pixels(outward[-1]) / ENLARGEMENT - pixels[-1]
            away /= np.linalg.norm(away)
            step = np.zeros((2, 3))
            step[1, axis] = floor.spacing
            spacing = float(np.linalg.norm(np.diff(self._pixels(step), axis=0))) / ENLARGEMENT
            every = math.ceil(_CLOSEST / spacing)
            for mark, pixel in zip(marks, pixels[:-1], strict=True):
                if round(mark / floor.spacing) % every == 0:
                    place = tuple(pixel + away * (30, 16))
                    draw.text(place, f"{mark:g} m", fill=INK, font=self._font, anchor="mm")
            x, y = pixels[-1] + away * (74, 36)
            draw.text((min(x, self.size[0] - 8), y), "x" if axis == 0 else "z", fill=INK, font=self._font, anchor="mm")
