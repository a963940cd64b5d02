"""Starting a device, the differences between CPU and GPU, and turns of threads on a GPU."""

import concurrent.futures
import contextlib
import functools
import os
import sys
import tempfile
import threading
import traceback
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import warp as wp

from warpchain.engine.fibers import HeldStream
from warpchain.engine.kernel_cache import cache_refusal
from warpchain.inputs.options import FIBERS, on_gpu
from warpchain.inputs.validation import InputError

CONNECTIONS = "32"  # queues between host and GPU; with fewer queues than streams, streams are serialised
TURN_POLL = 0.2
"""Time [s] between two looks at whether a thread that waits for its turn on a GPU should stop."""
_start_lock = threading.Lock()
_gpu_lock = threading.RLock()
_gpu_users: list[int] = []
"""The thread whose turn it is, once for each turn within its turn."""


class Device:
    """A CPU: a launch carries on its chains one after the other, in one thread each."""

    def __init__(self, warp: wp.Device) -> None:
        """Prepare to use what Warp has for it."""
        self.warp = warp


class Gpu(Device):
    """A GPU: a block of threads carries on a chain; copies and launches wait in streams."""

    pins_memory = True  # of the host, so that copies wait in streams as well

    @property
    def multiprocessors(self) -> int:
        """Number of multiprocessors."""
        return int(self.warp.sm_count)

    @property
    def free_memory(self) -> int:
        """Free memory [B]."""
        return int(self.warp.free_memory)

    @property
    def filling(self) -> Any:
        """The stream in which new arrays are filled; Warp makes it when it is first asked for."""
        return self.warp.stream

    def stream(self) -> Any:
        """A new stream."""
        return wp.Stream(self.warp)

    def copy(self, target: wp.array, source: wp.array, stream: Any) -> None:
        """Begin a copy between host and device."""
        wp.copy(target, source, stream=stream)

    def launch(self, kernel: wp.Kernel, blocks: int, inputs: Sequence[Any], threads: int, stream: Any) -> None:
        """Begin a launch."""
        wp.launch_tiled(kernel, dim=[blocks], inputs=inputs, block_dim=threads, device=self.warp, stream=stream)

    def wait(self, event: Any) -> None:
        """Wait until a stream has come to an event."""
        wp.synchronize_event(event)


class Fibers(Gpu):
    """A CPU that runs a GPU's kernels, each thread of a block as a fiber: slow, for tests.

    The host does all that it does for a GPU. What waits in a stream is done when the host waits for it.
    """

    pins_memory = False  # which takes CUDA
    multiprocessors = 1
    free_memory = 2**28
    filling = HeldStream()  # arrays on a CPU are filled at once

    def __init__(self, warp: wp.Device) -> None:
        """Let Warp run blocks of several threads on a CPU."""
        super().__init__(warp)
        wp.config.enable_cpu_blocks = True

    def stream(self) -> HeldStream:
        """A new stream."""
        return HeldStream()

    def copy(self, target: wp.array, source: wp.array, stream: HeldStream) -> None:
        """Let a copy wait in a stream."""
        stream.hold(lambda: wp.copy(target, source))

    def launch(self, kernel: wp.Kernel, blocks: int, inputs: Sequence[Any], threads: int, stream: HeldStream) -> None:
        """Let a launch wait in a stream."""
        launch = functools.partial(wp.launch_tiled, kernel, dim=[blocks], inputs=inputs, block_dim=threads)
        stream.hold(lambda: launch(device=self.warp))

    def wait(self, event: Any) -> None:
        """Do what comes before an event."""
        event.reach()


def start_device(device: str) -> Device:
    """Start Warp and return the device; an `InputError` says that this machine has none of that name."""
    with _start_lock:
        return _started(device)


@functools.cache
def _start_warp() -> None:
    """Start Warp; two threads at once would start it twice and mix up stderr."""
    wp.config.log_level = wp.LOG_ERROR
    os.environ.setdefault("CUDA_DEVICE_MAX_CONNECTIONS", CONNECTIONS)  # CUDA reads both when it starts
    os.environ.setdefault("CUDA_MODULE_LOADING", "EAGER")  # else a kernel's first launch waits for those under way
    with _without_driver_warning():
        try:
            wp.init()
        except OSError as error:
            raise cache_refusal(error) from None


@functools.cache
def _started(device: str) -> Device:
    """The device, see `start_device`."""
    _start_warp()
    if device == FIBERS:
        return Fibers(wp.get_device("cpu"))
    name = "cuda:0" if device == "cuda" else device
    known = [found.alias for found in wp.get_devices()]
    if name not in known:
        raise InputError(f"options.device: {device} is not available on this machine; use one of {', '.join(known)}")
    found = wp.get_device(name)
    return Gpu(found) if found.is_cuda else Device(found)


def start_early(device: str) -> None:
    """Begin to start a GPU in a thread: that takes half a second, in which the caller may import, and read files.

    What goes wrong is told to who asks for the device, for whom :func:`start_device` tries again.
    """

    def start() -> None:
        with gpu_turn([device]):
            _ = start_device(device).warp.stream  # Warp makes it when it is first asked for

    concurrent.futures.ThreadPoolExecutor(1).submit(start)


def gpu_count() -> int:
    """Number of GPUs that this process may use."""
    with _start_lock:
        _start_warp()
    return int(wp.get_cuda_device_count())


@contextlib.contextmanager
def gpu_turn(devices: Iterable[str], stop: threading.Event | None = None) -> Iterator[None]:
    """Keep other threads of this process off its GPUs, if one of these devices is one; CPUs need no turns.

    Warp's CUDA runtime has no locks (its issue 1491): a process in which two threads make and free streams and arrays
    may crash. So whatever is on a GPU must be made and freed within a turn. An error that ends it loses the local
    variables of its frames, which would keep arrays beyond the turn. A thread that still waits for its turn when `stop`
    is set gets a `CancelledError`.
    """
    if not any(map(on_gpu, devices)):
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
