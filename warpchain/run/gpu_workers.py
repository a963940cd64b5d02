"""Several GPUs of this host: one worker process for each, as an executor of a sweep."""

import contextlib
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.queues import SimpleQueue
from multiprocessing.synchronize import Barrier
from typing import Any, TypeVar

from warpchain.inputs.validation import InputError
from warpchain.run.lost_workers import losses_named
from warpchain.run.parent_watch import end_with_parent

Answer = TypeVar("Answer")


class GpuWorkers(ProcessPoolExecutor):
    """Worker processes, each of which sees only one GPU."""

    def __init__(self, gpus: Sequence[str]) -> None:
        """Prepare a process for each of these values of CUDA_VISIBLE_DEVICES; it starts with its first task."""
        context = multiprocessing.get_context("spawn")  # CUDA does not survive a fork
        free = context.SimpleQueue()
        for gpu in gpus:
            free.put(gpu)
        self.count = len(gpus)
        meeting = context.Barrier(self.count)
        super().__init__(self.count, mp_context=context, initializer=_take_gpu, initargs=(free, meeting))

    def in_each(self, function: Callable[..., Answer], /, *arguments: Any) -> list[Answer]:
        """Run ``function(*arguments)`` once in every worker, while nothing else is running; what they returned.

        Raises:
            LostWorkersError: One of them was killed.
            Exception: What one of them raised. In both cases the workers can then only be shut down.
        """
        with losses_named():
            # a worker that is done waits for the others, so that none runs it twice
            futures = [self.submit(_meet_after, function, *arguments) for _ in range(self.count)]
            errors = [error for future in futures if (error := future.exception()) is not None]
            for error in sorted(errors, key=lambda error: isinstance(error, threading.BrokenBarrierError)):
                raise error
        return [future.result() for future in futures]

    def stop(self) -> None:
        """End the processes at once; the shards that they have written are whole."""
        for process in list((self._processes or {}).values()):  # Python has a public name for this from 3.14 on
            process.terminate()


@contextlib.contextmanager
def gpu_workers(count: int) -> Iterator[GpuWorkers]:
    """Worker processes, each of which sees only one GPU and runs a sweep with the device ``cuda``.

    An exception, such as that of Ctrl-C, ends them at once, for a task may take minutes.

    Args:
        count: Number of GPUs; the first ones, in the order of CUDA_VISIBLE_DEVICES if that is set.

    Raises:
        InputError: CUDA_VISIBLE_DEVICES has fewer.
    """
    with GpuWorkers(visible_gpus(count)) as executor:
        try:
            yield executor
        except BaseException:
            executor.stop()
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


_meeting: "Barrier | None" = None
"""Where the workers of a pool wait for one another; in a worker only."""


def _take_gpu(free: "SimpleQueue[str]", meeting: "Barrier") -> None:
    """Let this process see only one GPU; at its start, because CUDA reads the variable only once, when Warp starts."""
    global _meeting
    end_with_parent()
    os.environ["CUDA_VISIBLE_DEVICES"] = free.get()
    _meeting = meeting


def _meet_after(function: Callable[..., Answer], /, *arguments: Any) -> Answer:
    """Run a function, then wait until all workers have; if it fails, none of them waits any longer."""
    assert _meeting is not None
    try:
        answer = function(*arguments)
    except BaseException:
        _meeting.abort()
        raise
    _meeting.wait()
    return answer
