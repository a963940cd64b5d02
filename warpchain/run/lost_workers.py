"""Workers of a sweep that were lost, told from defects: a process that was killed, a scheduler that was closed."""

import concurrent.futures
import contextlib
from collections.abc import Iterator


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
