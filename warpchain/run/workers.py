"""Executors of a sweep's tasks: threads, given executors, or one process per GPU; and detection of lost workers."""

import concurrent.futures
import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.queues import SimpleQueue


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
        time.sleep(1.0)
    os._exit(1)


class LostWorkersError(RuntimeError):
    """The workers of a sweep ended before it did; one line. What they have written is kept."""


@contextlib.contextmanager
def losses_named() -> Iterator[None]:
    """Raise `LostWorkersError` for what an executor raises when its workers, or the way to them, are gone."""
    try:
        yield
    except Exception as error:
        is_of_dask = type(error).__module__.partition(".")[0] == "distributed"  # which need not be installed
        lost = concurrent.futures.BrokenExecutor | concurrent.futures.CancelledError
        if not is_of_dask and not isinstance(error, lost):
            raise
        raise LostWorkersError(
            f"the workers ended before the sweep ({type(error).__name__}): killed, out of memory, or their scheduler "
            "was closed; start again, shards written are kept"
        ) from error


class Pulse:
    """What threads of this process and their sweep tell each other: what has been done, and when to stop the work.

    So many walks are `over`; for so many seconds the threads have `waited` for a GPU.
    """

    def __init__(self) -> None:
        """Begin to count."""
        self.stop, self.over, self.waited, self._lock = threading.Event(), 0, 0.0, threading.Lock()

    def beat(self, walks: int) -> None:
        """Count walks that are over."""
        with self._lock:
            self.over += walks

    def wait(self, seconds: float) -> None:
        """Count time in which a thread waited for a GPU."""
        with self._lock:
            self.waited += seconds


@contextlib.contextmanager
def pulsing_threads(count: int) -> Iterator[tuple[concurrent.futures.Executor, Pulse]]:
    """Threads of this process, and their pulse; launches run outside of Python's lock."""
    pulse = Pulse()
    with concurrent.futures.ThreadPoolExecutor(count) as threads:
        try:
            yield threads, pulse
        except BaseException:
            pulse.stop.set()
            raise
