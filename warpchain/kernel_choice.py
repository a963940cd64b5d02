"""Which kernels carry chains on: by device, what happens to the chains, and their numbers of links."""

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor

import warp as wp

from warpchain.kernels.block import make_advance_block
from warpchain.kernels.driver import Features, make_advance
from warpchain.kernels.rosenbrock_tables import ROSENBROCK_TABLES
from warpchain.options import Options

REGISTERS = {160: 128, 224: 128, 256: 128}
"""Registers a thread may take, by threads of a block, where that lets another block onto a multiprocessor; else 168.

A multiprocessor has four schedulers with 16384 registers each, so that a block's number of warps of 32 threads and
the registers decide how many blocks it holds. Measured on an H200, 4000 chains in flight with rkf78, dp5 and bs32, ns
per try and chain, with 128 and 168: 60 links 12.2, 6.4, 3.9 and 9.9, 5.5, 3.3; 90 links 15.9, 8.9, 5.7 and 16.5, 9.0,
5.5; 150 links 28.7, 16.4, 10.1 and 32.9, 18.0, 10.7. Without a bound, few chains run up to 15 % faster and many slower;
one number for all keeps a walk's bits independent of its batch. rodas4p is fastest without one.
"""


def block_kernel(features: Features, threads: int) -> wp.Kernel:
    """The kernel of the block form for blocks of this many threads."""
    registers = None if features.method in ROSENBROCK_TABLES else REGISTERS.get(threads, 168)
    return make_advance_block(features, threads, registers)


def block_threads(links: int) -> int:
    """Threads of a GPU's block that carries a chain: one per link, rounded up to whole warps of 32."""
    return -(-links // 32) * 32


def features_of(options: Options, columns: int, *, fixed_body: str, watch: str, broad_phase: str = "grid") -> Features:
    """Kernel features for chains with these options in scratch blocks of this width."""
    return Features(
        method=options.method,
        columns=columns,
        fixed_body=fixed_body,
        self_contact=options.self_contact,
        broad_phase=broad_phase,
        watch=watch,
        softens=(watch == "rest" and options.soften_pile) or (watch in ("rest", "steady") and options.soften_drive),
    )


def kernels_of(device: wp.Device, features: Features, links: Iterable[int]) -> list[tuple[wp.Kernel, int]]:
    """Kernels that carry chains with these numbers of links on, each with the threads of its blocks."""
    if not device.is_cuda:
        return [(make_advance(features), 1)]
    return [(block_kernel(features, threads), threads) for threads in sorted({block_threads(n) for n in links})]


def load_kernels(wanted: Iterable[tuple[wp.Device, Features, Sequence[int]]]) -> None:
    """Compile what is not yet in the cache, several kernels at a time.

    Args:
        wanted: Device, features and numbers of links.
    """
    kernels = [
        (device, kernel, threads)
        for device, features, links in wanted
        for kernel, threads in kernels_of(device, features, links)
    ]

    def load(item: tuple[wp.Device, wp.Kernel, int]) -> None:
        device, kernel, threads = item
        wp.load_module(kernel.module, device=device, block_dim=threads)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        list(pool.map(load, kernels))
