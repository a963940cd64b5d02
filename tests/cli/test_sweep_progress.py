"""What the command line says of a sweep that is running, and how long a walk took."""

import json
import os
import re
import time
from pathlib import Path

import h5py
import pytest
import yaml

from tests.run.test_sweep_run import TINY
from tests.support import synthetic_sweep
from tests.support.synthetic_sweep import SWEEP, synthetic_rows, write
from warpchain.cli.main import main
from warpchain.engine.batch import Batch
from warpchain.run import progress_bar, sweep_run
from warpchain.run.estimate import estimate_sweep
from warpchain.run.single_walk import walk
from warpchain.store.folder import SweepFolder
from warpchain.store.sweep_result import load
from warpchain.sweeps.plan import load_sweep
from warpchain.walks.rows import row_type


def run(*arguments: str) -> None:
    """Play a command; it succeeds."""
    with pytest.raises(SystemExit) as done:
        main(list(arguments))
    assert done.value.code in (None, 0)


def test_without_a_terminal_lines_of_progress_are_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every so often a plain line says how many walks are over, how fast, and what is left; a short sweep has none."""
    (tmp_path / "tiny.yaml").write_text(yaml.safe_dump(TINY, sort_keys=False))
    for name, every in (("short", progress_bar.LINE_EVERY), ("long", 0.0)):
        monkeypatch.setattr(progress_bar, "LINE_EVERY", every)
        with pytest.raises(SystemExit):
            main(["sweep", str(tmp_path / "tiny.yaml"), "-o", str(tmp_path / name), "--workers", "1"])
        lines = [line for line in capsys.readouterr().err.splitlines() if " of 80 walks" in line]
        assert bool(lines) == (every == 0.0)
    assert lines[-1].startswith("80 of 80 walks   ") and " a second   0 s left   80 time_limit" in lines[-1]


def test_an_estimate_says_time_and_size(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A few walks are run, nothing is written; the size is that of what the sweep then writes, but for its headers."""
    recorded = TINY | {"samples": 40, "record": {"series": {"samples": [0]}}}
    (tmp_path / "tiny.yaml").write_text(yaml.safe_dump(recorded, sort_keys=False))
    before = set(tmp_path.iterdir())
    run("sweep", str(tmp_path / "tiny.yaml"), "--estimate", "--workers", "1")
    assert re.fullmatch(
        r"160 walks: about \S.* with 1 at once .*MB on disk \(16 walks tried\)\n", capsys.readouterr().out
    )
    assert set(tmp_path.iterdir()) == before
    found = estimate_sweep(recorded, workers=1)
    sweep_run.sweep(recorded, tmp_path / "all", workers=1)
    with h5py.File(tmp_path / "all/shards/0-000000-motion.h5") as file:
        arrays: list[int] = []
        file["0"].visititems(lambda name, item: arrays.append(getattr(item, "nbytes", 0)))
    rows = load(tmp_path / "all").walk_count * row_type(load_sweep(recorded).blocks[0].drawn).itemsize
    assert found.bytes == pytest.approx(rows + 4 * sum(arrays), rel=0.05)


def test_info_tells_rate_and_time_left_of_a_running_sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Counted are the shards written since the run began; a sweep that nobody runs has no rate."""
    with SweepFolder.open(tmp_path, SWEEP, shard_size=20) as opened:
        first, second, third, *_ = opened.missing()
        for shard in (first, second, third):
            write(opened, shard, synthetic_rows(SWEEP, shard))
        now = time.time()
        os.utime(tmp_path / "lock", (now - 10, now - 10))
        os.utime(opened.directory / "shards/0-000000.h5", (now - 60, now - 60))  # of an earlier run
        run("info", str(tmp_path))
        assert "running: 4.0" in (text := capsys.readouterr().out) or "running: 3.9" in text
        assert "walks a second, 25 s left" in text or "26 s left" in text
        run("info", str(tmp_path), "--json")
        found = json.loads(capsys.readouterr().out)
        assert 3.0 < found["rate"] <= 4.0 and found["time_left"] == pytest.approx(100 / found["rate"])
    run("info", str(tmp_path))
    assert "running" not in capsys.readouterr().out
    run("info", str(tmp_path), "--json")
    found = json.loads(capsys.readouterr().out)
    assert found["rate"] is None and found["time_left"] is None


def test_the_time_of_a_walk_is_without_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Time spent on kernels is not in the wall time of a walk."""
    compiled, settings = Batch.compile, {"links": 30, "start": "ellipse", "walk_limit": 0.01, "method": "dp5"}
    walk(preset="soft", **settings)

    def slowly(*arguments: object) -> None:
        time.sleep(3.0)
        compiled(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Batch, "compile", slowly)
    began = time.perf_counter()
    result = walk(preset="soft", **settings)
    assert time.perf_counter() - began > 3.0
    assert 0 < result.wall_time < 2.5


def test_info_lists_a_thousand_cells_at_most(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The table of more cells ends with a line that counts the others; JSON has them all."""
    wide = synthetic_sweep.synthetic_sweep(
        {"name": "main", "grid": {"gravity": list(map(float, range(1, 1201)))}, "samples": 1}
    )
    synthetic_sweep.run(tmp_path, wide, shard_size=1200)
    run("info", str(tmp_path))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1003 and lines[-1] == "… and 200 more cells, which --json lists"
    run("info", str(tmp_path), "--json")
    assert len(json.loads(capsys.readouterr().out)["blocks"]["main"]["dx"]["mean"]) == 1200
