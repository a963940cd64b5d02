"""What a step of each method takes, and how far a flight by it ends from where it should.

Identical chains fly for a millisecond, at whose end their error is taken, then on, while they are timed: so the small
steps after the start are not measured. Methods take turns, several times over; medians are reported.
"""

import itertools
import math
import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from warpchain.bench import numpy_model
from warpchain.engine.batch import Batch
from warpchain.engine.devices import gpu_turn, start_device
from warpchain.engine.kernel_choice import block_threads, features_of, load_kernels
from warpchain.inputs.options import Options, on_gpu
from warpchain.inputs.parameters import preset
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.kernels.methods.method import find_method, method_names
from warpchain.run.simulation import simulate
from warpchain.status import Status

Array = NDArray[np.float64]
State = tuple[Array, Array]
"""Position (n, 3) and velocity (n, 3) of a chain."""

PARAMETERS: Final = preset("paper")
SCIPY: Final = "DOP853 (SciPy)"
SCIPY_TOLERANCE: Final = 1e-6
REFERENCE_TOLERANCE: Final = 1e-10
"""Of SciPy's DOP853, whose error is below 1e-9 m/s then; at 1e-12 it follows rounding errors in tiny steps."""
COMPARED_TIME: Final = 1e-3
"""Simulated time [s] after which errors are taken; SciPy needs seconds for it."""
TIMED: Final = 0.05
"""Simulated time [s] at whose end the measurement of a step ends."""


@dataclass(frozen=True)
class StepCost:
    """What a step of a method costs in flight, and how accurate it is.

    Attributes:
        links: n.
        method: An integrator, or `SCIPY` on the NumPy model, without contacts.
        tolerance: Of its steps in flight.
        chains: Chains that fly at the same time.
        microseconds: Wall time of one attempted step of one chain [µs]: that of all chains together by their number.
        step: Mean accepted step [s]; of SciPy mean attempted step.
        rejected: Share of attempted steps that were rejected; NaN for SciPy, which does not tell.
        chain_seconds: Simulated time of all chains per wall time.
        position_error: Greatest error of the position of a link's centre after `COMPARED_TIME` [m].
        velocity_error: The same of its velocity [m/s].
    """

    links: int
    method: str
    tolerance: float
    chains: int
    microseconds: float
    step: float
    rejected: float
    chain_seconds: float
    position_error: float
    velocity_error: float


@dataclass(frozen=True)
class Flight:
    """Identical chains that flew.

    Attributes:
        compared: State of a chain after `COMPARED_TIME`.
        seconds: Wall time from then on [s].
        accepted: Accepted steps of a chain from then on.
        rejected: Rejected attempts of a chain from then on.
    """

    compared: State
    seconds: float
    accepted: int
    rejected: int


def step_costs(
    device: str, *, links: Sequence[int], chains: int, rounds: int, report: Callable[[str], None]
) -> list[StepCost]:
    """Cost and error of all methods of a device at Table 1's parameters and each method's default tolerance.

    Args:
        device: ``"cpu"``, ``"cuda"``, ``"cuda:N"`` or ``"fibers"``.
        links: Numbers of links, even, at least 4.
        chains: Chains that fly at the same time.
        rounds: Measurements of each method.
        report: Called with a line of progress.

    Raises:
        InputError: There is no such device.
        RuntimeError: A flight did not come to its end.
    """
    methods = [name for name in method_names() if find_method(name).runs_on_gpus or not on_gpu(device)]
    flights: dict[tuple[int, str], list[Flight]] = {key: [] for key in itertools.product(links, methods)}
    report("compiling kernels; later runs find them ready")
    _load_kernels(device, flights)
    starts = {n: flying(n, device) for n in links}
    for turn, (n, method) in itertools.product(range(rounds), flights):
        report(f"round {turn + 1} of {rounds}: {n} links, {method}")
        flights[n, method].append(fly(starts[n], method, chains, device))
    costs = []
    for n in links:
        report(f"SciPy's DOP853, {n} links")
        true = numpy_model.fly(*starts[n], COMPARED_TIME, PARAMETERS, REFERENCE_TOLERANCE)
        aim = true.position, true.velocity
        costs += [_cost(n, method, chains, flights[n, method], aim) for method in methods]
        costs.append(_scipy_cost(starts[n], aim))
    return costs


def _load_kernels(device: str, wanted: Iterable[tuple[int, str]]) -> None:
    """Load the kernels of chains of so many links with these methods, compiled at the same time if need be."""
    with gpu_turn([device]):
        found = start_device(device)
        load_kernels(
            (found, _features(method, device, n), block_threads(n) if on_gpu(device) else 1) for n, method in wanted
        )


def flying(links: int, device: str = "cpu") -> State:
    """A circulating ellipse above the floor, whose joints have come to bear their loads."""
    position, velocity = lay_chain(ellipse(1.5), links, PARAMETERS.link_length, speed=5.0)
    position[:, 1] += 0.1 - position[:, 1].min()
    ended = simulate(PARAMETERS, position, velocity, 2e-3, times=[2e-3], method="dp5", tolerance=1e-9, device=device)
    return ended.position[-1], ended.velocity[-1]


def fly(start: State, method: str, chains: int, device: str) -> Flight:
    """Carry identical chains of a batch through the air.

    Raises:
        InputError: There is no such device.
        RuntimeError: A chain did not come to the end.
    """
    worlds = range(chains)
    with gpu_turn([device]):
        batch = Batch(chains, len(start[0]), _options(method, device))
        for world in worlds:
            batch.set_chain(world, PARAMETERS, len(start[0]))
            batch.load(world, *start, stop_time=COMPARED_TIME, stop_status=Status.FINISHED)
        features = _features(method, device, len(start[0]))
        batch.run(worlds, features)
        compared, before = (batch.position(0), batch.velocity(0)), batch.counts(0)
        batch.resume(list(worlds), TIMED, Status.FINISHED)
        began = time.perf_counter()
        batch.run(worlds, features)
        seconds = time.perf_counter() - began
        if (batch.statuses() != Status.FINISHED).any():
            raise RuntimeError(f"{method}: {batch.status(0).sentence}")  # all chains are alike
        after = batch.counts(0)
    return Flight(compared, seconds, *(after[name] - before[name] for name in ("accepted", "rejected")))


def errors(end: State, true: State) -> tuple[float, float]:
    """Greatest distance of a link's centre from where it should be [m], and the same of its velocity [m/s]."""
    position, velocity = (float(np.hypot(*(end[k] - true[k])[:, :2].T).max()) for k in (0, 1))
    return position, velocity


def _options(method: str, device: str) -> Options:
    """Default options of a method."""
    return Options.model_validate({"method": method, "device": device})


def _features(method: str, device: str, links: int) -> Features:
    """What a kernel is compiled for that carries chains above a floor, as of `simulate`."""
    return features_of(_options(method, device), layout.padded_width(links), fixed_body="floor")


def _cost(links: int, method: str, chains: int, flights: Sequence[Flight], true: State) -> StepCost:
    """The cost of a method; all its flights are alike but for their wall times."""
    flight, seconds = flights[0], statistics.median(flight.seconds for flight in flights)
    options, attempts = _options(method, "cpu"), flight.accepted + flight.rejected
    position_error, velocity_error = errors(flight.compared, true)
    return StepCost(
        links=links,
        method=method,
        tolerance=options.flight_tolerance if find_method(method).has_rigid_flight else options.tolerance,
        chains=chains,
        microseconds=1e6 * seconds / (attempts * chains),
        step=(TIMED - COMPARED_TIME) / flight.accepted,
        rejected=flight.rejected / attempts,
        chain_seconds=chains * (TIMED - COMPARED_TIME) / seconds,
        position_error=position_error,
        velocity_error=velocity_error,
    )


def _scipy_cost(start: State, true: State) -> StepCost:
    """The cost of SciPy's DOP853."""
    flight = numpy_model.fly(*start, COMPARED_TIME, PARAMETERS, SCIPY_TOLERANCE)
    position_error, velocity_error = errors((flight.position, flight.velocity), true)
    return StepCost(
        links=len(start[0]),
        method=SCIPY,
        tolerance=SCIPY_TOLERANCE,
        chains=1,
        microseconds=1e6 * flight.seconds / flight.attempts,
        step=COMPARED_TIME / flight.attempts,
        rejected=math.nan,
        chain_seconds=COMPARED_TIME / flight.seconds,
        position_error=position_error,
        velocity_error=velocity_error,
    )
