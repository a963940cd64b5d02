"""Writes tables of README.md and draws its figures: of rings as rings.py has them, of the frames of a walk here."""

from pathlib import Path

import numpy as np

import warpchain
from studies.common import minus, publish, show, table, write_rows
from studies.waves import fields, rings
from studies.waves.picture import waves_figure
from studies.waves.wave_drag import inertia_of

FOLDER = Path(__file__).parent
LINKS, FREQUENCY = 120, 20.0  # Of the walk that is drawn; [Hz]
BETWEEN = (0.10, 0.24)  # Times between its first impacts [s]
MODES = (2, 3, 4, 5, 6, 8, 10)  # Numbers of waves around the loop
RATIOS = np.arange(0.05, 1.51, 0.01)  # Speeds that are tried, as multiples of c


def speeds_table(walk: warpchain.WalkResult) -> str:
    """Speeds of waves by their number around the loop, and the part of the variance that has this speed."""
    parameters, time, joints = walk.setup.parameters, walk.frame_time, walk.frame_joints
    masses = inertia_of(LINKS, parameters)[:, 0]
    length, shown = parameters.link_length, (time >= BETWEEN[0]) & (time < BETWEEN[1])
    speed = fields.wave_speeds(time, joints, walk.frame_forces, length, masses.mean())[shown]
    way = fields.characteristic(time[shown], speed, 0, 0.0, length)
    bend = fields.curvatures(joints, length)[shown]
    across = fields.normal_velocities(time, joints, masses)[shown]
    rows = []
    for mode in MODES:
        cells: list[object] = [mode]
        for values, sign in ((bend, -1.0), (across, 1.0)):
            power = [fields.stacked_power(values, sign * ratio * way, (mode, mode)) for ratio in RATIOS]
            best = int(np.argmax(power))
            cells += [f"{sign * RATIOS[best]:.2f} c", power[best]]
        rows.append(cells)
    text = table("waves around the loop | slow, in curvature | part | fast, in velocity | part", rows, "d s .2f s .2f")
    stretching = length * np.sqrt(parameters.joint_stiffness / masses.mean())
    return minus(f"{text}\n\nc = {speed.mean():.2f} m/s; stretching waves run at {stretching:.0f} m/s.")


def main() -> None:
    """Write all tables and draw the figures."""
    tables, dispersion, modes = rings.tables_and_figure()
    write_rows(FOLDER / "results" / "rings.csv", modes)
    scene = {"links": LINKS, "frequency": FREQUENCY, "start": "spinning", "walk_limit": 0.35}
    walk = warpchain.walk(preset="soft", **scene, record_joint_forces=True, record_before=0.0, frame_interval=1e-4)
    show({"speeds": speeds_table(walk)})
    publish(FOLDER, tables, {"dispersion": dispersion})
    publish(FOLDER, {}, {"picture": waves_figure(walk, window=(0.0, 0.25))}, dpi=90)


if __name__ == "__main__":
    main()
