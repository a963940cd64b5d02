"""Ctrl-C ends a command, also where a library makes an error of its own of the exception."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Final

INTERRUPTED: Final = 130
"""Exit status of a command that Ctrl-C ended."""


@contextlib.contextmanager
def interrupts_heard() -> Iterator[Callable[[], bool]]:
    """Yield a function that tells whether there was an interrupt; others than Python's own handler stay in charge."""
    heard = threading.Event()
    usual = signal.getsignal(signal.SIGINT)

    def handle(number: int, frame: FrameType | None) -> None:
        heard.set()
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread() or usual is not signal.default_int_handler:
        yield heard.is_set
        return
    signal.signal(signal.SIGINT, handle)
    try:
        yield heard.is_set
    finally:
        signal.signal(signal.SIGINT, usual)


def ignore_interrupts() -> None:
    """Let nothing interrupt the end of this process, whose work is done."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
