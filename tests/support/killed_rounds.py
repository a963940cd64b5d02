"""Kills a sweep that runs until its errors are reached, again and again, and compares its files with those of one run.

``python -m tests.support.killed_rounds DIR [KILLS]`` runs real walks: it takes some minutes. The suite has smaller
tests of the same in tests/store/test_rounds.py.
"""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import yaml

from tests.support.synthetic_sweep import content
from warpchain.results.sweep_result import load

SWEEP = {
    "version": 1,
    "name": "killed",
    "seed": 1,
    "preset": "paper",
    "samples": 4,
    "until": {"dx": "0.5 %", "walk_time": "3 ms"},
    "at_most": 256,
    "scene": {"start": "ellipse"},
    "grid": {"links": [20, 30], "frequency": [5, 15]},
}


def main(folder: Path, kills: int) -> None:
    """Run, kill, go on, compare."""
    folder.mkdir(parents=True)
    (folder / "sweep.yaml").write_text(yaml.safe_dump(SWEEP))
    command = [sys.executable, "-m", "warpchain", "sweep", str(folder / "sweep.yaml"), "-o"]
    rng, killed, states = random.Random(20180601), 0, set()
    while killed < kills:
        run = subprocess.Popen([*command, folder / "killed"], stdout=subprocess.DEVNULL, start_new_session=True)
        before = len(list((folder / "killed").glob("shards/*.h5")))
        while run.poll() is None and len(list((folder / "killed").glob("shards/*.h5"))) <= before + rng.randint(0, 3):
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, 0.2))
        os.killpg(run.pid, signal.SIGKILL)
        if run.wait() != -signal.SIGKILL:
            raise RuntimeError("the sweep was over before its last kill; ask for smaller errors")
        killed += 1
        states.add(tuple(load(folder / "killed").is_there.sum(axis=-1).ravel().tolist()))
    for name, workers in (("killed", "2"), ("whole", "1")):
        subprocess.run([*command, folder / name, "--workers", workers], stdout=subprocess.DEVNULL, check=True)
    walks = load(folder / "whole").is_there.sum(axis=-1).ravel().tolist()
    same = content(folder / "killed") == content(folder / "whole")
    print(f"{killed} kills, {len(states)} states, walks of the cells {walks}: {'the same bytes' if same else 'OTHER'}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 30)
