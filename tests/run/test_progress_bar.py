"""Lines of progress, as threads say them and terminals of any width show them."""

import fcntl
import io
import os
import struct
import sys
import termios
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from warpchain.run.progress_bar import changing_line


def test_threads_tell_a_line_once_and_whole(monkeypatch):
    """Of many threads that say the same at once, one is heard, and no other text breaks its line."""

    class Slow(io.StringIO):
        def write(self, text):
            time.sleep(0.001)  # another thread goes on here
            return super().write(text)

    pipe = Slow()
    monkeypatch.setattr(sys, "stderr", pipe)
    with changing_line() as show, ThreadPoolExecutor(8) as threads:
        list(threads.map(lambda number: show(f"line {number % 2}", True), range(16)))
    assert sorted(pipe.getvalue().splitlines()) == ["line 0", "line 1"]


@pytest.mark.parametrize("columns", [40, 80, 200])
def test_a_line_fits_into_its_terminal(columns, monkeypatch):
    """The width is that of the terminal of standard error; standard output may be a pipe, or another terminal."""
    terminal, other = os.openpty()
    fcntl.ioctl(other, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    with open(other, "w") as screen, open(terminal, "rb", buffering=0) as seen:
        monkeypatch.setattr(sys, "stderr", screen)
        with changing_line() as show:
            show("compiling " * 30)
        shown = b""
        while not shown.endswith(b"\n"):  # a terminal hands on what it has, maybe in parts
            shown += seen.read(4096)
        assert shown == b"\r" + (b"compiling " * 30)[: columns - 1] + b"\r\n"
