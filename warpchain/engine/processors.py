"""The number of usable processors."""

import os


def processors() -> int:
    """Processors that this process may use; where the system does not say (macOS), all of the machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
