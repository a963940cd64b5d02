"""Sweeps that are given more samples in the folder that they are in, with walks that are simulated."""

import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.run.test_sweep_run import TINY, data_of
from tests.support.made_walks import assert_same
from warpchain.cli.main import main
from warpchain.run.sweep_run import sweep
from warpchain.store.sweep_result import SweepResult, load

KEPT: dict[str, Any] = TINY | {
    "scene": {"start": "spinning", "walk_limit": 0.01, "further_hold": 0.1, "frequency": 12.0},
    "options": {},
    "grid": {"links": [30, 40]},
    "record": {"series": True, "frames": {"samples": [0], "before": 0.05}},
}


def rows_of(result: SweepResult) -> dict[str, bytes]:
    """Name → bytes of all columns."""
    return {name: values.tobytes() for name, values in result.columns.items()}


def test_a_grown_sweep_has_the_walks_of_the_larger_one(tmp_path: Path) -> None:
    """Grown from 2 to 4 samples, rows and motions are those of 4 samples run at once, to the bit."""
    small, large = (KEPT | {"samples": samples} for samples in (2, 4))
    begun = sweep(small, tmp_path / "grown", workers=1)
    before = data_of(tmp_path / "grown")
    seen = []
    grown = sweep(large, tmp_path / "grown", workers=1, on_progress=lambda p: seen.append((p.before, p.done, p.walks)))
    assert seen[0] == (4, 4, 8) and seen[-1] == (4, 8, 8) and begun.index.tolist() == [[0, 2], [1, 3]]
    assert before.items() < data_of(tmp_path / "grown").items()
    fresh = sweep(large, tmp_path / "fresh", workers=2)
    assert grown.index.tolist() == [[0, 2, 4, 6], [1, 3, 5, 7]]
    assert rows_of(grown) == rows_of(fresh)
    np.testing.assert_array_equal(begun.loss_joint_friction, grown.loss_joint_friction[:, :2])
    for links, sample in np.ndindex(2, 4):
        one, other = (result.series(links=KEPT["grid"]["links"][links], sample=sample) for result in (grown, fresh))
        assert_same(one, other)
        assert len(one.time) > 5 and (one.before_release is None) == (sample != 0)
    for command in (["info"], ["report"]):
        with pytest.raises(SystemExit) as done:
            main([*command, str(tmp_path / "grown")])
        assert done.value.code in (None, 0)


def test_killed_while_it_grows_a_sweep_loses_nothing(tmp_path: Path) -> None:
    """SIGKILL while added walks are run: every shard stays, and a further run leaves the bytes of one never killed."""
    small, large = (TINY | {"samples": samples} for samples in (10, 30))
    for given in (small, large):
        sweep(given, tmp_path / "whole", workers=1)
    expected, folder, source = data_of(tmp_path / "whole"), tmp_path / "sweep", tmp_path / "large.yaml"
    sweep(small, folder, workers=1)
    begun = data_of(folder)
    sorted((folder / "shards").glob("[0-9]*.h5"))[3].unlink()  # growth does not wait for the walks before it
    source.write_text(yaml.safe_dump(large, sort_keys=False))
    command = [sys.executable, "-m", "warpchain", "sweep", str(source), "-o", str(folder), "--workers", "1"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 300
    while len(data_of(folder)) < len(begun) + 3 and process.poll() is None:
        assert time.monotonic() < until, "the sweep does not begin"
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    left = data_of(folder)
    assert begun.items() < left.items() and left.items() < expected.items()
    assert load(folder).missing_count > 0
    sweep(large, folder, workers=1)
    assert (
        data_of(folder) == expected
        and (folder / "sweep.json").read_bytes() == (tmp_path / "whole/sweep.json").read_bytes()
    )
    assert rows_of(load(folder)) == rows_of(sweep(large, tmp_path / "fresh", workers=1))
