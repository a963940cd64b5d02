"""Number of CPU cores and amount of memory that this process may use."""

import contextlib
import os
from pathlib import Path


def processors() -> int:
    """Processors that this process may use; where the system does not say (macOS), all of the machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def free_memory() -> float:
    """Bytes that this process may still take, as Linux and a container's limits say; infinite if nobody says."""
    found = [float("inf")]
    with contextlib.suppress(OSError, ValueError, StopIteration):
        lines = Path("/proc/meminfo").read_text().splitlines()
        found.append(1024.0 * int(next(line for line in lines if line.startswith("MemAvailable:")).split()[1]))
    with contextlib.suppress(OSError, ValueError):
        found.append(float(Path("/sys/fs/cgroup/memory.max").read_text()))  # of a container; "max" is no number
    return min(found)
