"""Several GPUs of this host: one worker process for each, as an executor of a sweep."""

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.queues import SimpleQueue
from typing import Final

LOOK: Final = 1.0
"""Time [s] between two looks at the parent's number."""
ORPHANED: Final = 1
"""Exit status of a worker without a parent."""


@contextlib.contextmanager
def gpu_workers(count: int) -> Iterator[ProcessPoolExecutor]:
    """Worker processes, each of which sees only one of the first GPUs and runs a sweep with the device ``cuda``.

    GPUs are in the order of CUDA_VISIBLE_DEVICES if that is set. An exception, such as that of Ctrl-C, ends the
    processes at once, for a task may take minutes; the shards that they have written are whole.
    """
    context = multiprocessing.get_context("spawn")  # CUDA does not survive a fork
    free = context.SimpleQueue()
    listed = os.environ.get("CUDA_VISIBLE_DEVICES") or ",".join(map(str, range(count)))
    for gpu in listed.split(",")[:count]:
        free.put(gpu.strip())
    with ProcessPoolExecutor(count, context, _take_gpu, (free, os.getpid())) as executor:
        try:
            yield executor
        except BaseException:
            for process in list((executor._processes or {}).values()):  # public from Python 3.14 on
                process.terminate()
            raise


def _take_gpu(free: "SimpleQueue[str]", parent: int) -> None:
    """Let this process see only one GPU, before Warp starts, and end when the process ends that started it.

    A thread watches that process, because launches and the compilation of kernels run outside of Python's lock. Linux
    could send a signal instead (PR_SET_PDEATHSIG), but it does so when the thread ends that started the worker, which
    may be long before the process.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all processes; the parent ends the workers
    threading.Thread(target=_end_with, args=(parent,), name="parent watch", daemon=True).start()
    os.environ["CUDA_VISIBLE_DEVICES"] = free.get()


def _end_with(parent: int) -> None:
    """End this process at once when its parent has ended, by a kill too: then it has another."""
    while os.getppid() == parent:
        time.sleep(LOOK)
    os._exit(ORPHANED)
