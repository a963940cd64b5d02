"""Where the tasks of a sweep run: threads of this process, an executor, a Dask cluster; and workers that were lost."""

import concurrent.futures
import contextlib
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol, runtime_checkable


class LostWorkersError(RuntimeError):
    """The workers of a sweep ended before it did; one line. What they have written is kept."""


@contextlib.contextmanager
def losses_named() -> Iterator[None]:
    """Raise `LostWorkersError` for what an executor raises when its workers, or the way to them, are gone."""
    try:
        yield
    except (concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError) as error:
        raise _lost(error) from error
    except Exception as error:
        if type(error).__module__.partition(".")[0] != "distributed":  # Dask, which need not be installed
            raise
        raise _lost(error) from error


def _lost(error: BaseException) -> LostWorkersError:
    return LostWorkersError(
        f"the workers ended before the sweep ({type(error).__name__}): killed, out of memory, or their scheduler was "
        "closed; start again, shards written are kept"
    )


class Executor(Protocol):
    """An executor such as those of ``concurrent.futures``, ``mpi4py.futures`` and Dask's ``get_executor()``."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> "concurrent.futures.Future[Any]":
        """Run ``function(*arguments)`` somewhere."""
        ...


@runtime_checkable
class DaskClient(Protocol):
    """What is used of ``distributed.Client``, which has no such method ``submit`` as executors have."""

    def get_executor(self, *, pure: bool) -> Executor:
        """An executor on the workers."""
        ...

    def nthreads(self) -> Mapping[str, int]:
        """Number of threads of each worker."""
        ...


class Pulse:
    """What tasks in threads of this process and their sweep tell one another.

    Attributes:
        stop: Set when the work is to be abandoned.
        over: Number of walks that are over.
    """

    def __init__(self) -> None:
        """Begin to count."""
        self.stop, self.over, self._lock = threading.Event(), 0, threading.Lock()

    def beat(self) -> None:
        """Count a walk."""
        with self._lock:
            self.over += 1


@contextlib.contextmanager
def pulsing_threads(count: int) -> Iterator[tuple[Executor, Pulse]]:
    """Threads of this process, and their pulse; launches run outside of Python's lock."""
    pulse = Pulse()
    with concurrent.futures.ThreadPoolExecutor(count) as threads:
        try:
            yield threads, pulse
        except BaseException:
            pulse.stop.set()
            raise
