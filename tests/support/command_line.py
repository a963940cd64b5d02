"""The command line as tests run it."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from warpchain.cli.main import main
from warpchain.run.progress_bar import COMPILING


@dataclass(frozen=True)
class Answer:
    """What a command did; whether kernels were compiled depends on the cache, and that line is left out."""

    status: int
    out: str
    err: str

    def __post_init__(self) -> None:
        """Leave the line out."""
        object.__setattr__(self, "err", self.err.replace(f"{COMPILING}\n", ""))


Command = Callable[..., Answer]


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Command:
    """Runs `warpchain` in this process and in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> Answer:
        with pytest.raises(SystemExit) as end:
            main(arguments)
        out, err = capsys.readouterr()
        return Answer(end.value.code or 0, out, err)

    return run


def process(*arguments: str, folder: Path) -> Answer:
    """Runs `python -m warpchain` as a shell does, its output not a terminal."""
    done = subprocess.run(
        [sys.executable, "-m", "warpchain", *arguments], cwd=folder, capture_output=True, encoding="utf-8"
    )
    return Answer(done.returncode, done.stdout, done.stderr)
