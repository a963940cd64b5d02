"""What a step of many chains costs on a GPU, beside the arithmetic that the device can do.

Identical chains are carried on as in a sweep: in several batches with queued launches, by the kernels of a walk with
floor, contacts and the watch for rest. Medians of several measurements are reported.
"""

import ctypes
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import warp as wp

from warpchain.bench.chain_timer import ChainTimer, together
from warpchain.bench.starts import flying, piled
from warpchain.engine.devices import Fibers, Gpu, start_device, versions
from warpchain.engine.kernel_choice import block_threads, features_of, load_kernels, step_kernel
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.inputs.validation import InputError, shown
from warpchain.kernels import layout
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS
from warpchain.kernels.methods.method import find_method, method_names

LINKS: Final = (60, 90, 120, 150, 180)
CHAINS: Final = (1, 132, 400, 1000, 4000)
SCENES: Final = ("flight", "pile")
METHODS: Final = tuple(name for name in method_names() if find_method(name).runs_on_gpus)
"""Methods that run on GPUs, all of them explicit."""

SECONDS: Final = 0.2
"""Approximate length of a measurement; copying the state of four batches took a tenth to a half of 0.04 s."""
LAUNCHES: Final = 2
"""Launches of each batch in a measurement."""

FP64_LANES: Final = {80: 32, 90: 64}
"""Fused operations in double precision per clock and multiprocessor, by compute capability (NVIDIA, data sheets)."""

STAGE_FLOPS: Final = {"direction": 26, "state": 14, "ends": 10, "joint": 52, "power": 8, "acceleration": 13}
"""Additions and multiplications of a link's stage in double precision, counted in the source; the same for any tableau.

A reciprocal counts 6: an approximate one is made exact by fused operations.
"""
END_FLOPS: Final = 50
"""The same for new state, error norm, direction and measured quantities of a link at the end of an attempt."""


@dataclass(frozen=True)
class GpuCost:
    """What an attempt costs.

    Attributes:
        scene: ``"flight"`` (a circulating ellipse in the air) or ``"pile"`` (a chain that has dropped to the floor).
        method: One of :data:`METHODS`.
        links: n.
        chains: Chains that are carried on together.
        microseconds: Median wall time of one attempt of all of them [µs].
        link_stages: Stages of a link per second [1/s].
        chain_seconds: Simulated time of all chains per wall time.
        rejected: Fraction of attempts that were rejected.
        registers: Of a thread.
        spilled: Local memory of a thread [B], which takes what registers cannot hold.
        blocks: Chains that a multiprocessor holds at a time.
        occupancy: Threads that a multiprocessor then holds, as a fraction of its greatest number.
        peak: Arithmetic in double precision as a fraction of what the device could do at its highest clock, see
            :func:`flops_per_attempt`; NaN if the device is not in :data:`FP64_LANES`.
    """

    scene: str
    method: str
    links: int
    chains: int
    microseconds: float
    link_stages: float
    chain_seconds: float
    rejected: float
    registers: int
    spilled: int
    blocks: int
    occupancy: float
    peak: float


def evaluations(method: str) -> int:
    """Stages that an attempt evaluates: one less if the last stage of a step is the first of the next."""
    return find_method(method).stages - find_method(method).reuses_last


def flops_per_attempt(method: str) -> int:
    """Arithmetic of a link and an attempt in double precision, contacts not counted, see :data:`STAGE_FLOPS`.

    Every coefficient of the tableau that is not zero is a product and a sum for each of three components, for
    velocities and for positions.
    """
    tableau = TABLEAUS[method]
    rows = [*tableau.velocity, *tableau.position]
    rows += [tableau.velocity_weights, tableau.position_weights, tableau.velocity_errors, tableau.position_errors]
    products = sum(value != 0.0 for row in rows for value in row)
    return evaluations(method) * sum(STAGE_FLOPS.values()) + 2 * 3 * products + END_FLOPS


def gpu_costs(
    device: str,
    *,
    scenes: Sequence[str] = SCENES,
    methods: Sequence[str] = METHODS,
    links: Sequence[int] = LINKS,
    chains: Sequence[int] = CHAINS,
    rounds: int = 5,
    report: Callable[[str], None],
) -> list[GpuCost]:
    """Cost of an attempt at Table 1's parameters and each method's tolerances.

    Args:
        device: ``"cuda"`` or ``"cuda:N"``.
        scenes: Of :data:`SCENES`.
        methods: Of :data:`METHODS`.
        links: Chain lengths.
        chains: Numbers of chains.
        rounds: Measurements of each.
        report: Called with a line when something takes a while.

    Raises:
        InputError: This machine has no such GPU, or a scene or method is not measured.
    """
    for name, given, known in (("scene", scenes, SCENES), ("method", methods, METHODS)):
        for value in given:
            if value not in known:
                names = ", ".join(known)
                raise InputError(f"bench.{name}: {shown(value)} is not measured on a GPU; give one of {names}")
    found = start_device(device)
    if not isinstance(found, Gpu) or isinstance(found, Fibers):
        raise InputError(f"bench.device: {device} is not a GPU; give cuda or cuda:N")
    report("compiling kernels")
    options = {method: Options.model_validate({"method": method, "device": device}) for method in methods}
    load_kernels(
        (found, features_of(options[method], columns, fixed_body="floor", watch="rest"), block_threads(n))
        for method, (n, columns) in itertools.product(methods, [(n, layout.padded_width(n)) for n in links])
    )
    parameters = preset("paper")
    costs = []
    for n, scene in itertools.product(links, scenes):
        report(f"{scene} of {n} links")
        start = flying(n, parameters) if scene == "flight" else piled(n, device)
        for method, count in itertools.product(methods, chains):
            report(f"{scene}, {n} links, {method}, {count} chains")
            timer = ChainTimer(
                parameters, options[method], start, count, watch="rest", launches=LAUNCHES, settling_runs=2
            )
            costs.append(_gpu_cost(scene, method, timer, rounds))
    return costs


def _gpu_cost(scene: str, method: str, timer: ChainTimer, rounds: int) -> GpuCost:
    """Cost of an attempt from several measurements of :data:`SECONDS` each."""
    attempts = round(SECONDS / timer.settled.seconds)
    whole = together(scene, [timer.measure(attempts) for _ in range(rounds)])
    threads, gpu = block_threads(timer.links), timer.batches[0].device
    device = gpu.warp
    registers, spilled, blocks = _kernel_needs(step_kernel(gpu, timer.features, threads), threads, device)
    peak = 2 * FP64_LANES.get(device.arch, math.nan) * device.sm_count * highest_clock(device)
    links = timer.links * timer.chains
    return GpuCost(
        scene=scene,
        method=method,
        links=timer.links,
        chains=timer.chains,
        microseconds=1e6 * whole.seconds,
        link_stages=links * evaluations(method) / whole.seconds,
        chain_seconds=timer.chains * whole.simulated / (whole.attempts * whole.seconds),
        rejected=whole.rejected / whole.attempts,
        registers=registers,
        spilled=spilled,
        blocks=blocks,
        occupancy=blocks * threads / 2048,
        peak=links * flops_per_attempt(method) / whole.seconds / peak,
    )


def gpu_machine(device: str) -> dict[str, str]:
    """GPU, driver and versions, for the record of a measurement."""
    found = start_device(device).warp
    major, minor = wp.get_cuda_driver_version()
    return {
        "gpu": found.name,
        "multiprocessors": str(found.sm_count),
        "highest clock": f"{highest_clock(found) / 1e6:.0f} MHz",
        "CUDA driver": f"{major}.{minor}",
    } | versions()


def highest_clock(device: wp.Device) -> float:
    """Of the multiprocessors [Hz]."""
    kilohertz = ctypes.c_int()
    _check(_driver().cuDeviceGetAttribute(ctypes.byref(kilohertz), 13, device.ordinal))
    return 1e3 * kilohertz.value


def _driver() -> ctypes.CDLL:
    """NVIDIA's driver, which knows more of a kernel than Warp tells."""
    return ctypes.CDLL("libcuda.so.1")


def _check(code: int) -> None:
    if code != 0:
        raise RuntimeError(f"the CUDA driver answered with error {code}")


def _kernel_needs(kernel: wp.Kernel, threads: int, device: wp.Device) -> tuple[int, int, int]:
    """Registers and local memory [B] of a thread, blocks that a multiprocessor holds at a time."""
    hooks = kernel.module.load(device, threads).get_kernel_hooks(kernel)
    function, shared = ctypes.c_void_p(hooks.forward), ctypes.c_size_t(hooks.forward_smem_bytes)
    registers, local, blocks = ctypes.c_int(), ctypes.c_int(), ctypes.c_int()
    driver = _driver()
    with wp.ScopedDevice(device):
        _check(driver.cuFuncGetAttribute(ctypes.byref(registers), 4, function))
        _check(driver.cuFuncGetAttribute(ctypes.byref(local), 3, function))
        _check(driver.cuOccupancyMaxActiveBlocksPerMultiprocessor(ctypes.byref(blocks), function, threads, shared))
    return registers.value, local.value, blocks.value
