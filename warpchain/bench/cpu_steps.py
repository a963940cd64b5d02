"""What a step costs on one core with each method, beside SciPy's solver on the same equations; cost of neighbour lists.

Whatever is compared is measured in one run, in turn and several times over; medians are reported.
"""

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from warpchain.bench.chain_timer import ChainTimer, Stretch, together
from warpchain.bench.starts import flying, piled
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels.methods.method import find_method, method_names
from warpchain.oracle import motion_equations

DOP853_STAGES: Final = 12
SCIPY_EVALUATIONS: Final = 200
"""Evaluations of the NumPy model in a measurement."""
SCIPY_TIME: Final = 2e-4
"""Simulated time [s] of SciPy's flight."""


@dataclass(frozen=True)
class StepCost:
    """What a step of one method costs.

    Attributes:
        scene: ``"flight"`` (a circulating ellipse, floor and self-contacts watched for) or ``"pile"`` (a chain that
            was dropped and has come down, tens of impulses a step).
        method: A method of the engine, or ``"DOP853 (SciPy)"`` on the NumPy model in flight, without contacts.
        links: n.
        microseconds: Median time per attempt [µs].
        per_link_stage: The same per link and stage [ns]; NaN where attempts are of two kinds.
        step: Mean accepted step [s].
        rejected: Fraction of attempts that were rejected; NaN for SciPy, which does not tell.
        wall_per_simulated: Seconds of one core per simulated second.
    """

    scene: str
    method: str
    links: int
    microseconds: float
    per_link_stage: float
    step: float
    rejected: float
    wall_per_simulated: float

    @property
    def step_microseconds(self) -> float:
        """Mean accepted step [µs]."""
        return 1e6 * self.step


@dataclass(frozen=True)
class BroadPhaseCost:
    """What building the neighbour list of a dropped chain once costs.

    Attributes:
        links: n.
        pairs: Pairs in the list.
        grid_microseconds: By the uniform grid [µs].
    """

    links: int
    pairs: int
    grid_microseconds: float


def step_costs(
    links: Sequence[int] = (60, 150), attempts: int = 2000, rounds: int = 7, *, report: Callable[[str], None]
) -> list[StepCost]:
    """Cost of a step for each method, in flight and in the pile, at Table 1's parameters and each method's tolerance.

    Args:
        links: Chain lengths.
        attempts: Attempts per measurement.
        rounds: Measurements of each; the methods take turns.
        report: Called with a line of progress.
    """
    parameters = preset("paper")
    flights = {n: flying(n, parameters) for n in links}
    timers: dict[tuple[str, str, int], ChainTimer] = {}
    for n in links:
        report(f"dropping a chain of {n} links")
        for scene, start in (("flight", flights[n]), ("pile", piled(n))):
            for method in method_names():
                timers[scene, method, n] = ChainTimer(parameters, Options.model_validate({"method": method}), start)
    stretches: dict[tuple[str, str, int], list[Stretch]] = {key: [] for key in timers}
    scipy_seconds: dict[int, list[float]] = {n: [] for n in links}
    for turn in range(rounds):
        report(f"round {turn + 1} of {rounds}")
        for key, timer in timers.items():
            stretches[key].append(timer.measure(attempts))
        for n, (position, velocity) in flights.items():
            began = time.perf_counter()
            for _ in range(SCIPY_EVALUATIONS):
                motion_equations.acceleration(position, velocity, parameters)
            scipy_seconds[n].append((time.perf_counter() - began) / SCIPY_EVALUATIONS * DOP853_STAGES)
    costs = [
        step_cost(scene, method, n, together(scene, own), _stages(method))
        for (scene, method, n), own in stretches.items()
    ]
    for n, start in flights.items():
        report(f"SciPy's DOP853, {n} links")
        times = np.array([0.0, SCIPY_TIME])
        _, _, calls = motion_equations.solve_flight(*start, times, parameters, rtol=1e-6, atol=1e-6)
        whole = Stretch(statistics.median(scipy_seconds[n]), SCIPY_TIME, calls / DOP853_STAGES, 0, 0)
        cost = step_cost("flight", "DOP853 (SciPy)", n, whole, DOP853_STAGES)
        costs.append(replace(cost, rejected=math.nan))  # solve_ivp does not tell
    return sorted(costs, key=lambda cost: (cost.scene, cost.links))


def step_cost(scene: str, method: str, links: int, whole: Stretch, stages: float) -> StepCost:
    """What a step cost in a measurement of one chain."""
    return StepCost(
        scene=scene,
        method=method,
        links=links,
        microseconds=whole.seconds * 1e6,
        per_link_stage=whole.seconds * 1e9 / (links * stages),
        step=whole.simulated / whole.accepted,
        rejected=1 - whole.accepted / whole.attempts,
        wall_per_simulated=whole.seconds * whole.attempts / whole.simulated,
    )


def _stages(method: str) -> float:
    """Stages of an attempt; NaN where attempts are of two kinds."""
    facts = find_method(method)
    return math.nan if facts.has_rigid_flight else facts.stages


def broad_phase_costs(
    links: Sequence[int] = (60, 180, 1000), rounds: int = 7, *, report: Callable[[str], None]
) -> list[BroadPhaseCost]:
    """Cost of one neighbour list by grid: of steps that rebuild it, less that of steps that never do.

    Chains of more than 200 links are flattened loops on the floor, two layers thick; shorter ones have been dropped.
    """
    parameters = preset("soft")
    # a list with no margin is void after each step; a step too short to move keeps both states the same
    still = {"method": "bs32", "contact_step": 1e-9, "smallest_step": 1e-15}
    kept, void = Options.model_validate(still), Options.model_validate(still | {"skin": 1e-15})
    costs = []
    for n in links:
        report(f"neighbour lists of {n} links")
        if n > 200:
            position, velocity = lay_chain(ellipse(0.004), n, parameters.link_length)
            position[:, 1] -= position[:, 1].min() - parameters.circle_radius
        else:
            position, velocity = piled(n)
        attempts = 200_000 // n
        timers = {
            "kept": ChainTimer(parameters, kept, (position, velocity)),
            "grid": ChainTimer(parameters, void, (position, velocity)),
        }
        seconds: dict[str, list[float]] = {name: [] for name in timers}
        for timer in timers.values():
            timer.measure(attempts)
        for _ in range(rounds):
            for name, timer in timers.items():
                seconds[name].append(1e6 * timer.measure(attempts).seconds)
        base = statistics.median(seconds["kept"])
        costs.append(
            BroadPhaseCost(
                links=n,
                pairs=timers["kept"].batches[0].listed_pairs(0),
                grid_microseconds=statistics.median(seconds["grid"]) - base,
            )
        )
    return costs
