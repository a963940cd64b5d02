"""The figure of waves along a chain: a quantity of its joints against time, in the chain's frame and in the room's."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from studies.common import FAINT, INK, Array, tidy
from studies.waves import fields
from studies.waves.wave_drag import inertia_of
from warpchain import WalkResult

Colour = Literal["curvature", "velocity"]
Place = Callable[[Array, int], Array]  # Joint numbers at frames, and the first of these → places on a panel

FIRST_IMPACTS = 3  # Number of impacts from which characteristics start
MOST_COLUMNS = 900  # Most instants of an image; each is the mean of its frames
SHARE = (2.0, 98.0)  # Percentiles of the image between which colours run; in impacts a few values are ten times greater
_DASHES = (0, (5, 3))


_LOOKS = {
    "curvature": ("curvature / m$^{-1}$", "viridis", "white", "black", "#F0602F"),
    "velocity": ("velocity across the chain, outwards / (m/s)", "RdBu_r", INK, "white", "#009E73"),
}
"""Label and map of the colours; colours of waves, of the rims of their lines, and of links that touch."""


def waves_figure(walk: WalkResult, *, colour: Colour = "curvature", window: tuple[float, float] = (0.0, 0.3)) -> Figure:
    """Space–time picture of a walk: waves along the chain, above in its own frame, below in that of the room.

    README.md says what lines and places mean. The walk has a fixed plane and joint forces, in frames in which a wave
    runs at most half a link. Colours show the `curvature` [1/m], positive where the chain bends as its loop, or the
    `velocity` of the joints across the chain, outwards, relative to the centre of mass [m/s].
    """
    if not len(walk.frame_forces):
        raise ValueError("walk: its joint forces were not recorded; run it again with record_joint_forces")
    label, cmap, wave, rim, touching = _LOOKS[colour]
    parameters, scene = walk.setup.parameters, walk.setup.scene
    shown = (walk.frame_time >= window[0]) & (walk.frame_time <= window[1])
    time, joints, links, link = walk.frame_time[shown], walk.frame_joints[shown], scene.links, parameters.link_length
    masses, length = inertia_of(links, parameters)[:, 0], links * link
    speed = fields.wave_speeds(time, joints, walk.frame_forces[shown], link, masses.mean())
    below = fields.joints_below(joints, masses)
    velocity = colour == "velocity"
    values = fields.normal_velocities(time, joints, masses) if velocity else fields.curvatures(joints, link)
    floor = joints[..., 1] <= (1 + fields.NEAR) * parameters.circle_radius
    touch = fields.self_contacts(joints, parameters.circle_radius)
    still, moved = (fields.bin_means(each, MOST_COLUMNS) for each in (values, fields.in_room(values, below, 2 * links)))
    low, high = np.percentile(still, SHARE)
    if velocity:
        low, high = -max(abs(low), abs(high)), max(abs(low), abs(high))

    def as_joint(path: Array, first: int) -> Array:
        return (path + 0.5) % links - 0.5

    def as_place(path: Array, first: int) -> Array:
        return ((path - below[first : first + len(path)] + links / 2) % links - links / 2) * link

    figure = Figure(figsize=(9.0, 8.0), layout="constrained")
    own, room = figure.subplots(2, 1, sharex=True)
    colors = {"cmap": cmap, "vmin": low, "vmax": high}
    style = {"aspect": "auto", "origin": "lower", "interpolation": "nearest"} | colors
    lines = {"color": wave, "path_effects": [withStroke(linewidth=1.8, foreground=rim, alpha=0.6)]}
    for axes, image, place, low, high in (
        (own, still, as_joint, -0.5, links - 0.5),
        (room, moved, as_place, -length / 2, length / 2),
    ):
        shades = axes.imshow(image.T, extent=(time[0], time[-1], low, high), **style)
        _draw_characteristics(axes, lines, time, speed / link, joints, floor, place, (high - low) / 2)
        _draw_contacts(axes, time, floor, place, (high - low) / 2, "black")
        _draw_contacts(axes, time, touch, place, (high - low) / 2, touching)
        axes.set(xlim=(time[0], time[-1]), ylim=(low, high))
    tidy(own, f"{links} links, {scene.frequency:g} Hz: in the frame of the chain", ylabel="number of the joint")
    along = "arc length from below the centre\nof mass, along the motion / m"
    tidy(room, "in the frame of the room", ylabel=along, xlabel="time since release $t$ / s")
    figure.colorbar(shades, ax=[own, room], extend="both", label=label, pad=0.02, aspect=40)
    _draw_legend(figure, wave, touching)
    return figure


def _draw_characteristics(
    axes: Axes, style: Any, time: Array, speed: Array, joints: Array, floor: Array, place: Place, half: float
) -> None:
    """Both families from beginning and end of each of the first impacts, until the next one begins."""
    found, lowest = fields.impacts(time, floor), np.argmin(joints[..., 1], axis=1)
    ends = [first for first, _ in found[1:]] + [len(time)]
    for impact, end in zip(found[:FIRST_IMPACTS], ends, strict=False):
        for frame, line in zip(impact, ("-", _DASHES), strict=True):
            for sign in (1.0, -1.0):
                path = fields.characteristic(time, sign * speed, frame, lowest[frame], 1.0)[: end - frame]
                places = place(path, frame)
                places = np.where(np.abs(np.diff(places, prepend=places[:1])) > half, np.nan, places)
                times = time[frame : frame + len(places)]
                axes.plot(times, places, linewidth=0.8, linestyle=line, **style)


def _draw_contacts(axes: Axes, time: Array, touching: Array, place: Place, half: float, color: str) -> None:
    """A line for as long as a joint touches, broken where it passes from one end of the panel to the other."""
    segments: list[Array] = []
    for joint in np.flatnonzero(touching.any(axis=0)):
        edges = np.flatnonzero(np.diff(touching[:, joint].astype(np.int8), prepend=0, append=0))
        for first, end in zip(edges[::2], edges[1::2], strict=True):
            path = np.stack([time[first:end], place(np.full(end - first, float(joint)), int(first))], axis=1)
            path = np.repeat(path, 2, axis=0)  # a touch of one frame is a dot
            segments += np.split(path, np.flatnonzero(np.abs(np.diff(path[:, 1])) > half) + 1)
    axes.add_collection(LineCollection(segments, colors=color, linewidths=1.4, capstyle="projecting", zorder=4))


def _draw_legend(figure: Figure, wave: str, touching: str) -> None:
    """What marks and lines mean, below the panels."""
    begins = "±c from beginning of impact, $c = \\sqrt{T\\ell/\\bar{m}}$"
    style = {"color": wave, "linewidth": 1.0, "path_effects": [withStroke(linewidth=2.2, foreground=FAINT)]}
    lines = [
        Line2D([], [], label=begins, **style),
        Line2D([], [], linestyle=_DASHES, label="±c from its end", **style),
        Line2D([], [], color="black", linewidth=2.0, label="joint at the floor"),
        Line2D([], [], color=touching, linewidth=2.0, label="joint in self-contact"),
    ]
    figure.legend(handles=lines, loc="outside lower center", ncols=4, frameon=False, fontsize="small")
