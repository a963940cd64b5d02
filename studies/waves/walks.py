"""Draws the picture of waves in a walk, and prints how fast the two waves in it run."""

from pathlib import Path

import numpy as np

import warpchain
from studies.common import save_figure
from studies.waves.fields import (
    characteristic,
    curvatures,
    moving_average,
    normal_velocities,
    stacked_power,
    tensions,
    wave_speeds,
)
from studies.waves.picture import AVERAGED, waves_figure

FIGURE = Path(__file__).parent / "figures" / "picture.png"
WALKS = ((120, 20.0, (0.10, 0.24)), (60, 15.0, (0.13, 0.33)))
"""Links, frequency [Hz], and times [s] between two impacts in which speeds are measured."""
MODES = (2, 3, 4, 5, 6, 8, 10)
"""Numbers of waves around the loop."""
RATIOS = np.arange(0.05, 1.51, 0.01)
"""Speeds that are tried, as multiples of c."""


def recorded(links: int, frequency: float) -> warpchain.WalkResult:
    """The first 0.35 s of a walk of soft joints, with joint forces in frames 0.1 ms apart."""
    return warpchain.walk(
        links=links,
        frequency=frequency,
        preset="soft",
        start="spinning",
        walk_limit=0.35,
        record_loads=True,
        record_before=0.0,
        frame_interval=1e-4,
    )


def print_speeds(walk: warpchain.WalkResult, begin: float, end: float) -> None:
    """Speeds of waves by their number around the loop, and the part of the variance that has this speed."""
    parameters, scene, time = walk.setup.parameters, walk.setup.scene, walk.frame_time
    masses = np.tile([parameters.inner_mass, parameters.outer_mass], scene.links // 2)
    length, shown = parameters.link_length, (time >= begin) & (time < end)
    mean = moving_average(time, tensions(walk.frame_joints, walk.frame_forces).mean(axis=1), AVERAGED)
    speed = wave_speeds(mean, length, float(masses.mean()))[shown]
    way = characteristic(time[shown], speed, 0, 0.0, length)
    bend = curvatures(walk.frame_joints, length)[shown]
    across = normal_velocities(time, walk.frame_joints, masses)[shown]
    print(f"{scene.links} links, {scene.frequency:g} Hz, {begin} s to {end} s, c = {speed.mean():.2f} m/s:")
    print(f"stretching: {length * np.sqrt(parameters.joint_stiffness / masses.mean()):.0f} m/s")
    print("waves around the loop | slow, curvature | part | fast, velocity | part")
    for mode in MODES:
        cells = []
        for values, sign in ((bend, -1.0), (across, 1.0)):
            power = [stacked_power(values, sign * ratio * way, (mode, mode)) for ratio in RATIOS]
            best = int(np.argmax(power))
            cells.append(f"{sign * RATIOS[best]:+.2f} c | {power[best]:.2f}")
        print(f"{mode} | {' | '.join(cells)}")


def main() -> None:
    """Draw the figure of the first walk, and print the speeds of all."""
    for number, (links, frequency, (begin, end)) in enumerate(WALKS):
        walk = recorded(links, frequency)
        if number == 0:
            save_figure(waves_figure(walk, colour="curvature", window=(0.0, 0.25)), FIGURE, dpi=90)
        print_speeds(walk, begin, end)
