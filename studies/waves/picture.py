"""The figure of waves along a chain: a quantity of its joints against time, in the chain's frame and in the room's."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from studies.common import INK, tidy
from studies.waves.fields import (
    FEWEST_FRAMES,
    Truths,
    bin_means,
    characteristic,
    curvatures,
    floor_contacts,
    impacts,
    in_room,
    joints_below,
    loop_speeds,
    moving_average,
    normal_velocities,
    self_contacts,
    tensions,
    wave_speeds,
)
from warpchain import WalkResult

Array = NDArray[np.float64]
Colour = Literal["tension", "curvature", "velocity"]

WINDOW: Final = (0.0, 0.3)
"""Times since the release that are shown [s], unless told otherwise: usually the first three impacts."""
FIRST_IMPACTS: Final = 3
"""Number of impacts from which characteristics start."""
COARSEST: Final = 0.5
"""A wave may run at most this many links from frame to frame …"""
FINE: Final = 0.1
"""… and this many with the `frame_interval` that a refusal recommends."""
AVERAGED: Final = 0.02
"""Time [s] over which the mean tension is averaged for the wave speed; in an impact it swings to both sides."""
MOST_COLUMNS: Final = 900
"""Most instants of an image; each is the mean of its frames."""
SHARE: Final = (2.0, 98.0)
"""Percentiles of the image between which colours run; in impacts a few values are ten times greater."""

_DASHES: Final[Any] = (0, (5, 3))
_Style = dict[str, Any]


@dataclass(frozen=True)
class _Look:
    """How a quantity is shown: label of its colours, colour map, whether it is symmetric about 0, colours of lines."""

    label: str
    cmap: str
    is_symmetric: bool
    wave: str
    halo: str
    touch: str


_LOOKS: Final[dict[Colour, _Look]] = {
    "tension": _Look("joint tension / N", "viridis", False, "white", "black", "#F0602F"),
    "curvature": _Look("curvature / m$^{-1}$", "viridis", False, "white", "black", "#F0602F"),
    "velocity": _Look("velocity across the chain, outwards / (m/s)", "RdBu_r", True, INK, "white", "#009E73"),
}


@dataclass(frozen=True, eq=False)
class _Waves:
    """What is drawn, for f frames of n joints.

    Attributes:
        time: [s], shape (f,).
        values: what colours show, shape (f, n).
        below: number of the joint below the centre of mass, shape (f,), see `joints_below`.
        speed: c [m/s], shape (f,).
        speed_is_measured: whether it is that of the tension; else it is the speed of the loop.
        floor: joints at the floor, shape (f, n).
        touch: joints in self-contact, shape (f, n).
        joints: x, y [m], shape (f, n, 2).
        link_length: ℓ [m].
    """

    time: Array
    values: Array
    below: Array
    speed: Array
    speed_is_measured: bool
    floor: Truths
    touch: Truths
    joints: Array
    link_length: float

    @property
    def links(self) -> int:
        """Number of joints n."""
        return len(self.values[0])


def waves_figure(
    walk: WalkResult,
    *,
    colour: Colour = "tension",
    window: tuple[float, float] | None = None,
) -> Figure:
    """Space–time picture of a walk: waves along the chain, above in its own frame, below in that of the room.

    Above, places are joints, which move with the chain; below, places are distances along the loop from the point below
    the centre of mass. Contacts are marked: joints at the floor, and joints that touch others. Lines are
    characteristics, along which small waves run at ±c relative to the chain; they start where each of the first impacts
    begins, and where it ends.

    Args:
        walk: a walk with frames, for the tension with joint forces.
        colour: what colours show: `tension` of the joints along the chain [N]; `curvature` [1/m], positive where the
            chain bends as its loop; `velocity` of the joints across the chain, outwards, relative to the centre of
            mass [m/s].
        window: times since the release between which is shown [s]; None: `WINDOW`.

    Raises:
        ValueError: the plane of the walk tilts, the walk lacks frames or joint forces, its frames are too far apart,
            or colour or window are impossible.
    """
    if colour not in _LOOKS:
        raise ValueError(f"colour: {colour!r} is unknown; give {', '.join(map(repr, get_args(Colour)))}")
    waves, look = _waves(walk, colour, WINDOW if window is None else window), _LOOKS[colour]
    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    own, room = figure.subplots(2, 1, sharex=True)
    length, half = waves.links * waves.link_length, waves.links / 2
    times, shown = bin_means(waves.time, waves.values, MOST_COLUMNS)
    _, moved = bin_means(waves.time, in_room(waves.values, waves.below, 2 * waves.links), MOST_COLUMNS)
    low, high = np.percentile(shown, SHARE)
    if look.is_symmetric:
        high = max(abs(low), abs(high))
        low = -high
    style: _Style = {
        "cmap": look.cmap,
        "vmin": low,
        "vmax": high,
        "aspect": "auto",
        "origin": "lower",
        "interpolation": "nearest",
    }
    span = (times[0], times[-1])
    image = own.imshow(shown.T, extent=(*span, -0.5, waves.links - 0.5), **style)
    room.imshow(moved.T, extent=(*span, -length / 2, length / 2), **style)

    def as_joint(path: Array, first: int) -> Array:
        return (path + 0.5) % waves.links - 0.5

    def as_place(path: Array, first: int) -> Array:
        ahead = path - waves.below[first : first + len(path)]
        return ((ahead + half) % waves.links - half) * waves.link_length

    for axes, place, thick in ((own, as_joint, 1.0), (room, as_place, waves.link_length)):
        _draw_characteristics(axes, waves, look, place, thick * half)
        _draw_contacts(axes, waves, waves.floor, place, thick * half, "black")
        _draw_contacts(axes, waves, waves.touch, place, thick * half, look.touch)
        axes.set(xlim=span)
        tidy(axes)
    own.set(ylabel="number of the joint", ylim=(-0.5, waves.links - 0.5))
    own.set_title(
        f"{walk.setup.scene.links} links, {walk.setup.scene.frequency:g} Hz: in the frame of the chain",
        fontsize="medium",
        loc="left",
    )
    arc = own.secondary_yaxis(
        "right", functions=(lambda joint: joint * waves.link_length, lambda s: s / waves.link_length)
    )
    arc.set_ylabel("arc length along the chain / m")
    room.set(ylabel="arc length from below the centre\nof mass, along the motion / m", ylim=(-length / 2, length / 2))
    room.set(xlabel="time since release $t$ / s")
    room.set_title("in the frame of the room", fontsize="medium", loc="left")
    figure.colorbar(image, ax=[own, room], extend="both", label=look.label, pad=0.02, aspect=40)
    _draw_legend(figure, waves, look)
    return figure


def _waves(walk: WalkResult, colour: Colour, window: tuple[float, float]) -> _Waves:
    """What is drawn of a walk, or a `ValueError`."""
    if walk.joints_in_room is not None:
        raise ValueError("walk: its plane tilts; waves are drawn of walks whose scene.plane is 'fixed'")
    forces, parameters = walk.frame_forces if len(walk.frame_forces) else None, walk.setup.parameters
    if colour == "tension" and forces is None:
        raise ValueError(
            "walk: its joint forces were not recorded; run it again with record_loads, or give colour 'curvature' or "
            "'velocity'"
        )
    begin, end = window
    if not 0 <= begin < end:
        raise ValueError(f"window: {begin:g} s to {end:g} s is no span of time; give two times since the release")
    shown = (walk.frame_time >= begin) & (walk.frame_time <= end)
    if np.count_nonzero(shown) < FEWEST_FRAMES:
        raise ValueError(
            f"window: fewer than {FEWEST_FRAMES} frames are from {begin:g} s to {end:g} s; the walk has frames to "
            f"{walk.frame_time[-1]:.3g} s"
        )
    time, joints = walk.frame_time[shown], walk.frame_joints[shown]
    length = parameters.link_length
    masses = np.tile([parameters.inner_mass, parameters.outer_mass], joints.shape[1] // 2)
    running = np.abs(loop_speeds(time, joints, masses))
    tension = None if forces is None else tensions(joints, forces[shown])
    if tension is None:
        speed = running
    else:
        mean = moving_average(time, tension.mean(axis=1), AVERAGED)
        speed = wave_speeds(mean, length, float(masses.mean()))
    between, fastest = float(np.median(np.diff(time))), float(running.max())
    if fastest * between > COARSEST * length:
        raise ValueError(
            f"walk: its frames are {between:.2g} s apart, in which a wave runs {fastest * between / length:.2g} links; "
            f"run it again with a frame_interval of {FINE * length / fastest:.1g} s"
        )
    if colour == "tension" and tension is not None:
        values = tension
    elif colour == "curvature":
        values = curvatures(joints, length)
    else:
        values = normal_velocities(time, joints, masses)
    radius = parameters.circle_radius
    return _Waves(
        time=time,
        values=values,
        below=joints_below(joints, masses),
        speed=speed,
        speed_is_measured=tension is not None,
        floor=floor_contacts(joints, radius),
        touch=self_contacts(joints, radius),
        joints=joints,
        link_length=length,
    )


Place = Callable[[Array, int], Array]
"""Joint numbers at consecutive frames, and the first frame → places on a panel, wrapped around the loop."""


def _draw_characteristics(axes: Axes, waves: _Waves, look: _Look, place: Place, half: float) -> None:
    """Both families from beginning and end of each of the first impacts, until the next one begins."""
    found = impacts(waves.time, waves.joints, waves.floor)
    ends = [impact.frame for impact in found[1:]] + [len(waves.time)]
    for impact, end in zip(found[:FIRST_IMPACTS], ends, strict=False):
        starts = ((impact.frame, impact.joint, "-"), (impact.last_frame, impact.last_joint, _DASHES))
        for frame, joint, line in starts:
            for sign in (1.0, -1.0):
                path = characteristic(waves.time, sign * waves.speed, frame, joint, waves.link_length)
                path = path[: end - frame]
                places = place(path, frame)
                jumps = np.abs(np.diff(places, prepend=places[:1])) > half
                places = np.where(jumps, np.nan, places)
                halo = [withStroke(linewidth=1.8, foreground=look.halo, alpha=0.6)]
                times = waves.time[frame : frame + len(places)]
                axes.plot(times, places, color=look.wave, linewidth=0.8, linestyle=line, path_effects=halo)


def _draw_contacts(axes: Axes, waves: _Waves, touching: Truths, place: Place, half: float, color: str) -> None:
    """A line for as long as a joint touches, broken where it passes from one end of the panel to the other."""
    segments: list[Array] = []
    for joint in np.flatnonzero(touching.any(axis=0)):
        edges = np.flatnonzero(np.diff(touching[:, joint].astype(np.int8), prepend=0, append=0))
        for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
            y = place(np.full(last - first + 1, float(joint)), int(first))
            path = np.stack([waves.time[first : last + 1], y], axis=1)
            if len(path) == 1:
                path = np.repeat(path, 2, axis=0)
            segments += np.split(path, np.flatnonzero(np.abs(np.diff(path[:, 1])) > half) + 1)
    axes.add_collection(LineCollection(segments, colors=color, linewidths=1.4, capstyle="projecting", zorder=4))


def _draw_legend(figure: Figure, waves: _Waves, look: _Look) -> None:
    """What marks and lines mean, below the panels."""
    speed = "c = \\sqrt{T\\ell/\\bar{m}}" if waves.speed_is_measured else "c = v"
    halo = [withStroke(linewidth=2.2, foreground="#777777")]
    lines = [
        Line2D(
            [], [], color=look.wave, linewidth=1.0, path_effects=halo, label=f"±c from beginning of impact, ${speed}$"
        ),
        Line2D([], [], color=look.wave, linewidth=1.0, linestyle=_DASHES, path_effects=halo, label="±c from its end"),
        Line2D([], [], color="black", linewidth=2.0, label="joint at the floor"),
        Line2D([], [], color=look.touch, linewidth=2.0, label="joint in self-contact"),
    ]
    figure.legend(handles=lines, loc="outside lower center", ncols=4, frameon=False, fontsize="small")
