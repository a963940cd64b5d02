"""Several GPUs of this host: one worker process for each, as an executor of a sweep."""

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.queues import SimpleQueue
from typing import Final

from warpchain.inputs.validation import InputError

LOOK: Final = 1.0
"""Time [s] between two looks at the parent's number, beside waiting for its end."""
ORPHANED: Final = 1
"""Exit status of a worker without a parent."""


@contextlib.contextmanager
def gpu_workers(count: int) -> Iterator[ProcessPoolExecutor]:
    """Worker processes, each of which sees only one GPU and runs a sweep with the device ``cuda``.

    An exception, such as that of Ctrl-C, ends them at once, for a task may take minutes; the shards that they have
    written are whole.

    Args:
        count: Number of GPUs; the first ones, in the order of CUDA_VISIBLE_DEVICES if that is set.

    Raises:
        InputError: CUDA_VISIBLE_DEVICES has fewer.
    """
    context = multiprocessing.get_context("spawn")  # CUDA does not survive a fork
    free = context.SimpleQueue()
    for gpu in visible_gpus(count):
        free.put(gpu)
    with ProcessPoolExecutor(count, mp_context=context, initializer=_take_gpu, initargs=(free,)) as executor:
        try:
            yield executor
        except BaseException:
            for process in list((executor._processes or {}).values()):  # public from Python 3.14 on
                process.terminate()
            raise


def visible_gpus(count: int) -> Sequence[str]:
    """Value of CUDA_VISIBLE_DEVICES for each of the first GPUs that this process may use.

    Raises:
        InputError: There are fewer.
    """
    listed = os.environ.get("CUDA_VISIBLE_DEVICES")
    if listed is None:
        return [str(number) for number in range(count)]
    gpus = [gpu.strip() for gpu in listed.split(",") if gpu.strip()]
    if len(gpus) < count:
        raise InputError(f"--gpus: {count} wanted, but CUDA_VISIBLE_DEVICES is {listed!r}; give at most {len(gpus)}")
    return gpus[:count]


def _take_gpu(free: "SimpleQueue[str]") -> None:
    """Let this process see only one GPU, before Warp starts, and end when the process ends that started it.

    A thread watches that process, because launches and the compilation of kernels run outside of Python's lock. Linux
    could send a signal instead (PR_SET_PDEATHSIG), but it does so when the thread ends that started the worker, which
    may be long before the process.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all processes; the parent ends the workers
    threading.Thread(target=_end_with_parent, name="parent watch", daemon=True).start()
    os.environ["CUDA_VISIBLE_DEVICES"] = free.get()


def _end_with_parent() -> None:
    """Wait for the end of the parent, by a kill too, then end this process at once."""
    parent = multiprocessing.parent_process()
    # The sentinel is a pipe whose other end the parent holds, and so does a process that was forked from it. So the
    # number of the parent is asked as well: it changes when the parent ends.
    while parent and os.getppid() == parent.pid and not multiprocessing.connection.wait([parent.sentinel], LOOK):
        pass
    os._exit(ORPHANED)
