"""Ends a command by Ctrl-C at any moment, also where Python would lose the exception.

Python drops a KeyboardInterrupt that is raised in a callback of its own, such as that of a weak reference or a
`__del__`: it prints "Exception ignored in" and goes on. Libraries may also turn it into an error of theirs.
"""

import _thread
import contextlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Final

INTERRUPTED: Final = 130
"""Exit status of a command that Ctrl-C ended."""


@contextlib.contextmanager
def interrupts_heard() -> Iterator[Callable[[], bool]]:
    """Raise `KeyboardInterrupt` until it is not lost; yield a function that tells whether there was an interrupt.

    Outside of the main thread, and where somebody else handles or ignores the signal, nothing is changed.
    """
    usual_handler, usual_hook = signal.getsignal(signal.SIGINT), sys.unraisablehook
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or usual_handler is not signal.default_int_handler:
        yield lambda: False
        return
    heard = False

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal heard
        heard = True
        raise KeyboardInterrupt

    def hook(lost: "sys.UnraisableHookArgs", /) -> None:
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            usual_hook(lost)
            return
        again = threading.Timer(0.05, _thread.interrupt_main)  # not in here, where it would be lost again
        again.daemon = True
        again.start()

    sys.unraisablehook = hook
    signal.signal(signal.SIGINT, handle)
    try:
        yield lambda: heard
    finally:
        signal.signal(signal.SIGINT, usual_handler)
        sys.unraisablehook = usual_hook


def ignore_interrupts() -> None:
    """Let nothing interrupt the end of this process, whose work is done."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
