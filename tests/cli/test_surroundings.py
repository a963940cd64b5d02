"""Commands whose surroundings are not as usual: closed outputs, no place for kernels, no working directory."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WALK = "walk --links 20 --preset soft --start ellipse --method dp5 --set walk_limit=0.02 --json"


def shell(line: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """What a shell answers to `warpchain` followed by this line."""
    return subprocess.run(
        ["sh", "-c", f"{sys.executable} -m warpchain {line}"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
        capture_output=True,
        text=True,
    )


def test_commands_work_with_stderr_closed(tmp_path: Path) -> None:
    """`2>&-` loses what would stand on stderr and nothing else: not the answer, not the status, no file."""
    assert shell("--version 2>&-", tmp_path).returncode == 0
    refused = shell("walk --links 3 2>&-", tmp_path)
    assert (refused.returncode, refused.stdout, refused.stderr) == (2, "", "")
    walked = shell(f"{WALK} -o out 2>&-", tmp_path)
    assert walked.returncode == 1 and json.loads(walked.stdout)["status"] == "time_limit"
    assert shell("plot out/walk.h5 --kind energy 2>&-", tmp_path).returncode == 0
    assert shell(f"{WALK} >&- 2>&-", tmp_path).returncode == 1


def test_a_reader_that_leaves_takes_no_file(tmp_path: Path) -> None:
    """`walk -o DIR | head` writes the record and the film strip, too."""
    shell(f"{WALK} -o out | true", tmp_path, PYTHONUNBUFFERED="1")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"walk.h5", "film_strip.png"}


@pytest.mark.parametrize("inside", ["", "/folder"])
def test_a_kernel_cache_that_cannot_be_used_is_named(tmp_path: Path, inside: str) -> None:
    """Where `WARP_CACHE_PATH` is a file, or below one, one line says so and what to do."""
    Path(tmp_path, "file").touch()
    answer = shell(WALK, tmp_path, WARP_CACHE_PATH=f"{tmp_path}/file{inside}")
    assert answer.returncode == 2
    assert answer.stderr.startswith(f"error: WARP_CACHE_PATH: {tmp_path}/file") and answer.stderr.count("\n") == 1
    assert "name a folder for kernels that can be written to" in answer.stderr
