"""A tap of the running chain on its sprocket: the bottom of the loop touches the floor for some milliseconds.

The sprocket dips by 8 mm and comes back (`release`), 5 mm above a floor, and once more far above it. The difference of
both is the tap's alone. Places are counted along the loop from its lowest point, positive with the motion of the links.
"""

import numpy as np

import warpchain
from studies.common import table
from studies.waves.fields import curvatures, in_room, joints_below, normal_velocities
from studies.waves.wave_drag import inertia_of

LINKS = 120
TOUCHING = 1e-4  # Height of the lowest circle above the floor that it touches, at most [m]
LATER = np.arange(0.012, 0.027, 0.001)  # Times after the first touch [s]: after the tap, before the sprocket is reached
SPAN = 7  # So many of these times next to one another give a speed


def dipping(frequency: float, clearance: float) -> warpchain.WalkResult:
    """A loop of `LINKS` on a sprocket that dips by 8 mm within 0.06 s and stays for 0.12 s more."""
    shares = np.linspace(0, 1, 13)[1:]
    dip = [[0.05 + 0.06 * s, 0, -0.008 * np.sin(np.pi * s) ** 2, frequency] for s in shares.tolist()]
    scene = {"links": LINKS, "frequency": frequency, "start": "spinning", "further_hold": 4, "clearance": clearance}
    release = [[0.05, 0, 0, frequency], *dip, [0.22, 0, 0, frequency]]
    return warpchain.walk(preset="soft", **scene, release=release, walk_until=0.2, frame_interval=2.5e-4)


def found(frequency: float) -> list[str]:
    """A row of the table: where and how fast is what the tap leaves, least and greatest over the time after it."""
    plain, tapped = dipping(frequency, 0.5), dipping(frequency, 0.005)
    parameters, time = plain.setup.parameters, plain.frame_time
    length, masses = parameters.link_length, inertia_of(LINKS, parameters)[:, 0]
    below = joints_below(plain.frame_joints, masses)
    run = abs(np.polyfit(time, below, 1)[0]) * length
    bend, across = (
        in_room(field(tapped) - field(plain), below, LINKS)
        for field in (
            lambda walk: curvatures(walk.frame_joints, length),
            lambda walk: normal_velocities(time, walk.frame_joints, masses),
        )
    )
    place = (np.arange(LINKS) + 0.5 - LINKS / 2) * length
    first = time[np.argmax(np.abs(bend).max(axis=1) > 0.5)]
    slow, fast, behind = [], [], []
    for later in LATER:
        i = int(np.argmin(np.abs(time - first - later)))
        near, ahead = bend[i] ** 2 * (np.abs(place) < 0.3), across[i] ** 2 * ((place > 0.1) & (place < 0.58))
        slow.append(np.sum(near * place) / near.sum())
        fast.append(np.interp(0.95, np.cumsum(ahead) / ahead.sum(), place))
        behind.append(np.sum(across[i] ** 2 * ((place < -0.1) & (place > -0.58))) / ahead.sum())
    speeds = [np.polyfit(LATER[k : k + SPAN], fast[k : k + SPAN], 1)[0] for k in range(len(LATER) - SPAN + 1)]
    low, high = min(speeds), max(speeds)
    touched = tapped.time[(tapped.lowest < TOUCHING) & (tapped.time < first + LATER[0])]
    return [
        f"{frequency:g} Hz",
        f"{run:.2f}",
        f"{1000 * np.ptp(touched):.0f}",
        f"{100 * min(slow):.1f} to {100 * max(slow):.1f}",
        f"{low:.1f} to {high:.1f} m/s, {low / run:.2f} to {high / run:.2f} v",
        f"{100 * np.mean(behind):.0f} %",
    ]


def main() -> None:
    """Print the table."""
    head = ("", "v / (m/s)", "touch / ms", "slow: place / cm", "fast: front", "energy across, on the other side")
    print(table(head, map(found, (15.0, 20.0, 25.0))))


if __name__ == "__main__":
    main()
