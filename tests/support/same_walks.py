"""Walks of all methods and starts, kept by one checkout and compared to the bit with those of another.

    python -m tests.support.same_walks before.npz      # in the checkout before a change, and after.npz behind it
    python -m tests.support.same_walks before.npz after.npz
    python -m tests.support.same_walks --golden    # writes golden_bits.json, after NUMERICS_VERSION was raised

It takes public names only, two to three minutes of one core, and as long again where kernels must be compiled.
`tests/walks/test_golden_bits.py` compares the digests of `BRIEF` walks with those of golden_bits.json.
"""

import hashlib
import json
import platform
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import warpchain
from warpchain.version import NUMERICS_VERSION

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


def values_of(walk: warpchain.WalkResult) -> dict[str, np.ndarray]:
    """Every number and array of a walk but the wall time."""
    kept = {}
    for key, value in {**vars(walk), "status": int(walk.status)}.items():
        for part, number in value.items() if isinstance(value, dict) else ((None, value),):
            if key != "wall_time" and isinstance(number, int | float | np.ndarray):
                kept[f"{key}{part or ''}"] = np.asarray(number)
    return kept


def keep(path: str) -> None:
    """Let all chains walk, and keep their values."""
    kept = {}
    for name, keywords in cases():
        walk = warpchain.walk(**keywords)
        print(name, walk.status.label, walk.dx, flush=True)
        kept |= {f"{name}/{key}": value for key, value in values_of(walk).items()}
    np.savez(path, **kept)


GOLDEN = Path(__file__).parents[1] / "walks/golden_bits.json"
"""Digests of brief walks, and what they hold for."""
BRIEF = ("36-spinning", "60-ellipse", "tilting-36", "seed-36", "seed-60", "standard-60-spinning")
"""How the names of the walks end that have golden bits."""


def golden_walks() -> dict[str, dict[str, Any]]:
    """Keywords of the walks that have golden bits: from the drive to a tenth of a second after the release."""
    return {name: {**keywords, "walk_limit": 0.1} for name, keywords in cases() if name.endswith(BRIEF)}


def bits_of(values: dict[str, np.ndarray], names: Iterable[str]) -> str:
    """Digest of a walk's values of these names, to the bit; a number that is new changes no digest."""
    digest = hashlib.sha256()
    for name in sorted(values.keys() & names):
        digest.update(f"{name} {values[name].dtype.str} {values[name].shape} ".encode() + values[name].tobytes())
    return digest.hexdigest()[:16]


def processor() -> str:
    """What the bits of a build depend on: the machine and its vector instructions."""
    flags = Path("/proc/cpuinfo").read_text().split() if Path("/proc/cpuinfo").exists() else []
    return " ".join([platform.machine(), *(name for name in ("avx2", "fma", "avx512f", "avx512vl") if name in flags)])


def write_golden() -> None:
    """Make the golden bits anew."""
    found = {name: values_of(warpchain.walk(**keywords)) for name, keywords in golden_walks().items()}
    names = sorted(set().union(*found.values()))
    walks = {name: bits_of(values, names) for name, values in found.items()}
    content = {"numerics_version": NUMERICS_VERSION, "processor": processor(), "values": names, "walks": walks}
    GOLDEN.write_text(json.dumps(content, indent=1) + "\n")


def compare(before: str, after: str) -> int:
    """Print what differs, and how many values both have; how many differ."""
    with np.load(before) as ours, np.load(after) as theirs:
        both = sorted({*ours} & {*theirs})
        differ = [key for key in both if ours[key].tobytes() != theirs[key].tobytes()]
    print(*differ, f"{len(differ)} of {len(both)} values differ", sep="\n")
    return len(differ)


if __name__ == "__main__":
    if sys.argv[1:] == ["--golden"]:
        write_golden()
    elif len(sys.argv) == 3:
        sys.exit(bool(compare(*sys.argv[1:])))
    else:
        keep(sys.argv[1])
