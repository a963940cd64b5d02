"""A worker process ends with the process that started it, however that dies."""

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from typing import Final

LOOK: Final = 1.0
"""Time [s] between two looks at the parent's number, beside waiting for its end."""
ORPHANED: Final = 1
"""Exit status of a worker without a parent."""


def end_with_parent() -> None:
    """End this worker at once when the process that started it ends, by a kill too; and leave Ctrl-C to that process.

    Called in a process that `multiprocessing` spawned, before its first task. A thread does it, because launches and
    the compilation of kernels run outside of Python's lock. Linux could send a signal instead (PR_SET_PDEATHSIG), but
    it does so when the thread ends that started the worker, which may be long before the process.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all processes; the parent ends the workers
    threading.Thread(target=_watch, args=(), name="parent watch", daemon=True).start()


def _watch() -> None:
    """Wait for the end of the parent, then end this process."""
    parent = multiprocessing.parent_process()
    if parent is None:
        raise RuntimeError("this process is no worker that multiprocessing started")
    # The sentinel is a pipe whose other end the parent holds, and so does a process that was forked from it. So the
    # number of the parent is asked as well: it changes when the parent ends.
    while os.getppid() == parent.pid and not multiprocessing.connection.wait([parent.sentinel], LOOK):
        pass
    os._exit(ORPHANED)
