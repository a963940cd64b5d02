"""Ctrl-C at any moment: exit status 130 and one line, or the whole result."""

import io
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from tests.run.test_sweep_run import TINY, data_of
from tests.support.command_line import Command
from warpchain.cli.main import main
from warpchain.run.sweep_run import sweep

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="other signals")


@pytest.fixture(autouse=True)
def heard_signal() -> Iterator[None]:
    """Ctrl-C is heard as in a terminal, also where the tests run as a background job, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_error_that_a_library_makes_of_an_interrupt_is_one(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HDF5 calls a read that Ctrl-C breaks off a damaged file; the command says that it was interrupted."""

    def broken_off(*_: object, **__: object) -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise OSError("cannot read") from None

    monkeypatch.setattr(sys.modules[main.__module__], "app", broken_off)
    answer = command("info", "anything")
    assert (answer.status, answer.err) == (130, "interrupted\n")


class Screen(io.StringIO):
    """A terminal whose user presses Ctrl-C once a walk has gone on for a tenth of a second."""

    is_pressed = False

    def isatty(self) -> bool:
        """Yes."""
        return True

    def write(self, text: str) -> int:
        """Show a text."""
        if not self.is_pressed and re.search(r"walk +0\.[1-9].* m/s.* steps", text):
            self.is_pressed = True
            signal.raise_signal(signal.SIGINT)
        return super().write(text)


def test_terminal_shows_progress_and_ctrl_c_ends_it(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a terminal progress is shown; Ctrl-C ends the walk with status 130 and one line, nothing written."""
    screen = Screen()
    monkeypatch.setattr(sys, "stderr", screen)
    answer = command(*"walk --links 32 --preset soft --start ellipse --set rest_time=100 -o new".split())
    assert (answer.status, answer.out, screen.is_pressed) == (130, "", True)
    assert screen.getvalue().endswith("interrupted\n") and "Traceback" not in screen.getvalue()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_ctrl_c_at_any_moment_ends_a_sweep(tmp_path: Path) -> None:
    """At 5 random moments: 130, or the sweep is complete; nothing else is printed, and the rest gives equal bytes."""
    source, rng = tmp_path / "tiny.yaml", random.Random(3)
    source.write_text(yaml.safe_dump(TINY, sort_keys=False))
    sweep(source, tmp_path / "whole", workers=1)
    run = [sys.executable, "-m", "warpchain", "sweep", str(source), "-o"]
    began = time.monotonic()
    subprocess.run([*run, str(tmp_path / "timed")], capture_output=True, check=False)
    duration, interrupted = time.monotonic() - began, 0
    for number in range(5):
        folder = tmp_path / f"{number}"
        process = subprocess.Popen(
            [*run, str(folder)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            # A shell may have set it to be ignored in its background jobs, which children inherit.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        time.sleep(rng.uniform(0.3, duration))  # not while Python itself starts
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=30)
        # −2, which a shell shows as 130: Python ends itself so if an import was interrupted
        if process.returncode in (130, -signal.SIGINT):
            is_complete = told.startswith("80 time_limit")  # while its table was printed
            assert is_complete or told in ("interrupted\n", "rerun the same command to resume the sweep\ninterrupted\n")
            assert told.endswith("interrupted\n") and told.count("\n") <= 2
            assert not is_complete or data_of(folder) == data_of(tmp_path / "whole")
            interrupted += 1
        else:
            assert process.returncode == 1 and told.startswith("80 time_limit")  # complete; no walk was to rest
            assert data_of(folder) == data_of(tmp_path / "whole")
    assert interrupted > 1
    for number in range(5):
        sweep(source, tmp_path / f"{number}", workers=1)
        assert data_of(tmp_path / f"{number}") == data_of(tmp_path / "whole")
