"""Where the tasks of a sweep run: threads of this process, an executor, a Dask cluster; and workers that were lost."""

import concurrent.futures
import contextlib
import threading
from collections.abc import Iterator


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
    """What threads of this process and their sweep tell each other: how many walks are over, when to stop the work."""

    def __init__(self) -> None:
        """Begin to count."""
        self.stop, self.over, self._lock = threading.Event(), 0, threading.Lock()

    def beat(self) -> None:
        """Count a walk."""
        with self._lock:
            self.over += 1


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
