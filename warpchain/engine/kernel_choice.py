"""Chooses and loads kernels by device, features and number of links; batches and `compile` call this."""

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor

import warp as wp

from warpchain.engine.devices import Device, Gpu
from warpchain.engine.kernel_cache import load_checked
from warpchain.engine.kernel_entries import kernel_entry, step_module
from warpchain.engine.processors import processors
from warpchain.kernels.features import Features

WARP = 32
"""Threads that a GPU carries on together."""
SCHEDULERS, SCHEDULER_REGISTERS = 4, 16384
"""Of a multiprocessor, and registers of each."""
REGISTERS = 168
"""Most registers of a thread."""
FEWER_REGISTERS = {160: 128, 224: 128, 256: 128}
"""Most registers, by threads of a block, where fewer let another block onto a multiprocessor.

Of 4000 chains in flight on an H200, those of 150 links are 8 to 14 % faster with 128, those of 60 links 5 to 12 % with
168. Without a bound, few chains run up to 15 % faster and many slower. No bit of a walk depends on it
(`tests/kernels/gpu/test_on_gpu.py`, walks in blocks of their own and of 192 threads).
"""
_loading = threading.Lock()
"""Held by the thread that loads kernels; two that want the same one would both compile it."""
_loaded: dict[tuple[Device, Features, int], wp.Kernel] = {}
"""Entries of loaded kernels, by what they were loaded for."""


def most_registers(threads: int) -> int:
    """Most registers of each thread in blocks of this many."""
    return FEWER_REGISTERS.get(threads, REGISTERS)


def block_threads(links: int) -> int:
    """Threads of a GPU's block that carries a chain: one per link, rounded up to whole warps."""
    return -(-links // WARP) * WARP


def resident_blocks(threads: int) -> int:
    """Blocks of this many threads that a multiprocessor carries on at a time: its registers decide."""
    warps = SCHEDULERS * (SCHEDULER_REGISTERS // (most_registers(threads) * WARP))
    return max(1, warps // (threads // WARP))


def step_kernel(device: Device, features: Features, threads: int) -> wp.Kernel:
    """The kernel for blocks of this many threads, on a CPU 1, loaded."""
    if (device, features, threads) not in _loaded:
        load_kernels([(device, features, threads)])
    return _loaded[device, features, threads]


def load_kernels(wanted: Iterable[tuple[Device, Features, int]], on_compile: Callable[[], None] = lambda: None) -> None:
    """Load kernels by device, features and threads of a block, on a CPU 1; compile those that are not in the cache.

    Before each that is compiled `on_compile` is called, by any thread.
    """

    def load(key: tuple[Device, Features, int], entry: wp.Kernel) -> None:
        device, features, threads = key

        def make() -> wp.Module:
            on_compile()
            return step_module(features, threads, _registers(device, threads))

        load_checked(entry.module, device.warp, make)

    with _loading:
        entries = {
            (device, features, threads): kernel_entry(features, threads, _registers(device, threads))
            for device, features, threads in wanted
            if (device, features, threads) not in _loaded
        }
        for device, _, _ in entries:
            if isinstance(device, Gpu):
                _ = device.filling  # Warp makes its streams now, before several threads ask for them
        with ThreadPoolExecutor(processors()) as pool:
            list(pool.map(load, entries, entries.values()))
        _loaded.update(entries)


def _registers(device: Device, threads: int) -> int | None:
    """Most registers of each thread; None on a CPU."""
    return most_registers(threads) if isinstance(device, Gpu) else None
