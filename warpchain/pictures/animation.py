"""Animations of a walk: GIF, MP4, or an HTML page with a player.

A film shows a walk to one scale, from the side, or from a corner if its plane tilts.
"""

import importlib
import itertools
import math
import os
import subprocess
from pathlib import Path
from typing import Annotated, Any, Final, cast

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial.transform import Rotation

from warpchain.files import checked_output, replacing, write_whole
from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError, checked, short
from warpchain.pictures import chain
from warpchain.pictures.labels import headline
from warpchain.pictures.places import center_in_room, checked_joints, circle_radii, sprocket_circle, walk_box
from warpchain.pictures.player import EDGE, INNER, OUTER, floor_marks, player, side_box
from warpchain.pictures.style import GROUND, INK, InlineFigure, tidy
from warpchain.walks.walk_numbers import WalkNumbers as Walk

WIDTH, TALLEST = 960, 560
"""Greatest width and height of a picture [pixels]."""
DPI: Final = 100
MOST: Final = {".gif": 1200, ".mp4": 100_000}
"""Most pictures: those of a GIF are in memory at once, up to 0.5 MB each; so many of an MP4 take an hour."""

_CORNER: Final = (-35.0, 22.0)
"""View from the front right, slightly above: angles about the vertical, then about what points to the right."""
_PADDING: Final = np.array([[50, 50], [50, 30]])
"""Pixels to the left and below, and to the right and above."""

_HOLD: Final = 1.5
"""Time for which GIF and MP4 show their last picture [s]."""

_POSITIVE: Final = Annotated[float, Field(gt=0)]
_GIF_RATE: Final = Annotated[float, Field(ge=1, le=50)]
"""Pictures per second of a GIF."""


def animate(walk: Walk, path: str | os.PathLike[str], *, fps: float = 30.0, slow: float = 4.0) -> None:
    """Write a moving picture of a walk; the suffix of `path` gives the format: .gif, .mp4 or .html.

    If there are more pictures than frames, each frame is shown until the next one. A chain whose plane tilts is seen
    from the front right and slightly above; in a .html file, which loads nothing else, from the side. Arguments and
    errors are those of `WalkResult.animate`.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".gif", ".mp4", ".html"):
        raise ValueError(f"{path}: unknown file format; use a name that ends in .gif, .mp4 or .html")
    checked(slow, "slow", _POSITIVE)
    checked(fps, "fps", _GIF_RATE if suffix == ".gif" else _POSITIVE)
    checked_joints(walk)
    target = checked_output(path)
    if suffix == ".html":
        write_whole(target, player(walk, slow))
    elif suffix == ".gif":
        _write_gif(walk, target, fps, slow)
    else:
        _write_mp4(walk, target, fps, slow)


def _chosen_frames(walk: Walk, path: Path, fps: float, slow: float) -> list[int]:
    """Number of the frame that each picture shows: the last one recorded by then. Pictures come at a constant rate."""
    start = walk.frame_time[0]
    count = float(walk.frame_time[-1] - start) * fps * slow + 1e-6
    if (pictures := max(float(np.floor(count)) + 1, _HOLD * fps)) > MOST[path.suffix.lower()]:
        remedy = f"lower fps or slow; a GIF has {MOST['.gif']} at most, an MP4 {MOST['.mp4']}"
        raise InputError(f"{path}: {short(pictures)} pictures are too many; {remedy}")
    marks = start + np.arange(math.floor(count) + 1) / (fps * slow)
    chosen: list[int] = (np.searchsorted(walk.frame_time, marks + 1e-9, side="right") - 1).tolist()
    return chosen if chosen[-1] == len(walk.frame_time) - 1 else [*chosen, len(walk.frame_time) - 1]


def _write_gif(walk: Walk, path: Path, fps: float, slow: float) -> None:
    """Write pictures with equal delays in whole hundredths of a second; Pillow writes equal ones once.

    matplotlib's writer of GIFs cuts its delays off: at 30 pictures a second they would be 10 % too short.
    """
    from PIL import Image

    delay = round(100 / fps)
    chosen = _chosen_frames(walk, path, 100 / delay, slow)
    film = Film(walk)
    palette = Image.fromarray(film.picture(len(walk.frame_time) // 2)).quantize(64)
    palette.putpalette([255 if part > 247 else part for part in palette.getpalette() or []])  # its white is a mean

    def reduced(frame: int) -> Image.Image:
        return Image.fromarray(film.picture(frame)).quantize(palette=palette, dither=Image.Dither.NONE)

    chosen += chosen[-1:] * (round(_HOLD * 100 / delay) - 1)
    pictures = (each for frame, group in itertools.groupby(chosen) for each in [reduced(frame)] * len(list(group)))
    with replacing(path) as part:
        next(pictures).save(part, format="GIF", save_all=True, append_images=pictures, duration=10 * delay, loop=0)


def _write_mp4(walk: Walk, path: Path, fps: float, slow: float) -> None:
    """Let ffmpeg code the pictures; `imageio_ffmpeg` brings it."""
    import matplotlib as mpl
    from matplotlib.animation import FFMpegWriter

    chosen = _chosen_frames(walk, path, fps, slow)
    try:
        ffmpeg = importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    except ImportError:
        raise ImportError(f"{path}: MP4 needs imageio-ffmpeg; pip install 'warpchain[video]'") from None
    chosen += chosen[-1:] * round(_HOLD * fps)
    film = Film(walk)
    # What ffmpeg says would be lines on the terminal.
    writer = FFMpegWriter(fps=cast(Any, fps), codec="h264", extra_args="-crf 20 -loglevel quiet -f mp4".split())
    with replacing(path) as part, mpl.rc_context({"animation.ffmpeg_path": ffmpeg}):
        try:
            with writer.saving(film.figure, str(part), DPI):
                for frame, group in itertools.groupby(chosen):
                    film.draw(frame)
                    for _ in group:
                        writer.grab_frame()
        except (subprocess.CalledProcessError, BrokenPipeError) as error:
            raise OSError("ffmpeg ended early") from error


class Film:
    """Draws frames of a walk, dashed where the sprocket was at the release; even pixels wide and high, for video."""

    def __init__(self, walk: Walk) -> None:
        """Fit the walk and the floor below it into the picture; a `ValueError` if frames are none or broken."""
        self._walk, self._joints, self._center = walk, checked_joints(walk), center_in_room(walk)
        self._radii = circle_radii(walk)
        self._tilts = walk.joints_lab is not None
        self._view = Rotation.from_euler("yx", _CORNER, degrees=True).as_matrix() if self._tilts else chain.SIDE
        low, high = walk_box(walk, self._joints)
        if not self._tilts:
            box = side_box(walk, self._joints)
        else:  # the floor at least as broad as the chain is high
            broad = max(0.0, high[1] - (high[2] - low[2])) / 2
            low[2], high[2] = low[2] - broad, high[2] + broad
            corners = np.array([[x, 0.0, z] for z in (low[2], high[2]) for x in (low[0], high[0])])
            circle = sprocket_circle(walk)
            shown = [corners, self._joints.reshape(-1, 3), *([] if circle is None else [circle])]
            seen = np.concatenate(shown) @ self._view[:2].T
            box = np.array([seen.min(axis=0), seen.max(axis=0)]).T
        space = np.array([WIDTH, TALLEST]) - _PADDING.sum(axis=0)
        scale = float((space / np.diff(box)[:, 0]).min())
        size = 2 * np.rint((np.diff(box)[:, 0] * scale + _PADDING.sum(axis=0)) / 2)
        self.figure = InlineFigure(figsize=tuple(size / DPI), dpi=DPI)
        self._canvas: Any = FigureCanvasAgg(self.figure)
        share = _PADDING / size
        self._axes = self.figure.add_axes((*share[0], *(1 - share.sum(axis=0))), xlim=box[0], ylim=box[1])
        chain.draw_release(self._axes, walk, self._view)
        if not self._tilts:
            chain.draw_ground(self._axes, walk, walk.setup.floor.line(*box[0]), box[1, 0])
            self._axes.set(yticks=[], xticks=floor_marks(*box[0]))
            self._axes.set_xlabel("$x$ / m", loc="right")
            labels = self._axes.get_legend_handles_labels()
            self.figure.legend(*labels, loc="lower left", frameon=False, ncols=4, fontsize="small")
            tidy(self._axes)
            self._axes.spines[["left", "bottom"]].set_visible(False)
        else:
            self._axes.set_axis_off()
            self._draw_floor(low, high)
        self.figure.text(0.015, 0.975, headline(walk), va="top", fontsize=11, color=INK)
        self._moving: list[Any] = []

    def draw(self, frame: int) -> None:
        """Draw one frame: chain, sprocket while it is there, shadow, path of the centre of mass so far, time."""
        for artist in self._moving:
            artist.remove()
        walk, axes, joints = self._walk, self._axes, self._joints[frame]
        moment = walk.frame_time[frame]
        path = self._project(self._center[: max(1, int(np.searchsorted(walk.time, moment, side="right")))])
        clock: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": 11, "color": INK}
        self._moving = [
            *chain.draw_sprocket(axes, walk, moment),
            chain.draw_chain(axes, joints, self._radii, self._view, (INNER, OUTER, EDGE), edge=0.45, halo=False),
            *axes.plot(*path, color=INK, linewidth=0.8, zorder=4),
            *axes.plot(*path[:, -1:], "o", color=INK, markersize=5, zorder=4),
            self.figure.text(0.985, 0.975, f"{moment:.3f} s", **clock),
        ]
        if self._tilts:
            shadow = self._project(np.concatenate([joints, joints[:1]]) * (1.0, 0.0, 1.0))
            self._moving += axes.plot(*shadow, color="#BDBDBD", linewidth=3.0, zorder=1.5)

    def picture(self, frame: int) -> NDArray[np.uint8]:
        """One frame in colour, shape (height, width, 3)."""
        self.draw(frame)
        self._canvas.draw()
        return np.array(np.asarray(self._canvas.buffer_rgba())[..., :3])

    def _project(self, points: Array) -> Array:
        """Points x, y, z [m], shape (p, 3), in the picture: to the right and up [m], shape (2, p)."""
        return np.asarray(self._view[:2] @ points.T)

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
