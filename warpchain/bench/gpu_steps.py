"""Measurements of speed on a GPU: what a step of many chains costs, and how far that is from what the device could do.

Chains are alike and are carried on as in a sweep: in several batches, launches queued one behind the other, the
kernels of a walk (floor, contacts, rest watched for). Everything is measured several times over, in turn; medians are
reported.
"""

import ctypes
import itertools
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import warp as wp

from warpchain.bench.cpu_steps import FAR, LONGEST_STRETCH, SETTLING_ATTEMPTS, Array, dropped, flying
from warpchain.engine.batch import Batch
from warpchain.engine.devices import start_device, versions
from warpchain.engine.kernel_choice import block_kernel, block_threads, features_of, load_kernels
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.validation import InputError, shown
from warpchain.kernels import layout
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS
from warpchain.status import Status
from warpchain.walks.scheduler import BATCHES_PER_GPU

LINKS: Final = (60, 90, 120, 150, 180)
CHAINS: Final = (1, 132, 400, 1000, 4000)
SCENES: Final = ("flight", "pile")
METHODS: Final = ("rkf78", "dp5", "bs32", "os32")
"""Those that are measured if none is named; any method of the engine can be."""

SECONDS: Final = 0.2
"""Length of a measurement, about; in 0.04 s, copying the state of four batches took a tenth to a half of it."""
LAUNCHES: Final = 2
"""Launches of each batch in a measurement."""

FP64_LANES: Final = {80: 32, 90: 64}
"""Fused operations in double precision per clock and multiprocessor, by compute capability (NVIDIA, data sheets)."""

STAGE_FLOPS: Final = {"direction": 26, "state": 14, "ends": 10, "joint": 52, "power": 8, "acceleration": 13}
"""Additions and multiplications in double precision of a link's stage, as the source has them, whatever the tableau.

A reciprocal counts 6: an approximate one made exact by fused operations.
"""
END_FLOPS: Final = 50
"""The same for new state, error norm, direction and what is measured of a link at the end of an attempt."""


@dataclass(frozen=True)
class GpuCost:
    """What an attempt costs.

    Attributes:
        scene: ``"flight"`` (a circulating ellipse in the air) or ``"pile"`` (a chain that was dropped and came down).
        method: A method of the engine.
        links: n.
        chains: Chains that are carried on together.
        microseconds: Median wall time of one attempt of all of them [µs].
        link_stages: Stages of a link per second [1/s]; NaN for methods that also solve equations.
        chain_seconds: Simulated time of all chains per wall time.
        rejected: Fraction of attempts that were rejected.
        registers: Of a thread.
        spilled: Local memory of a thread [B], where what does not fit into registers goes.
        blocks: Chains that a multiprocessor holds at a time.
        occupancy: Threads that a multiprocessor then holds, as a fraction of the most it can.
        peak: Arithmetic in double precision as a fraction of what the device could do at its highest clock, see
            :func:`flops_per_attempt`; NaN where either is unknown.
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


def flops_per_attempt(method: str) -> float:
    """Arithmetic of a link and an attempt in double precision, contacts not counted, see :data:`STAGE_FLOPS`.

    Every coefficient of the tableau that is not zero is a product and a sum for each of three components, for
    velocities and for positions. NaN for methods that also solve equations.
    """
    if method not in TABLEAUS:
        return math.nan
    tableau = TABLEAUS[method]
    rows = [*tableau.velocity, *tableau.position]
    rows += [tableau.velocity_weights, tableau.position_weights, tableau.velocity_errors, tableau.position_errors]
    products = sum(value != 0.0 for row in rows for value in row)
    return evaluations(method) * sum(STAGE_FLOPS.values()) + 2 * 3 * products + END_FLOPS


def evaluations(method: str) -> float:
    """Stages that an attempt evaluates: one less if the last stage of a step is the first of the next.

    NaN for methods that also solve equations.
    """
    if method not in TABLEAUS:
        return math.nan
    tableau = TABLEAUS[method]
    return tableau.stages - int(tableau.first_same_as_last)


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
        methods: Any of the engine.
        links: Chain lengths.
        chains: Numbers of chains.
        rounds: Measurements of each.
        report: Called with a line when something takes a while.

    Raises:
        InputError: This machine has no such GPU, or a scene or method is unknown.
    """
    for name, given, known in (("scene", scenes, SCENES), ("method", methods, TABLEAUS)):
        for value in given:
            if value not in known:
                raise InputError(f"bench.{name}: {shown(value)} is unknown; give one of {', '.join(known)}")
    found = start_device(device)
    if not found.is_cuda:
        raise InputError(f"bench.device: {device} is not a GPU; give cuda or cuda:N")
    report("compiling kernels")
    options = {method: Options.model_validate({"method": method, "device": device}) for method in methods}
    load_kernels(
        (found, features_of(options[method], columns, fixed_body="floor", watch="rest"), block_threads(n))
        for method, (n, columns) in itertools.product(methods, [(n, layout.padded_width(n)) for n in links])
    )
    parameters = preset("paper")
    costs = []
    for n in links:
        starts: dict[str, tuple[Array, Array]] = {}
        for scene in scenes:
            report(f"{scene} of {n} links")
            starts[scene] = flying(n, parameters) if scene == "flight" else dropped(n, device)
        for scene, method, count in itertools.product(scenes, methods, chains):
            report(f"{scene}, {n} links, {method}, {count} chains")
            crowd = Crowd(parameters, options[method], *starts[scene], count)
            costs.append(crowd.cost(scene, method, rounds))
    return costs


def gpu_machine(device: str) -> dict[str, str]:
    """GPU, driver and versions, for the record of a measurement."""
    found = start_device(device)
    major, minor = wp.get_cuda_driver_version()
    return {
        "gpu": found.name,
        "multiprocessors": str(found.sm_count),
        "highest clock": f"{highest_clock(found) / 1e6:.0f} MHz",
        "CUDA driver": f"{major}.{minor}",
    } | versions()


def as_json(machine: Mapping[str, str], costs: Sequence[GpuCost]) -> dict[str, Any]:
    """Everything measured, as JSON has it."""
    rows = [{name: None if value != value else value for name, value in asdict(cost).items()} for cost in costs]
    return {
        "machine": dict(machine),
        "flops_per_attempt": {name: flops_per_attempt(name) for name in TABLEAUS},
        "attempts": rows,
    }


def highest_clock(device: wp.Device) -> float:
    """Of the multiprocessors [Hz]."""
    kilohertz = ctypes.c_int()
    _check(_driver().cuDeviceGetAttribute(ctypes.byref(kilohertz), 13, device.ordinal))
    return 1e3 * kilohertz.value


def _driver() -> ctypes.CDLL:
    """NVIDIA's driver, for what Warp does not tell of a kernel."""
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


@dataclass(frozen=True)
class Stretch:
    """What a crowd did between two looks; its chains are all alike.

    Attributes:
        seconds: Wall time of one attempt of all chains [s].
        simulated: Simulated time of a chain [s].
        accepted: Accepted attempts of a chain.
        rejected: Rejected attempts of a chain.
        floor: Impulses with the floor of a chain.
    """

    seconds: float
    simulated: float
    accepted: int
    rejected: int
    floor: int

    @property
    def tried(self) -> int:
        """Attempts of a chain."""
        return self.accepted + self.rejected


class Crowd:
    """Chains all alike, in as many batches as a sweep would use."""

    def __init__(self, parameters: Parameters, options: Options, position: Array, velocity: Array, chains: int) -> None:
        """Put so many chains into one state; position (n, 3) and velocity (n, 3)."""
        self.links, self.chains = len(position), chains
        worlds = -(-chains // BATCHES_PER_GPU)
        self.batches = [Batch(min(worlds, chains - first), self.links, options) for first in range(0, chains, worlds)]
        for batch in self.batches:
            batch.control.rest_speed = 0.0  # a pile is at rest, and goes on
            batch.control.launch_time = math.inf  # launches are cut by attempts alone, which are counted on
            for world in range(len(batch.links)):
                batch.set_chain(world, parameters, self.links)
        self.features = self.batches[0].features(fixed_body="floor", watch="rest")
        self._start = position, velocity

    def begin(self) -> Stretch:
        """Put all chains back to their start and past the first, small steps; what they did then."""
        for batch in self.batches:
            for world in range(len(batch.links)):
                batch.load(world, *self._start, stop_time=FAR, stop_status=Status.FINISHED)
        self.run(SETTLING_ATTEMPTS)
        return self.run(SETTLING_ATTEMPTS)

    def run(self, attempts: int) -> Stretch:
        """Carry all chains on by about so many attempts."""
        batch = self.batches[0]
        time_before, before = batch.time(0), batch.counts(0)
        share = -(-attempts // LAUNCHES)
        began = time.perf_counter()
        for _ in range(LAUNCHES):
            for each in self.batches:
                each.start({self.features: range(len(each.links))}, share)
        for each in self.batches:
            each.finish()
        seconds = time.perf_counter() - began
        for each in self.batches:
            if (each.statuses() != Status.RUNNING).any():
                raise RuntimeError(f"a measured chain stopped: {each.status(0).sentence}")
        did = {name: count - before[name] for name, count in batch.counts(0).items()}
        return Stretch(
            seconds=seconds / (share * LAUNCHES),
            simulated=batch.time(0) - time_before,
            accepted=did["accepted"],
            rejected=did["rejected"],
            floor=did["floor"],
        )

    def measure(self, rounds: int) -> list[Stretch]:
        """So many stretches of :data:`SECONDS` each, or shorter ones that end before a flying chain lands."""
        first = self.begin()
        advance = first.simulated / first.tried
        room = round(LONGEST_STRETCH / advance) - 2 * SETTLING_ATTEMPTS
        attempts = max(LAUNCHES, min(round(SECONDS / first.seconds), room))
        stretches = []
        for _ in range(rounds):
            if self.batches[0].time(0) + attempts * advance > LONGEST_STRETCH:
                self.begin()
            stretches.append(self.run(attempts))
        return stretches

    def cost(self, scene: str, method: str, rounds: int) -> GpuCost:
        """Medians of so many measurements."""
        stretches = self.measure(rounds)
        if scene == "flight" and any(stretch.floor for stretch in stretches):
            raise RuntimeError(f"chains of {self.links} links that were to fly came down, with {method}")
        seconds = statistics.median(stretch.seconds for stretch in stretches)
        tried = sum(stretch.tried for stretch in stretches)
        threads = block_threads(self.links)
        kernel, device = block_kernel(self.features, threads), self.batches[0].device
        registers, spilled, blocks = _kernel_needs(kernel, threads, device)
        lanes = FP64_LANES.get(device.arch, math.nan)
        peak = 2 * lanes * device.sm_count * highest_clock(device)
        return GpuCost(
            scene=scene,
            method=method,
            links=self.links,
            chains=self.chains,
            microseconds=1e6 * seconds,
            link_stages=self.links * self.chains * evaluations(method) / seconds,
            chain_seconds=self.chains * sum(stretch.simulated for stretch in stretches) / (tried * seconds),
            rejected=sum(stretch.rejected for stretch in stretches) / tried,
            registers=registers,
            spilled=spilled,
            blocks=blocks,
            occupancy=blocks * threads / 2048,
            peak=self.links * self.chains * flops_per_attempt(method) / seconds / peak,
        )
