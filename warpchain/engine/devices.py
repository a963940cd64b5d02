"""Devices: starting one, and how many chains fit into its memory."""

import concurrent.futures
import contextlib
import functools
import os
import platform
import sys
import tempfile
import threading
import traceback
from collections.abc import Iterable, Iterator

import warp as wp

from warpchain.engine.kernel_cache import cache_refusal
from warpchain.engine.kernel_choice import block_threads, resident_blocks
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError
from warpchain.kernels import layout
from warpchain.kernels.contacts.pair_list import list_layout
from warpchain.kernels.cpu import functions as cpu_functions
from warpchain.kernels.gpu import functions as gpu_functions
from warpchain.version import package_versions

CONNECTIONS = "32"  # queues between host and GPU; with fewer than streams, streams wait for one another
WORLDS_OF_BLOCK = 2
"""Chains under way for each block that a GPU holds: while some are with the host, the others fill it.

With more, every walk takes longer, and so does the end of a run, when the GPU empties.
"""
CAPACITY_SAMPLES = 512
"""Samples of a chain that a device can hold between two launches, if the time series is kept."""
CAPACITY_FRAMES = 64
"""Frames of a chain that a device can hold between two launches, if frames are kept."""
TURN_POLL = 0.2
"""Time [s] between two looks at whether a thread that waits for its turn on a GPU should stop."""
_start_lock = threading.Lock()
_gpu_lock = threading.RLock()
_gpu_users: list[int] = []
"""The thread whose turn it is, once for each turn within its turn."""


def start_device(device: str) -> wp.Device:
    """Start Warp and return the device.

    Raises:
        InputError: This machine has no such device.
    """
    with _start_lock:
        return _started(device)


@functools.cache
def _started(device: str) -> wp.Device:
    """The device, see `start_device`; two threads at once would start Warp twice and mix up stderr."""
    wp.config.log_level = wp.LOG_ERROR
    os.environ.setdefault("CUDA_DEVICE_MAX_CONNECTIONS", CONNECTIONS)  # CUDA reads both when it starts
    os.environ.setdefault("CUDA_MODULE_LOADING", "EAGER")  # else a kernel's first launch waits for those under way
    with _without_driver_warning():
        try:
            wp.init()
        except OSError as error:
            raise cache_refusal(error) from None
    name = "cuda:0" if device == "cuda" else device
    known = [found.alias for found in wp.get_devices()]
    if name not in known:
        raise InputError(f"options.device: there is no {device} on this machine; give one of {', '.join(known)}")
    return wp.get_device(name)


def gpu_count() -> int:
    """Number of GPUs that this process may use, from 1 on.

    Raises:
        InputError: There is none.
    """
    start_device("cuda")
    return int(wp.get_cuda_device_count())


@contextlib.contextmanager
def gpu_turn(devices: Iterable[str], stop: threading.Event | None = None) -> Iterator[None]:
    """Keep other threads of this process off its GPUs, if one of these devices is one; CPUs need no turns.

    Warp's CUDA runtime has no locks (its issue 1491): a process in which two threads make and free streams and arrays
    may crash. So whatever is on a GPU must be made and freed within a turn. An error that ends it loses the local
    variables of its frames, which would keep arrays beyond the turn.

    Args:
        devices: Where the work is done.
        stop: When set, a thread that still waits for its turn does so no longer.

    Raises:
        CancelledError: `stop` was set before the turn came.
    """
    if not any(device.startswith("cuda") for device in devices):
        yield
        return
    while not _gpu_lock.acquire(timeout=TURN_POLL):
        if stop is not None and stop.is_set():
            raise concurrent.futures.CancelledError
    try:
        _gpu_users.append(threading.get_ident())
        try:
            yield
        except BaseException as error:
            _clear_frames(error)
            raise
        finally:
            _gpu_users.pop()
    finally:
        _gpu_lock.release()


def has_gpu_turn() -> bool:
    """Whether this thread is within a :func:`gpu_turn` on a GPU."""
    return threading.get_ident() in _gpu_users


def _clear_frames(error: BaseException) -> None:
    """Drop the local variables of the frames that have ended, of an error and of those behind it."""
    waiting, seen = [error], set()
    while waiting:
        one = waiting.pop()
        if id(one) not in seen:
            seen.add(id(one))
            traceback.clear_frames(one.__traceback__)
            waiting += [other for other in (one.__cause__, one.__context__) if other is not None]


@contextlib.contextmanager
def _without_driver_warning() -> Iterator[None]:
    """Remove the line about a missing NVIDIA driver from what Warp's native code writes to stderr.

    Every machine without a GPU prints it, also if no GPU is asked for. Who asks for a missing GPU gets an error.
    """
    if sys.stderr is None:  # it was closed before Python began
        yield
        return
    sys.stderr.flush()
    kept = os.dup(2)
    with tempfile.TemporaryFile() as caught:
        os.dup2(caught.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            caught.seek(0)
            for line in caught:
                if b"NVIDIA CUDA driver" not in line:
                    os.write(2, line)


def versions() -> dict[str, str]:
    """Versions of the packages that may change a number, for the provenance of a result."""
    return package_versions() | {"python": platform.python_version()}


def scratch_rows(options: Options, longest: int, device: wp.Device, threads: int | None = None) -> int:
    """Rows of a chain's scratch on a device, for chains of up to this many links; ``threads`` as in a batch."""
    columns = layout.padded_width(longest)
    if device.is_cuda:
        return gpu_functions.board_rows(threads or block_threads(longest), columns)
    return cpu_functions.scratch_rows(options.method, columns)


def world_bytes(
    longest: int,
    options: Options,
    samples: int,
    frames: int,
    device: wp.Device,
    keeps_loads: bool = False,
    tilts: bool = False,
) -> int:
    """Memory [B] that a batch takes on a device for each of its worlds.

    Args:
        longest: Greatest number of links.
        options: Options of the batch.
        samples: Capacity of the time series.
        frames: Capacity of the frames.
        device: Device of the batch.
        keeps_loads: Whether loads of joints are kept with the frames.
        tilts: Whether the plane of the chain is kept with samples and frames.
    """
    columns = layout.padded_width(longest)
    few = len(Parameters.model_fields) + 184  # numbers of a world in model, drive and state
    numbers = columns * scratch_rows(options, longest, device) + 6 * longest + few
    numbers += samples * (layout.ALL_COLUMNS if tilts else layout.SAMPLE_COLUMNS)
    numbers += frames * ((2 + 3 * keeps_loads) * longest + layout.PLANE_VALUES * tilts + 1)
    return 8 * numbers + 4 * list_layout(columns).size


def most_worlds(
    longest: int,
    options: Options,
    *,
    keeps_samples: bool,
    keeps_frames: bool,
    keeps_loads: bool = False,
    tilts: bool = False,
    threads: int | None = None,
) -> int:
    """Chains that a GPU should carry on together: enough to fill it that fit into half of the free memory.

    The other half is left to others, such as batches of other threads.
    """
    device = start_device(options.device)
    samples, frames = CAPACITY_SAMPLES * keeps_samples, CAPACITY_FRAMES * keeps_frames
    fitting = int(device.free_memory) // 2 // world_bytes(longest, options, samples, frames, device, keeps_loads, tilts)
    filling = WORLDS_OF_BLOCK * resident_blocks(threads or block_threads(longest)) * int(device.sm_count)
    return max(1, min(filling, fitting))
