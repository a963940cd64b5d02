"""Makes the two films of a hidden chain that come with the study: do not read on if you want to find it yourself.

The errors of the camera are drawn once for both films. Tables are written as Tracker exports them, in mm.
"""

from pathlib import Path

import numpy as np

import warpchain
from studies.common import run_study
from warpchain import films

FOLDER = Path(__file__).parent / "hidden"
CHAIN = {
    "floor_friction": 0.231,
    "viscous_friction": 1.06e-4,
    "coulomb_friction": 9.4e-5,
    "sprocket_radius": 0.0569,
    "circle_radius": 4.05e-3,
    "floor_restitution": 0.04,
}


def main() -> None:
    """Walk, film and write."""
    camera, random = films.Camera(), np.random.default_rng(34)
    errors = camera.errors(random)
    for frequency in (5.0, 20.0):
        scene = {"links": 60, "frequency": frequency, "start": "spinning", "walk_limit": 0.45, "phase": 0.3}
        walk = warpchain.walk(preset="soft", **scene, **CHAIN)
        film = films.film_of(walk, None).seen(camera, errors, random)
        delay, mm = 0.35 + random.uniform(0, 0.1), 1e3
        places = zip(film.time + delay, *(mm * film.center.T), strict=True)
        rows = (f"{t:.6E}\t{x:.4E}\t{y:.4E}\t" for t, x, y in places)
        text = "\n".join(["cm_A", "t\tx\ty\t", *rows, ""])
        (FOLDER / f"60_links_{frequency:g}_Hz.txt").write_text(text, encoding="utf-8")
        edges = ", ".join(f"{mm * edge:.1f}" for edge in film.outline)
        print(f"{frequency:g} Hz: outline {edges} mm, speed {film.speed:.3f} m/s")


if __name__ == "__main__":
    run_study(main)
