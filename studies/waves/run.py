"""Prints all numbers of README.md and draws its figures: of rings in rings.py, of the frames of walks here."""

from pathlib import Path

import numpy as np

import warpchain
from studies.common import publish
from studies.waves import fields, rings
from studies.waves.picture import waves_figure
from studies.waves.wave_drag import inertia_of

FOLDER = Path(__file__).parent
WALKS = ((120, 20.0, 0.10, 0.24), (60, 15.0, 0.13, 0.33))  # Links, frequency [Hz], times [s] between impacts
MODES = (2, 3, 4, 5, 6, 8, 10)  # Numbers of waves around the loop
RATIOS = np.arange(0.05, 1.51, 0.01)  # Speeds that are tried, as multiples of c


def print_speeds(walk: warpchain.WalkResult, begin: float, end: float) -> None:
    """Speeds of waves by their number around the loop, and the part of the variance that has this speed."""
    parameters, scene, time, joints = walk.setup.parameters, walk.setup.scene, walk.frame_time, walk.frame_joints
    masses = inertia_of(scene.links, parameters)[:, 0]
    length, shown = parameters.link_length, (time >= begin) & (time < end)
    speed = fields.wave_speeds(time, joints, walk.frame_forces, length, masses.mean())[shown]
    way = fields.characteristic(time[shown], speed, 0, 0.0, length)
    bend = fields.curvatures(joints, length)[shown]
    across = fields.normal_velocities(time, joints, masses)[shown]
    print(f"{scene.links} links, {scene.frequency:g} Hz, {begin} s to {end} s, c = {speed.mean():.2f} m/s:")
    print(f"stretching: {length * np.sqrt(parameters.joint_stiffness / masses.mean()):.0f} m/s")
    print("waves around the loop | slow, curvature | part | fast, velocity | part")
    for mode in MODES:
        cells = []
        for values, sign in ((bend, -1.0), (across, 1.0)):
            power = [fields.stacked_power(values, sign * ratio * way, (mode, mode)) for ratio in RATIOS]
            best = int(np.argmax(power))
            cells.append(f"{sign * RATIOS[best]:+.2f} c | {power[best]:.2f}")
        print(f"{mode} | {' | '.join(cells)}")


def main() -> None:
    """Print all tables and draw the figures."""
    rings.main()
    for number, (links, frequency, begin, end) in enumerate(WALKS):
        scene = {"links": links, "frequency": frequency, "start": "spinning", "walk_limit": 0.35}
        walk = warpchain.walk(preset="soft", **scene, record_loads=True, record_before=0.0, frame_interval=1e-4)
        if number == 0:
            publish(FOLDER, {}, {"picture": waves_figure(walk, window=(0.0, 0.25))}, dpi=90)
        print_speeds(walk, begin, end)


if __name__ == "__main__":
    main()
