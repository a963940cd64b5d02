"""What the command line says of a sweep that is running, and how long a walk took."""

import json
import re
import time
from pathlib import Path

import h5py
import pytest
import yaml

from tests.run.test_sweep_run import TINY
from tests.support import synthetic_sweep
from tests.support.command_line import Command
from warpchain.run import progress_bar, sweep_run
from warpchain.run.estimate import estimate_sweep
from warpchain.run.single_walk import walk
from warpchain.store.sweep_result import load
from warpchain.sweeps.plan import load_sweep
from warpchain.walks import one_walk
from warpchain.walks.rows import row_type


def test_without_a_terminal_lines_of_progress_are_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    """Every so often a plain line says how many walks are over, how fast, and what is left; a short sweep has none."""
    (tmp_path / "tiny.yaml").write_text(yaml.safe_dump(TINY, sort_keys=False))
    for name, every in (("short", progress_bar.LINE_EVERY), ("long", 0.0)):
        monkeypatch.setattr(progress_bar, "LINE_EVERY", every)
        told = command("sweep", "tiny.yaml", "-o", name, "--workers", "1").err
        lines = [line for line in told.splitlines() if " of 80 walks" in line]
        assert bool(lines) == (every == 0.0)
    assert (
        lines[-1].startswith("[##########] 80 of 80 walks   ") and " a second   0 s left   80 time_limit" in lines[-1]
    )


def test_an_estimate_says_time_and_size(tmp_path: Path, command: Command) -> None:
    """A few walks are run, nothing is written; the size is that of what the sweep then writes, but for its headers."""
    recorded = TINY | {"samples": 40, "record": {"series": {"samples": [0]}}}
    (tmp_path / "tiny.yaml").write_text(yaml.safe_dump(recorded, sort_keys=False))
    before = set(tmp_path.iterdir())
    answer = command("sweep", "tiny.yaml", "--estimate", "--workers", "1")
    assert re.fullmatch(r"160 walks: about \S.* with 1 at once .*MB on disk \(16 walks tried\)\n", answer.out)
    assert set(tmp_path.iterdir()) == before
    found = estimate_sweep(recorded, workers=1)
    sweep_run.sweep(recorded, tmp_path / "all", workers=1)
    with h5py.File(tmp_path / "all/shards/000000.h5") as file:
        arrays: list[int] = []
        file["motion/0"].visititems(lambda name, item: arrays.append(getattr(item, "nbytes", 0)))
    rows = load(tmp_path / "all").walk_count * row_type(load_sweep(recorded).blocks[0].drawn).itemsize
    assert found.bytes == pytest.approx(rows + 4 * sum(arrays), rel=0.05)


def test_the_time_of_a_walk_is_without_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time spent on kernels is not in the wall time of a walk."""
    settings = {"links": 30, "start": "ellipse", "walk_limit": 0.01, "method": "dp5"}
    walk(preset="soft", **settings)
    monkeypatch.setattr(one_walk, "compile_kernels", lambda setups: time.sleep(1.0))
    began = time.perf_counter()
    result = walk(preset="soft", **settings)
    assert time.perf_counter() - began > 1.0
    assert 0 < result.wall_time < 0.8


def test_info_lists_a_thousand_cells_at_most(tmp_path: Path, command: Command) -> None:
    """The table of more cells ends with a line that counts the others; JSON has them all."""
    wide = synthetic_sweep.synthetic_sweep(
        {"name": "main", "grid": {"gravity": list(map(float, range(1, 1201)))}, "samples": 1}
    )
    synthetic_sweep.run(tmp_path, wide, shard_size=1200)
    lines = command("info", ".").out.splitlines()
    assert len(lines) == 1003 and lines[-1] == "… and 200 more cells, which --json lists"
    assert len(json.loads(command("info", ".", "--json").out)["blocks"]["main"]["dx"]["mean"]) == 1200
