"""Moving pictures of a walk: GIF, MP4, or a page with a player for the browser."""

import html
import importlib
import itertools
import json
import math
import os
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from warpchain.files import checked_output, replacing, write_whole
from warpchain.pictures.chain import floor_height, floor_line
from warpchain.pictures.film import DPI, EDGE, INNER, OUTER, Film, floor_marks, side_box
from warpchain.pictures.walk_shape import checked_joints, headline

if TYPE_CHECKING:
    from warpchain.walks.walk_result import WalkResult

_PLAYER: Final = Path(__file__).with_name("player.html")
"""The page with a player, which says what its data are."""
_HOLD: Final = 1.5
"""Time for which GIF and MP4 show their last picture [s]."""
_GIF_PICTURES: Final = 1200
"""Most pictures of a GIF: all are in memory at once, up to 0.5 MB each."""
_PLAYER_FRAMES: Final = 2000
"""Most frames of a page, which then has about 1 MB with 60 links."""

_SLOWEST_GIF, _FASTEST_GIF = 1, 50
"""Pictures per second of a GIF."""


def animate(walk: "WalkResult", path: str | os.PathLike[str], *, fps: float = 30.0, slow: float = 4.0) -> None:
    """Write a moving picture of a walk; the suffix of `path` gives the format: .gif, .mp4 or .html.

    If there are more pictures than frames, each frame is shown until the next one. A chain whose plane tilts is seen
    from the front right and slightly above; in a .html file, which loads nothing else, from the side. Arguments and
    errors are those of `WalkResult.animate`.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".gif", ".mp4", ".html"):
        raise ValueError(f"{path}: unknown kind of picture; give a name that ends in .gif, .mp4 or .html")
    for name, value in (("fps", fps), ("slow", slow)):
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name}: {value} is not a positive number; give one such as 30")
    if suffix == ".gif" and not _SLOWEST_GIF <= fps <= _FASTEST_GIF:
        problem = "fast" if fps > _FASTEST_GIF else "slow"
        raise ValueError(f"fps: {fps} is too {problem} for a GIF; give {_SLOWEST_GIF} to {_FASTEST_GIF}")
    checked_joints(walk)
    target = checked_output(path)
    if suffix == ".html":
        write_whole(target, player(walk, slow))
    elif suffix == ".gif":
        _write_gif(walk, target, fps, slow)
    else:
        _write_mp4(walk, target, fps, slow)


def _chosen_frames(walk: "WalkResult", fps: float, slow: float) -> list[int]:
    """Number of the frame that each picture shows: the last one recorded by then. Pictures come at a constant rate."""
    start, end = walk.frame_time[0], walk.frame_time[-1]
    marks = start + np.arange(math.floor((end - start) * fps * slow + 1e-6) + 1) / (fps * slow)
    chosen: list[int] = (np.searchsorted(walk.frame_time, marks + 1e-9, side="right") - 1).tolist()
    return chosen if chosen[-1] == len(walk.frame_time) - 1 else [*chosen, len(walk.frame_time) - 1]


def _write_gif(walk: "WalkResult", path: Path, fps: float, slow: float) -> None:
    """Write pictures with equal delays in whole hundredths of a second; Pillow writes equal ones once.

    matplotlib's writer of GIFs cuts its delays off: at 30 pictures a second they would be 10 % too short.
    """
    from PIL import Image

    delay = round(100 / fps)
    chosen = _chosen_frames(walk, 100 / delay, slow)
    if len(chosen) > _GIF_PICTURES:
        raise ValueError(f"{path}: {len(chosen)} pictures are too many for a GIF; lower fps or slow, or give .mp4")
    film = Film(walk)
    palette = Image.fromarray(film.picture(len(walk.frame_time) // 2)).quantize(64)
    palette.putpalette([255 if part > 247 else part for part in palette.getpalette() or []])  # its white is a mean

    def reduced(frame: int) -> Image.Image:
        return Image.fromarray(film.picture(frame)).quantize(palette=palette, dither=Image.Dither.NONE)

    chosen += chosen[-1:] * (round(_HOLD * 100 / delay) - 1)
    pictures = (each for frame, group in itertools.groupby(chosen) for each in [reduced(frame)] * len(list(group)))
    with replacing(path) as part:
        next(pictures).save(part, format="GIF", save_all=True, append_images=pictures, duration=10 * delay, loop=0)


def _write_mp4(walk: "WalkResult", path: Path, fps: float, slow: float) -> None:
    """Let ffmpeg code the pictures; `imageio_ffmpeg` brings it."""
    import matplotlib as mpl
    from matplotlib.animation import FFMpegWriter

    try:
        ffmpeg = importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    except ImportError:
        raise ImportError(f"{path}: MP4 needs imageio-ffmpeg; pip install 'warpchain[video]'") from None
    chosen = _chosen_frames(walk, fps, slow)
    chosen += chosen[-1:] * round(_HOLD * fps)
    film = Film(walk)
    # What ffmpeg says would be lines on the terminal.
    writer = FFMpegWriter(
        fps=cast(Any, fps), codec="h264", extra_args=["-crf", "20", "-loglevel", "quiet", "-f", "mp4"]
    )
    with replacing(path) as part, mpl.rc_context({"animation.ffmpeg_path": ffmpeg}):
        try:
            with writer.saving(film.figure, str(part), DPI):
                for frame, group in itertools.groupby(chosen):
                    film.draw(frame)
                    for _ in group:
                        writer.grab_frame()
        except (subprocess.CalledProcessError, BrokenPipeError) as error:
            raise OSError("ffmpeg ended early") from error


def player(walk: "WalkResult", slow: float = 4.0) -> str:
    """A page with a player of the frames from the side: lengths in tenths of a millimetre, times in microseconds.

    Args:
        walk: a walk with frames.
        slow: playing time per simulated time at the start.

    Raises:
        ValueError: the walk has no frames or broken ones.
    """
    joints, sprocket = checked_joints(walk), walk.sprocket_center
    count = min(len(walk.frame_time), _PLAYER_FRAMES)
    frames = np.rint(np.linspace(0, len(walk.frame_time) - 1, count)).astype(int)
    times, box = walk.frame_time[frames], side_box(walk, joints)
    marks = floor_marks(*box[0])
    center = np.stack([np.interp(times, walk.time, walk.center[:, axis]) for axis in (0, 1)], axis=1)
    data = {
        "time": _whole(times, 1e6),
        "joints": _whole(joints[frames, :, :2].reshape(count, -1)),
        "center": _whole(center),
        "radius": walk.setup.parameters.circle_radius * 1e4,
        "sprocket": None if sprocket is None else _whole(np.array([*sprocket, walk.sprocket_radius])),
        "view": _whole(box.ravel()),
        "marks": marks,
        "heights": _whole(np.array(floor_height(walk, np.array(marks)))),
        "floor": _whole(floor_line(walk, *(box[0] + np.array([-3, 3]) * np.ptp(box[0])))),
        "slow": slow,
        "colors": {"inner": INNER, "outer": OUTER, "edge": EDGE},
    }
    title = html.escape(headline(walk) + ", from the side" * (walk.joints_in_room is not None))
    content = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return _PLAYER.read_text(encoding="utf-8").replace("{{title}}", title).replace("{{data}}", content)


def _whole(values: NDArray[np.float64], parts: float = 1e4) -> list[int] | list[list[int]]:
    """Numbers in whole parts, as lists: lengths [m] in tenths of a millimetre."""
    whole: list[int] | list[list[int]] = np.rint(values * parts).astype(int).tolist()
    return whole
