"""Cases that break careless integrators, defined once for the tests and for the table of ``warpchain bench accuracy``.

Whatever the method, each must end with a sound result or a clear status: never with a silent NaN, a hang or a wrong
number.
"""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.bench.problems.hard_starts import (
    ELASTIC,
    PAPER,
    SOFT,
    UNDISSIPATIVE,
    dropped,
    dropped_circle,
    energy_error,
    folded,
    ledger_error,
    overlapping,
    pulled_apart,
    reversing_loop,
    turning_joints,
)
from warpchain.bench.record import Column
from warpchain.bench.starts import State
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError, validated
from warpchain.oracle import motion_equations
from warpchain.run.simulation import simulate
from warpchain.run.single_walk import run_walk, setup_walk
from warpchain.status import Status
from warpchain.walks.scheduler import compile_kernels
from warpchain.walks.trajectory import Trajectory
from warpchain.walks.walk_result import WalkResult

Array = NDArray[np.float64]

REFUSED: Final = "refused"
"""Status of what was not run."""
LIMITS: Final = {"step_limit": 20_000_000, "tolerance": 1e-6, "flight_tolerance": 1e-4}
"""Options of every case that says nothing else; a case that takes more attempts counts as hanging.

The energy error of `hybrid` follows the tolerance of its flights, too.
"""

BOUNCING: Final = partial(dropped, links=6, fall=0.0, gap=0.02)
"""Start of a chain that bounces for as long as nothing dissipates."""

IMPOSSIBLE: Final[tuple[tuple[str, Mapping[str, object]], ...]] = (
    ("scene.links", {"links": 61}),
    ("scene.links", {"links": 20}),  # too short for the sprocket
    ("parameters.circle_radius", {"circle_radius": 6.34e-3}),
    ("parameters.inner_mass", {"inner_mass": -1e-3}),
    ("parameters.gravity", {"gravity": math.nan}),
)
"""Values of a walk that cannot be, each after the field that the refusal names."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a case ended with a method."""

    status: Annotated[str, Column("1", "how it ended; refused if nothing was run")]
    result: Annotated[str, Column("1", "what came out")]
    seconds: Annotated[float, Column("s", "processor time, compilation apart")]
    simulated: Annotated[float, Column("s", "simulated time")] = 0.0
    attempts: Annotated[int, Column("1", "attempted steps")] = 0
    energy_error: Annotated[
        float, Column("1", "what the energy ledger leaves open, as a fraction of the energy; null if there is none")
    ] = math.nan
    sound: Annotated[bool, Column("1", "whether status, result and energy are such as the case may have")]


@dataclass(frozen=True)
class Flight:
    """A chain from a given state, with the floor: how long [s], how it may end, and its greatest `energy_error`."""

    parameters: Parameters
    start: Callable[[], State]
    duration: float
    expected: tuple[Status, ...] = (Status.FINISHED,)
    bound: float = 1e-4
    settings: Mapping[str, Any] = field(default_factory=dict)

    def simulate(self, method: str) -> tuple[Trajectory, float]:
        """The flight, and the processor time [s] that it took."""
        start, settings = self.start(), {"method": method, **LIMITS, **self.settings}
        simulate(self.parameters, *start, 0.0, times=[0.0], **settings)  # compiles
        began = time.process_time()
        flight = simulate(self.parameters, *start, self.duration, times=[self.duration], **settings)
        return flight, time.process_time() - began

    def run(self, method: str) -> Outcome:
        """Simulate; a finite end, an expected status and a small energy error are sound."""
        flight, seconds = self.simulate(method)
        with np.errstate(all="ignore"):
            error = energy_error(flight, self.parameters, self.start())
        finite = bool(np.all(np.isfinite(flight.position)) and np.all(np.isfinite(flight.velocity)))
        return Outcome(
            status=flight.status.label,
            result=f"{flight.impulses['floor']} floor and {flight.impulses['self']} self-impulses",
            seconds=seconds,
            simulated=float(flight.time[-1]),
            attempts=flight.steps_accepted + flight.steps_rejected,
            energy_error=error,
            sound=flight.status in self.expected and finite and error < self.bound,
        )


@dataclass(frozen=True)
class Walk:
    """A whole walk: its setup, the bounds of its Δx [m], how it must end, and its greatest `ledger_error`."""

    preset: str
    settings: Mapping[str, Any]
    distance: tuple[float, float] = (-math.inf, math.inf)
    expected: Status = Status.AT_REST
    bound: float = 5e-4  # the losses of a method of third order at 1e-6 are that good after half a million impulses

    def simulate(self, method: str) -> tuple[WalkResult, float]:
        """The walk, and the processor time [s] that it took."""
        setup = setup_walk(self.preset, {"method": method, **LIMITS, **self.settings}, None)
        compile_kernels([setup])
        began = time.process_time()
        walk = run_walk(setup, frame_interval=None)
        return walk, time.process_time() - began

    def run(self, method: str) -> Outcome:
        """Walk; the expected status, a Δx within its bounds and a small energy error are sound."""
        walk, seconds = self.simulate(method)
        error = ledger_error(walk)
        within = self.expected != Status.AT_REST or self.distance[0] < walk.dx < self.distance[1]
        return Outcome(
            status=walk.status.label,
            result=f"Δx = {walk.dx:.3f} m" if math.isfinite(walk.dx) else f"moving after {walk.walk_time:.3g} s",
            seconds=seconds,
            simulated=walk.simulated_time,
            attempts=walk.steps_accepted + walk.steps_rejected,
            energy_error=error,
            sound=walk.status == self.expected and within and error < self.bound,
        )


@dataclass(frozen=True)
class Order:
    """Undamped springs that bounce with ever shorter fixed steps: the energy's drift falls as a power of the step."""

    steps: tuple[float, ...] = (8e-5, 6e-5, 4e-5, 2e-5, 1e-5, 5e-6, 2.5e-6, 1.25e-6)

    def run(self, method: str) -> Outcome:
        """Fit the power over the steps that are neither unstable nor at rounding."""
        energy = motion_equations.total_energy(*BOUNCING(), ELASTIC)
        drifts, statuses, attempts, seconds = [], [], 0, 0.0
        for step in self.steps:
            # a skin beyond the height of the fall makes contact_step, not the loose tolerance, set the step
            settings = {"tolerance": 0.1, "skin": 3.0, "contact_step": step}
            flight, cost = Flight(ELASTIC, BOUNCING, 0.3, settings=settings).simulate(method)
            seconds += cost
            attempts += flight.steps_accepted + flight.steps_rejected
            statuses.append(flight.status)
            end = motion_equations.total_energy(flight.position[-1], flight.velocity[-1], ELASTIC)
            drifts.append(abs(energy - end) / energy)
        seen = [(step, drift) for step, drift in zip(self.steps, drifts, strict=True) if 1e-10 < drift < 1e-2]
        power = _slope(np.log(np.array(seen))) if len(seen) > 1 else math.nan
        return Outcome(
            status=next((status for status in statuses if not status.ok), Status.FINISHED).label,
            result="too few steps for a slope" if math.isnan(power) else f"drift of the energy ∝ h^{power:.1f}",
            seconds=seconds,
            simulated=0.3 * len(self.steps),
            attempts=attempts,
            energy_error=drifts[-1],
            sound=set(statuses) == {Status.FINISHED} and drifts[-1] < 1e-2 and not power <= 2,
        )


@dataclass(frozen=True)
class Refusals:
    """Parameters that cannot be: refused before any kernel runs, in a line that begins with the field."""

    def run(self, method: str) -> Outcome:
        """Ask for each."""
        named = 0
        began = time.process_time()
        for path, values in IMPOSSIBLE:
            try:
                setup_walk("soft", {"method": method, **values}, None)
            except InputError as error:
                named += str(error).startswith(f"{path}: ")
        return Outcome(
            status=REFUSED,
            result=f"{named} of {len(IMPOSSIBLE)} refused, naming the field",
            seconds=time.process_time() - began,
            sound=named == len(IMPOSSIBLE),
        )


@dataclass(frozen=True)
class OneBroken:
    """A thousand chains in one batch, with and without a NaN in one of them."""

    worlds: int = 1000
    duration: float = 1e-3

    def run(self, method: str) -> Outcome:
        """The broken one gets its status, the others the same bits as without it."""
        broken = self.worlds // 2
        whole, _ = self._carried_on(method, None)
        batch, seconds = self._carried_on(method, broken)
        others = [world for world in range(self.worlds) if world != broken]
        same = sum(np.array_equal(_state(whole, world), _state(batch, world)) for world in others)
        finished = all(batch.status(world) == Status.FINISHED for world in others)
        return Outcome(
            status=batch.status(broken).label,
            result=f"{same} of {len(others)} others unchanged to the bit",
            seconds=seconds,
            simulated=self.duration * self.worlds,
            attempts=sum(batch.attempts(world) for world in range(self.worlds)),
            sound=finished and same == len(others) and not batch.status(broken).ok,
        )

    def _carried_on(self, method: str, broken: int | None) -> tuple[Batch, float]:
        """The batch at its end, and the processor time [s] that it took."""
        batch = Batch(self.worlds, 8, validated(Options, {"method": method, "step_limit": 1_000_000}, "options"))
        for world in range(self.worlds):
            position, velocity = dropped(fall=0.5 + world / self.worlds)
            if world == broken:
                velocity[3, 2] = np.nan
            batch.set_chain(world, SOFT, 8)
            batch.load(world, position, velocity, stop_time=self.duration, stop_status=Status.FINISHED)
        features = batch.features(fixed_body="floor", watch="none")
        batch.compile(features, [8])
        began = time.process_time()
        batch.run(range(self.worlds), features)
        return batch, time.process_time() - began


Subject = Flight | Walk | Order | Refusals | OneBroken


@dataclass(frozen=True)
class HardCase:
    """A case of the table.

    Attributes:
        group: The kind of difficulty.
        name: Short and unique, good for a file.
        what: What happens, for people.
        subject: What is run.
    """

    group: str
    name: str
    what: str
    subject: Subject

    def outcome(self, method: str) -> Outcome:
        """How the case ends with a method; one that the engine refuses is not sound, its result the reason."""
        try:
            return self.subject.run(method)
        except InputError as error:
            return Outcome(status=REFUSED, result=str(error), seconds=0.0, sound=False)


def _drop(name: str, links: int) -> Walk:
    """An upright ellipse at rest that is let go."""
    settings = {"links": links, "frequency": 0.0, "start": "ellipse", "ellipse_aspect": 2.0}
    return Walk(name, settings, distance=(-0.03, 0.03))


def _impact(parameters: Parameters, values: Mapping[str, object], duration: float, bound: float = 1e-5) -> Flight:
    """An impact with other values of the joints."""
    return Flight(parameters.with_values(values), partial(dropped, gap=5e-5), duration, bound=bound)


def _elastic(friction: float, distance: tuple[float, float]) -> Walk:
    """A walk of 20 links with elastic collisions and this coefficient of friction."""
    values = {
        **dict.fromkeys(["floor_restitution", "chain_restitution"], 1.0),
        **dict.fromkeys(["floor_friction", "chain_friction"], friction),
    }
    return Walk("soft", {"links": 20, "frequency": 10.0, "start": "ellipse", **values}, distance=distance)


_CASES: Final[dict[str, dict[str, tuple[str, Subject]]]] = {
    "the pile": {
        "pile-slow-walk": (
            "180 links released at 5 Hz fall into a pile beside the sprocket (soft)",
            Walk("soft", {"links": 180, "frequency": 5.0, "start": "spinning"}, distance=(0.0, 0.3)),
        ),
        "pile-dropped-soft": ("180 links dropped without spin, to rest (soft)", _drop("soft", 180)),
        "pile-dropped-paper": ("60 links dropped without spin, to rest (paper)", _drop("paper", 60)),
    },
    "stiffness": {
        "softest-springs": ("impact with k = 1e5 N/m", _impact(PAPER, {"joint_stiffness": 1e5}, 1e-2)),
        "stiffest-springs": ("impact with k = 1e11 N/m", _impact(PAPER, {"joint_stiffness": 1e11}, 1e-3)),
        "no-damping": ("impact with b = 0 (soft)", _impact(SOFT, {"joint_damping": 0.0}, 1e-2, bound=3e-4)),
        "stiff-damping": ("impact with b = 1e6 N s/m (soft)", _impact(SOFT, {"joint_damping": 1e6}, 1e-4)),
        "hopeless-damping": (
            "impact with b = 1e9 N s/m and 20,000 steps at most: finished, or a limit that says so",
            Flight(
                SOFT.with_values({"joint_damping": 1e9}),
                dropped,
                1e-2,
                expected=(Status.FINISHED, Status.STEP_LIMIT, Status.STEP_TOO_SMALL),
                settings={"step_limit": 20_000},
            ),
        ),
        "sharp-friction": (
            "joints stop turning with ω_c = 1e-6 rad/s",
            Flight(PAPER.with_values({"friction_smoothing": 1e-6, "gravity": 0.0}), turning_joints, 1e-4),
        ),
        "reversing-joints": (
            "joints of a loop reverse within the first microseconds (paper)",
            Flight(PAPER, reversing_loop, 1e-3),
        ),
    },
    "no dissipation": {
        "elastic-second": (
            "bouncing for 1 s without any dissipation keeps the energy (tolerance 1e-8)",
            Flight(ELASTIC, BOUNCING, 1.0, bound=1e-2, settings={"tolerance": 1e-8}),
        ),
        "elastic-order": ("the same for 0.3 s with fixed steps: order of convergence", Order()),
    },
    "short and long": {
        **{
            f"links-{links}": (
                f"a walk of {links} links at 4 Hz from an ellipse (soft)",
                Walk("soft", {"links": links, "frequency": 4.0, "start": "ellipse"}, distance=(0.0, 0.5)),
            )
            for links in (4, 6, 8)
        },
        "links-1000": ("1000 links hit the floor (soft)", Flight(SOFT, partial(dropped_circle, 1000), 5e-3)),
    },
    "fast and slow": {
        "sixty-hertz": (
            "a walk of 60 links at 60 Hz, where the loop slips on its sprocket and is never stationary to 1 % (soft)",
            Walk(
                "soft",
                {"links": 60, "frequency": 60.0, "start": "spinning", "steady_time": 0.1, "steady_tolerance": 0.03},
                distance=(10.0, 40.0),
            ),
        ),
        "standing": (
            "60 links hang on a sprocket at rest and are let go (soft)",
            Walk("soft", {"links": 60, "frequency": 0.0, "start": "rest"}, distance=(-0.03, 0.03)),
        ),
    },
    "bad starts": {
        "pulled-apart": ("joints open by 0.1 mm: 40 J", Flight(PAPER, pulled_apart, 2e-3)),
        "overlapping": ("links start inside each other (soft)", Flight(SOFT, overlapping, 5e-3)),
        "in-the-floor": (
            "starts 0.3 m below the floor (soft)",
            Flight(SOFT, partial(dropped, gap=-0.3), 5e-3, bound=1e-5),
        ),
    },
    "folded": {
        "folded": (
            "20 links folded back by 180° at both ends, strands exactly on each other (paper)",
            Flight(PAPER, partial(folded, 20, PAPER.circle_radius + 2e-5), 5e-3),
        ),
    },
    "collision law": {
        "endless-bouncing": (
            "a walk that nothing brings to rest: the time limit",
            Walk(
                "soft",
                {"links": 6, "frequency": 2.0, "start": "ellipse", "walk_limit": 0.3, **UNDISSIPATIVE},
                expected=Status.TIME_LIMIT,
                bound=1e-2,
            ),
        ),
        "elastic-floor-friction-0": ("a walk of 20 links with e = 1 and μ = 0 (soft)", _elastic(0.0, (-1e-9, 1e-9))),
        "elastic-floor-friction-1": ("a walk of 20 links with e = 1 and μ = 1 (soft)", _elastic(1.0, (0.1, 1.0))),
    },
    "what cannot be": {"refused": ("odd n, too short a chain, r ≥ ℓ/2, negative mass, NaN", Refusals())},
    "one broken": {"one-broken": ("a NaN in one of 1000 chains of a batch", OneBroken())},
}
"""Kind of difficulty → short name → what happens, and what is run."""

HARD_CASES: Final = tuple(
    HardCase(group, name, what, subject) for group, cases in _CASES.items() for name, (what, subject) in cases.items()
)


def _state(batch: Batch, world: int) -> Array:
    """Position and velocity of a world, (2, n, 3)."""
    return np.array([batch.position(world), batch.velocity(world)])


def _slope(points: Array) -> float:
    """Slope of the straight line that fits points (p, 2) best."""
    x, y = (points - points.mean(axis=0)).T
    return float(x @ y / (x @ x))
