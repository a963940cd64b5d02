"""Moving pictures of a walk: GIF, MP4, or a page with a player for the browser."""

import importlib
import itertools
import math
import os
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.files import checked_output, replacing, write_whole
from warpchain.pictures.player_page import EDGE, ENLARGEMENT, FLAT, INNER, OUTER, TALLEST, WIDTH, page, whole
from warpchain.pictures.room import link_outlines
from warpchain.pictures.room_player import ROOM, room_data
from warpchain.pictures.room_stage import RoomStage
from warpchain.pictures.strip_parts import center_at
from warpchain.pictures.style import FAINT, GROUND, INK
from warpchain.pictures.walk_figures import extent
from warpchain.pictures.walk_shape import Walk, check_frames, setting, tilting

if TYPE_CHECKING:
    from PIL.Image import Image

Array = NDArray[np.float64]

_HOLD: Final = 1.5
"""Time for which GIF and MP4 show their last picture [s]."""
_GIF_PICTURES: Final = 1200
"""Most pictures of a GIF: all are in memory at once, 0.5 MB each."""
_PLAYER_FRAMES: Final = 2000
"""Most frames of a page, which then has about 1 MB with 60 links."""

_SLOWEST_GIF, _FASTEST_GIF = 0.002, 50
"""Pictures per second of a GIF, whose delays are 16-bit numbers of hundredths of a second."""


def animate(walk: Walk, path: str | os.PathLike[str], *, fps: float = 30.0, slow: float = 4.0) -> None:
    """Write a moving picture of a walk; the suffix of `path` gives the format: .gif, .mp4 or .html.

    If there are more pictures than frames, each frame is shown until the next one. A chain whose plane tilts is seen
    from the front right and slightly above; in a .html file it can be turned.

    Args:
        walk: a walk with frames.
        path: the file to write, whole or not at all; an older one is replaced. A .html file loads nothing else, and
            has play, pause, speed and a slider.
        fps: pictures per second of playing time; in a .html file the browser decides.
        slow: playing time per simulated time; in a .html file the value at the start.

    Raises:
        ValueError: the suffix is unknown, the walk has no frames or broken ones, fps or slow is not positive, or a
            GIF would have too many pictures, in all or per second (viewers slow down over 50), or too few.
        ImportError: an .mp4 is asked for and `imageio-ffmpeg` is not installed.
        OSError: the file cannot be written, or something else than a regular file is there.
    """
    suffix = Path(path).suffix.lower()
    writers = {".gif": _write_gif, ".mp4": _write_mp4, ".html": _write_html}
    if suffix not in writers:
        raise ValueError(f"{path}: unknown kind of picture; give a name that ends in .gif, .mp4 or .html")
    for name, value in (("fps", fps), ("slow", slow)):
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name}: {value} is not a positive number; give one such as 30")
    if suffix == ".gif" and not _SLOWEST_GIF <= fps <= _FASTEST_GIF:
        problem = "fast" if fps > _FASTEST_GIF else "slow"
        raise ValueError(f"fps: {fps} is too {problem} for a GIF; give {_SLOWEST_GIF} to {_FASTEST_GIF}")
    check_frames(walk)
    writers[suffix](walk, checked_output(path), fps, slow)


def _chosen_frames(walk: Walk, fps: float, slow: float) -> list[int]:
    """Number of the frame that each picture shows: the last one recorded by then. Pictures come at a constant rate."""
    start, end = walk.frame_time[0], walk.frame_time[-1]
    marks = start + np.arange(math.floor((end - start) * fps * slow + 1e-6) + 1) / (fps * slow)
    chosen: list[int] = (np.searchsorted(walk.frame_time, marks + 1e-9, side="right") - 1).tolist()
    return chosen if chosen[-1] == len(walk.frame_time) - 1 else [*chosen, len(walk.frame_time) - 1]


def _write_gif(walk: Walk, path: Path, fps: float, slow: float) -> None:
    """Write each frame once; durations are hundredths of a second, rounded so that errors do not add up."""
    from PIL import Image

    chosen = _chosen_frames(walk, fps, slow)
    pictures = [frame for frame, _ in itertools.groupby(chosen)]
    repeats = [len(list(group)) for _, group in itertools.groupby(chosen)]
    if len(pictures) > _GIF_PICTURES:
        raise ValueError(f"{path}: {len(pictures)} pictures are too many for a GIF; lower fps or slow, or give .mp4")
    ends = np.rint(np.cumsum([0, *repeats]) * 100 / fps)
    durations = [int(hundredths) * 10 for hundredths in np.diff(ends)]
    durations[-1] = int(_HOLD * 1000)
    if max(durations) >= 1000 / _SLOWEST_GIF:
        raise ValueError(f"slow: {slow} shows a picture for more than {1 / _SLOWEST_GIF:g} s; give a smaller number")
    stage = _stage(walk)
    # One palette for all, from the first, the middle and the last picture; otherwise each picture has its own.
    samples = [np.asarray(stage.picture(pictures[round(part * (len(pictures) - 1))])) for part in (0, 0.5, 1)]
    palette = Image.fromarray(np.concatenate(samples)).quantize(48, dither=Image.Dither.NONE)
    reduced = (stage.picture(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in pictures)
    with replacing(path) as part:
        first = next(reduced)
        first.save(part, format="GIF", save_all=True, append_images=reduced, duration=durations, loop=0)


def _write_mp4(walk: Walk, path: Path, fps: float, slow: float) -> None:
    try:
        ffmpeg = importlib.import_module("imageio_ffmpeg")
    except ImportError:
        raise ImportError(f"{path}: MP4 needs imageio-ffmpeg; pip install 'warpchain[video]'") from None
    stage = _stage(walk)
    chosen = _chosen_frames(walk, fps, slow)
    chosen += chosen[-1:] * round(_HOLD * fps)
    # imageio-ffmpeg lets the lines of ffmpeg through to the terminal, and hides how it ends.
    coding = {"fps": fps, "quality": 8, "macro_block_size": 2, "ffmpeg_log_level": "quiet"}
    with replacing(path) as part:
        try:
            with closing(ffmpeg.write_frames(str(part), stage.size, **coding)) as writer:
                writer.send(None)
                for frame, group in itertools.groupby(chosen):
                    content = stage.picture(frame).tobytes()
                    for _ in group:
                        writer.send(content)
        except OSError as error:
            raise OSError("ffmpeg ended early") from error
        if not _is_whole_mp4(part):
            raise OSError("ffmpeg did not write it to the end")


def _is_whole_mp4(path: Path) -> bool:
    """Whether the boxes of an MP4 fill its file and the index, which is written last, is among them."""
    kinds, place, end = [], 0, path.stat().st_size
    with path.open("rb") as content:
        while place < end:
            content.seek(place)
            size, kind = int.from_bytes(content.read(4)), content.read(4)
            if size == 1:  # the size does not fit and follows in 8 bytes
                size = int.from_bytes(content.read(8))
            kinds.append(kind)
            place += max(size, 8)
    return place == end and b"moov" in kinds


@dataclass(frozen=True)
class _View:
    """The part of the plane that is shown, and the marks on the floor [m]."""

    left: float
    right: float
    bottom: float
    top: float
    marks: tuple[float, ...]


def _view(walk: Walk) -> _View:
    """The whole walk, with a strip of floor for the marks."""
    left, right, top = extent(walk)
    spacing = next((step for step in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if (right - left) / step <= 9), 10.0)
    numbers = range(math.ceil(left / spacing), math.floor(right / spacing) + 1)
    bottom = -0.045 * max(right - left, top)
    return _View(left, right, bottom, top, tuple(round(number * spacing, 6) for number in numbers))


def _stage(walk: Walk) -> "_Stage | RoomStage":
    """What draws the frames of a walk."""
    in_room = tilting(walk)
    return _Stage(walk) if in_room is None else RoomStage(in_room)


class _Stage:
    """Draws the frames of one walk, all to the same scale.

    Attributes:
        size: width and height of a picture in pixels, even numbers for video.
    """

    def __init__(self, walk: Walk) -> None:
        from PIL import ImageFont

        view = _view(walk)
        width, height = view.right - view.left, view.top - view.bottom
        self._walk, self._view = walk, view
        self._scale = min(WIDTH / width, TALLEST / height)
        self.size = 2 * round(self._scale * width / 2), 2 * round(self._scale * height / 2)
        self._font = ImageFont.load_default(16)
        self._backdrop = self._draw_backdrop()
        self._center = self._pixels(walk.center)

    def _pixels(self, points: Array) -> Array:
        """Pixels in the enlarged picture of points x, y [m], both of shape (…, 2)."""
        scale = self._scale * ENLARGEMENT
        return np.asarray((points - (self._view.left, self._view.top)) * (scale, -scale))

    def _draw_backdrop(self) -> "Image":
        """What never moves, enlarged."""
        from PIL import Image, ImageDraw

        width, height = (ENLARGEMENT * side for side in self.size)
        backdrop = Image.new("RGB", (width, height), "white")
        draw = ImageDraw.Draw(backdrop)
        if self._walk.sprocket_center is not None:
            center = tuple(self._pixels(self._walk.sprocket_center))
            radius = self._walk.sprocket_radius * self._scale * ENLARGEMENT
            draw.circle(center, radius, outline=FAINT, width=ENLARGEMENT)
            draw.circle(center, 2 * ENLARGEMENT, fill=FAINT)
        floor = self._pixels(np.zeros(2))[1]
        draw.rectangle((0, floor, width, height), fill=GROUND)
        draw.line((0, floor, width, floor), fill=INK, width=ENLARGEMENT)
        for mark in self._view.marks:
            x = self._pixels(np.array([mark, 0.0]))[0]
            draw.line((x, floor, x, floor + 6 * ENLARGEMENT), fill=INK, width=ENLARGEMENT)
        return backdrop

    def picture(self, frame: int) -> "Image":
        """One frame in colour: the chain, the path of its centre of mass so far, time and marks."""
        from PIL import ImageDraw

        image = self._backdrop.copy()
        draw = ImageDraw.Draw(image)
        joints, radius = self._walk.frame_joints[frame], self._walk.setup.parameters.circle_radius
        rim = min(0.7 / self._scale, radius / 2)
        for parity, fill in ((0, INNER), (1, OUTER)):
            for size, color in ((radius, EDGE), (radius - rim, fill)):
                for outline in self._pixels(link_outlines(joints, size)[parity::2]):
                    draw.polygon(outline.ravel().tolist(), fill=color)
        moment = self._walk.frame_time[frame]
        path = self._center[: max(1, int(np.searchsorted(self._walk.time, moment, side="right")))]
        draw.line(path.ravel().tolist(), fill=INK, width=ENLARGEMENT)
        x, y = path[-1]
        draw.circle((x, y), 3.5 * ENLARGEMENT, fill=INK)
        image = image.reduce(ENLARGEMENT)
        draw = ImageDraw.Draw(image)
        draw.text((self.size[0] - 12, 10), f"{moment:.3f} s", fill=INK, font=self._font, anchor="rt")
        for mark in self._view.marks:
            x, y = self._pixels(np.array([mark, 0.0])) / ENLARGEMENT
            draw.text((x, y + 9), f"{mark:g} m", fill=INK, font=self._font, anchor="mt")
        return image


def _write_html(walk: Walk, path: Path, fps: float, slow: float) -> None:
    write_whole(path, player(walk, slow))


def player(walk: Walk, slow: float = 4.0) -> str:
    """A page with the frames and a player: lengths in whole tenths of a millimetre, times in microseconds.

    Args:
        walk: a walk with frames.
        slow: playing time per simulated time at the start.

    Raises:
        ValueError: the walk has no frames or broken ones.
    """
    check_frames(walk)
    count = min(len(walk.frame_time), _PLAYER_FRAMES)
    frames = np.rint(np.linspace(0, len(walk.frame_time) - 1, count)).astype(int)
    title = setting(walk) + (f": \u0394x = {walk.dx:.3f} m" if math.isfinite(walk.dx) else "")
    in_room = tilting(walk)
    data = _flat_data(walk, frames, slow) if in_room is None else {**room_data(in_room, frames), "slow": slow}
    return page(title, data, FLAT if in_room is None else ROOM)


def _flat_data(walk: Walk, frames: NDArray[np.int_], slow: float) -> dict[str, Any]:
    """What the page of a chain in an upright plane draws."""
    times, view, sprocket = walk.frame_time[frames], _view(walk), walk.sprocket_center
    return {
        "time": whole(times, 1e6),
        "joints": whole(walk.frame_joints[frames].reshape(len(frames), -1)),
        "center": whole(center_at(walk, times)),
        "radius": walk.setup.parameters.circle_radius * 1e4,
        "sprocket": None if sprocket is None else whole(np.array([*sprocket, walk.sprocket_radius])),
        "view": whole(np.array([view.left, view.right, view.bottom, view.top])),
        "marks": list(view.marks),
        "slow": slow,
        "colors": {"inner": INNER, "outer": OUTER, "edge": EDGE},
    }
