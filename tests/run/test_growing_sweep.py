"""Sweeps that are given more samples in the folder that they are in, with walks that are simulated."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import yaml

from tests.run.test_sweep_run import TINY, data_of
from warpchain.run.sweep_run import sweep
from warpchain.store.sweep_result import SweepResult, load


def rows_of(result: SweepResult) -> dict[str, bytes]:
    """Name → bytes of all columns."""
    return {name: values.tobytes() for name, values in result.columns.items()}


def test_killed_while_it_grows_a_sweep_loses_nothing(tmp_path: Path) -> None:
    """SIGKILL while added walks are run: every shard stays, and a further run leaves the bytes of one never killed."""
    small, large = (TINY | {"samples": samples} for samples in (10, 30))
    whole, folder, source = tmp_path / "whole", tmp_path / "sweep", tmp_path / "large.yaml"
    for path in (whole, folder):
        sweep(small, path, workers=1)
        sorted((path / "shards").glob("[0-9]*.h5"))[3].unlink()  # growth does not wait for the walks before it
    begun = data_of(folder)
    sweep(large, whole, workers=1)
    expected = data_of(whole)
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
    assert data_of(folder) == expected
    assert (folder / "sweep.h5").read_bytes() == (whole / "sweep.h5").read_bytes()
    assert rows_of(load(folder)) == rows_of(sweep(large, tmp_path / "fresh", workers=1))
