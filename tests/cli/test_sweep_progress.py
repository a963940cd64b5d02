"""What the command line says of a sweep that is running, and how long a walk took."""

import json
import time
from pathlib import Path

import pytest
import yaml

from tests.run.test_sweep_run import TINY
from tests.support import synthetic_sweep
from tests.support.command_line import Command
from warpchain.results import one_walk
from warpchain.run import progress_bar
from warpchain.run.single_walk import walk


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
        lines[-1].startswith("[##########] 80 of 80 walks   ")
        and " a second   0:00:00 left   80 time_limit" in lines[-1]
    )


def test_the_time_of_a_walk_is_without_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time spent on kernels is not in the wall time of a walk."""
    settings = {"links": 30, "start": "ellipse", "walk_limit": 0.01, "method": "dp5"}
    walk(preset="soft", **settings)
    monkeypatch.setattr(one_walk, "compile_kernels", lambda setups, on_compile: time.sleep(1.0))
    began = time.perf_counter()
    result = walk(preset="soft", **settings)
    assert time.perf_counter() - began > 1.0
    assert 0 < result.wall_time < 0.8


def test_info_lists_a_thousand_cells_at_most(tmp_path: Path, command: Command) -> None:
    """The table of more cells ends with a line that counts the others; JSON has them all."""
    wide = synthetic_sweep.synthetic_sweep(
        {"name": "main", "grid": {"walk_limit": list(map(float, range(1, 1201)))}, "samples": 1}
    )
    synthetic_sweep.run(tmp_path, wide, shard_size=1200)
    lines = command("info", ".").out.splitlines()
    assert len(lines) == 1003 and lines[-1] == "… and 200 more cells, which --json lists"
    assert len(json.loads(command("info", ".", "--json").out)["blocks"]["main"]["dx"]["mean"]) == 1200
