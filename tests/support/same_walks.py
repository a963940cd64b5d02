"""Walks of all methods and starts, kept by one checkout and compared to the bit with those of another.

    python -m tests.support.same_walks before.npz      # in the checkout before a change, and after.npz behind it
    python -m tests.support.same_walks before.npz after.npz

It takes public names only, two to three minutes of one core, and as long again where kernels must be compiled.
"""

import sys
from collections.abc import Iterator
from typing import Any

import numpy as np

import warpchain

SCENES = (
    (36, 20.0, "spinning"),
    (60, 15.0, "spinning"),
    (60, 8.0, "ellipse"),
    (84, 20.0, "rest"),
    (150, 25.0, "ellipse"),
)
METHODS = {
    **dict.fromkeys(("standard", "hybrid"), "paper"),
    **dict.fromkeys(("explicit", "dp5", "os32", "rkf78", "bs32", "reference"), "soft"),
}
"""Method → preset."""
LONG = ("rkf78", "bs32", "reference")
"""Methods that take too long for long chains and for chains from rest."""


def cases() -> Iterator[tuple[str, dict[str, Any]]]:
    """Name and keywords of every walk."""
    for method, preset in METHODS.items():
        for links, frequency, start in SCENES:
            if method not in LONG or (links <= 60 and start != "rest"):
                scene = {"links": links, "frequency": frequency, "start": start}
                yield f"{method}-{links}-{start}", {"method": method, "preset": preset, **scene}
    for links in (36, 60):
        scene = {"links": links, "frequency": 15.0, "start": "spinning"}
        yield f"tilting-{links}", {"preset": "soft", "plane": "tilting", "tilt": 0.1, **scene}
        yield f"seed-{links}", {"seed": 3, **scene}


def keep(path: str) -> None:
    """Let all chains walk, and keep every number and array of their results but the wall time."""
    kept = {}
    for name, keywords in cases():
        walk = warpchain.walk(**keywords)
        print(name, walk.status.label, walk.dx, flush=True)
        values = {**vars(walk), "status": int(walk.status)}
        for key, value in values.items():
            for part, number in value.items() if isinstance(value, dict) else ((None, value),):
                if key != "wall_time" and isinstance(number, int | float | np.ndarray):
                    kept[f"{name}/{key}{part or ''}"] = np.asarray(number)
    np.savez(path, **kept)


def compare(before: str, after: str) -> int:
    """Print what differs, and how many values both have; how many differ."""
    with np.load(before) as ours, np.load(after) as theirs:
        both = sorted({*ours} & {*theirs})
        differ = [key for key in both if ours[key].tobytes() != theirs[key].tobytes()]
    print(*differ, f"{len(differ)} of {len(both)} values differ", sep="\n")
    return len(differ)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        sys.exit(bool(compare(*sys.argv[1:])))
    keep(sys.argv[1])
