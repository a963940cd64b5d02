"""Ctrl-C at any moment: exit status 130 and one line, or the whole result."""

import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from tests.run.test_sweep_run import TINY, data_of
from tests.support.command_line import Command, command  # noqa: F401
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
    command: Command,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
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


@pytest.mark.slow
def test_ctrl_c_at_any_moment_ends_a_sweep(tmp_path: Path) -> None:
    """At 8 random moments: 130, or the sweep is complete; nothing else is printed, and the rest gives equal bytes."""
    source, rng = tmp_path / "tiny.yaml", random.Random(3)
    source.write_text(yaml.safe_dump(TINY, sort_keys=False))
    sweep(source, tmp_path / "whole", workers=1)
    run = [sys.executable, "-m", "warpchain", "sweep", str(source), "-o"]
    began = time.monotonic()
    subprocess.run([*run, str(tmp_path / "timed")], capture_output=True, check=False)
    duration, interrupted = time.monotonic() - began, 0
    for number in range(8):
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
            assert is_complete or told in ("interrupted\n", "the same command goes on with the sweep\ninterrupted\n")
            assert told.endswith("interrupted\n") and told.count("\n") <= 2
            assert not is_complete or data_of(folder) == data_of(tmp_path / "whole")
            interrupted += 1
        else:
            assert process.returncode == 1 and told.startswith("80 time_limit")  # complete; no walk was to rest
            assert data_of(folder) == data_of(tmp_path / "whole")
    assert interrupted > 1
    for number in range(8):
        sweep(source, tmp_path / f"{number}", workers=1)
        assert data_of(tmp_path / f"{number}") == data_of(tmp_path / "whole")
