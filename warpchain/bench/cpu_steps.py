"""Measurements of speed: what a step costs with each method, beside SciPy's solver on the same equations.

Everything that is compared is measured in one run, in turn, several times over; medians are reported.
"""

import math
import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.engine.devices import versions
from warpchain.engine.tallies import COUNTS
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels.methods.method import find_method, method_names
from warpchain.oracle import motion_equations
from warpchain.run.simulation import simulate
from warpchain.status import Status

Array = NDArray[np.float64]

DOP853_STAGES = 12
FAR = 1e9
"""A stop time [s] that no measurement reaches."""
LONGEST_STRETCH = 0.5
"""Simulated time [s] after which a measured chain begins anew: on rigid joints it flies so far that it would land."""
SETTLING_ATTEMPTS = 200
"""Attempts past the first, small steps, which are not measured."""


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
        rejected: Fraction of attempts that were rejected.
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


@dataclass(frozen=True)
class BroadPhaseCost:
    """What building the neighbour list once costs, in a heap of a dropped chain.

    Attributes:
        links: n.
        pairs: Pairs in the list.
        grid_microseconds: By the uniform grid [µs].
        all_pairs_microseconds: By testing every pair [µs].
    """

    links: int
    pairs: int
    grid_microseconds: float
    all_pairs_microseconds: float


def machine() -> dict[str, str]:
    """Processor and versions, for the record of a measurement."""
    model = platform.processor() or platform.machine()
    listing = Path("/proc/cpuinfo")
    if listing.exists():
        names = [line for line in listing.read_text().splitlines() if line.startswith("model name")]
        model = names[0].split(":", 1)[1].strip() if names else model
    return {"processor": model, "system": platform.system()} | versions()


def flying(links: int, parameters: Parameters) -> tuple[Array, Array]:
    """An ellipse circulating at 5 m/s, 5 m above the floor: position (n, 3), velocity (n, 3)."""
    position, velocity = lay_chain(ellipse(1.5), links, parameters.link_length, speed=5.0)
    position[:, 1] += 5.0
    return position, velocity


def dropped(links: int, device: str = "cpu") -> tuple[Array, Array]:
    """A slowly circulating ellipse of soft joints, dropped and come down: position (n, 3), velocity (n, 3)."""
    parameters = preset("soft")
    position, velocity = lay_chain(ellipse(1.5), links, parameters.link_length, speed=0.3)
    position[:, 1] += 0.02 - position[:, 1].min()
    fall = math.sqrt(2 * np.ptp(position[:, 1]) / parameters.gravity)
    end = simulate(parameters, position, velocity, 2 * fall, times=[2 * fall], method="dp5", device=device)
    if end.status != Status.FINISHED:
        raise RuntimeError(f"the chain of {links} links did not come down: {end.status.sentence}")
    return end.position[-1], end.velocity[-1]


def step_costs(
    links: Sequence[int] = (60, 150), attempts: int = 2000, rounds: int = 7, *, report: Callable[[str], None]
) -> list[StepCost]:
    """Cost of a step for each method, in flight and in the pile, at Table 1's parameters and each method's tolerance.

    Args:
        links: Chain lengths.
        attempts: Attempts per measurement.
        rounds: Measurements of each; the methods take turns.
        report: Called with a line when something takes a while.
    """
    parameters = preset("paper")
    runs: dict[tuple[str, str, int], _Stepper] = {}
    scipy_starts: dict[int, tuple[Array, Array]] = {}
    for n in links:
        report(f"dropping a chain of {n} links")
        starts = {"flight": flying(n, parameters), "pile": dropped(n)}
        scipy_starts[n] = starts["flight"]
        for scene, (position, velocity) in starts.items():
            for method in method_names():
                options = Options.model_validate({"method": method})
                runs[scene, method, n] = _Stepper(parameters, options, position, velocity)
    seconds: dict[tuple[str, str, int], list[float]] = {key: [] for key in runs}
    scipy_seconds: dict[int, list[float]] = {n: [] for n in links}
    for turn in range(rounds):
        report(f"round {turn + 1} of {rounds}")
        for key, stepper in runs.items():
            seconds[key].append(stepper.run(attempts))
        for n, (position, velocity) in scipy_starts.items():
            began = time.perf_counter()
            for _ in range(200):
                motion_equations.acceleration(position, velocity, parameters)
            scipy_seconds[n].append((time.perf_counter() - began) / 200 * DOP853_STAGES)
    costs = [
        stepper.cost(scene, method, n, statistics.median(seconds[scene, method, n]))
        for (scene, method, n), stepper in runs.items()
    ]
    for n, (position, velocity) in scipy_starts.items():
        report(f"SciPy's DOP853, {n} links")
        duration = 2e-4
        _, _, calls = motion_equations.solve_flight(
            position, velocity, np.array([0.0, duration]), parameters, rtol=1e-6, atol=1e-6
        )
        per_attempt = statistics.median(scipy_seconds[n])
        taken = calls / DOP853_STAGES
        costs.append(
            StepCost(
                scene="flight",
                method="DOP853 (SciPy)",
                links=n,
                microseconds=per_attempt * 1e6,
                per_link_stage=per_attempt * 1e9 / (n * DOP853_STAGES),
                step=duration / taken,
                rejected=math.nan,
                wall_per_simulated=per_attempt * taken / duration,
            )
        )
    return costs


def broad_phase_costs(
    links: Sequence[int] = (60, 180, 1000), rounds: int = 7, *, report: Callable[[str], None]
) -> list[BroadPhaseCost]:
    """Cost of one neighbour list by grid and by all pairs: steps that rebuild it every time, less steps that never do.

    The chain of 1000 links is a flattened loop on the floor, two layers thick; the others are dropped ones.
    """
    parameters = preset("soft")
    costs = []
    for n in links:
        report(f"neighbour lists of {n} links")
        if n > 200:
            position, velocity = lay_chain(ellipse(0.004), n, parameters.link_length)
            position[:, 1] -= position[:, 1].min() - parameters.circle_radius
        else:
            position, velocity = dropped(n)
        attempts = 200_000 // n
        # a list with no margin is void after each step; a step too short to move keeps both states the same
        options = {"method": "bs32", "contact_step": 1e-9, "smallest_step": 1e-15}
        kept = _Stepper(parameters, Options.model_validate(options), position, velocity)
        void = Options.model_validate(options | {"skin": 1e-15})
        grid = _Stepper(parameters, void, position, velocity)
        pairs = _Stepper(parameters, void, position, velocity, broad_phase="all_pairs")
        seconds: dict[str, list[float]] = {"kept": [], "grid": [], "pairs": []}
        for stepper in (kept, grid, pairs):
            stepper.run(attempts)
        for _ in range(rounds):
            for name, stepper in (("kept", kept), ("grid", grid), ("pairs", pairs)):
                seconds[name].append(1e6 * stepper.run(attempts))
        base = statistics.median(seconds["kept"])
        costs.append(
            BroadPhaseCost(
                links=n,
                pairs=kept.listed_pairs(),
                grid_microseconds=statistics.median(seconds["grid"]) - base,
                all_pairs_microseconds=statistics.median(seconds["pairs"]) - base,
            )
        )
    return costs


def as_json(steps: list[StepCost], broad_phase: list[BroadPhaseCost]) -> dict[str, Any]:
    """Everything measured, with the machine, as JSON has it."""

    def plain(row: StepCost | BroadPhaseCost) -> dict[str, Any]:
        return {name: None if value != value else value for name, value in asdict(row).items()}

    return {
        "machine": machine(),
        "steps": [plain(row) for row in steps],
        "broad_phase": [plain(row) for row in broad_phase],
    }


class _Stepper:
    """One chain, floor and self-contacts on, that is carried on by a given number of attempts at a time."""

    def __init__(
        self,
        parameters: Parameters,
        options: Options,
        position: Array,
        velocity: Array,
        broad_phase: str = "grid",
    ) -> None:
        self.batch = Batch(1, len(position), options)
        self.batch.set_chain(0, parameters, len(position))
        self.features = self.batch.features(fixed_body="floor", watch="none", broad_phase=broad_phase)
        self.batch.compile(self.features)
        self.counts = dict.fromkeys(COUNTS, 0)
        self.simulated = 0.0
        self._start = position, velocity
        self._advance = self._begin()

    def _begin(self) -> float:
        """Put the chain back to its start, past the first steps; returns the mean simulated time of an attempt [s]."""
        self.batch.load(0, *self._start, stop_time=FAR, stop_status=Status.FINISHED)
        self.batch.launch([0], self.features, SETTLING_ATTEMPTS)
        return self.batch.time(0) / SETTLING_ATTEMPTS

    def run(self, attempts: int) -> float:
        """Carry on by so many attempts, or as many as there is room for; returns the wall time of an attempt [s].

        What happens is added to ``counts`` and ``simulated`` [s].
        """
        attempts = max(1, min(attempts, round(LONGEST_STRETCH / self._advance) - SETTLING_ATTEMPTS))
        if self.batch.time(0) + attempts * self._advance > LONGEST_STRETCH:
            self._begin()
        time_before, before = self.batch.time(0), self.batch.counts(0)
        seconds = self.batch.launch([0], self.features, attempts)
        if self.batch.status(0) != Status.RUNNING:
            raise RuntimeError(f"a measured chain stopped: {self.batch.status(0).sentence}")
        self.simulated += self.batch.time(0) - time_before
        for name, count in self.batch.counts(0).items():
            self.counts[name] += count - before[name]
        return seconds / attempts

    def listed_pairs(self) -> int:
        """Pairs in the neighbour list now."""
        return self.batch.listed_pairs(0)

    def cost(self, scene: str, method: str, links: int, seconds: float) -> StepCost:
        """What was measured, at so much wall time [s] an attempt."""
        accepted, attempts = self.counts["accepted"], self.counts["accepted"] + self.counts["rejected"]
        if scene == "flight" and self.counts["floor"]:
            raise RuntimeError(f"a chain of {links} links that was to fly came down, with {method}")
        stages = math.nan if find_method(method).has_rigid_flight else find_method(method).stages
        return StepCost(
            scene=scene,
            method=method,
            links=links,
            microseconds=seconds * 1e6,
            per_link_stage=seconds * 1e9 / (links * stages),
            step=self.simulated / accepted,
            rejected=1 - accepted / attempts,
            wall_per_simulated=seconds * attempts / self.simulated,
        )
