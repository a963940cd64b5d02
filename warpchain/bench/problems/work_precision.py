"""Error against cost of every method in a flight, an impact and a turn of the sprocket, each chain on one core.

Errors are against a run of ``rkf78`` at tolerance 1e-12 with short steps near contacts. How far ``dp5`` at 1e-11, with
contact steps twice as long, is from that says how far the reference can be trusted.

Contacts are looked for after each step and answered by hundreds of small impulses, so single links never agree to
better than about a percent of the speed at which they hit. Two quantities that do converge are measured beside them:
the impulse of the whole impact, and the chain's angular momentum about the sprocket.
"""

import math
import statistics
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from warpchain.bench.problems.hard_starts import set_down
from warpchain.bench.record import Column
from warpchain.bench.starts import State
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import Scene, check_scene, joint_radius
from warpchain.inputs.start_shapes import ellipse, lay_chain, stadium
from warpchain.inputs.validation import validated
from warpchain.kernels.methods.method import find_method, method_names
from warpchain.oracle import motion_equations
from warpchain.status import Status

Array = NDArray[np.float64]

PROBLEMS: Final = ("flight", "impact", "sprocket")
TOLERANCES: Final = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)

FLIGHT_TIME: Final = 0.05
"""Duration of the flight [s]; short enough for SciPy, long against the 0.1 ms that starting a run takes."""
IMPACT_TIME: Final = 3e-3
"""Duration of an impact [s]; the first circle touches the floor after a quarter of a millisecond."""
IMPACTS: Final = 8
"""Impacts, which differ in where the links are along the loop."""
FREQUENCY: Final = 15.0
"""Turns of the sprocket per second [Hz]."""
CONTACT_STEP: Final = 1e-7
"""Longest step [s] near a contact of the reference."""
ENOUGH_SECONDS: Final = 2.0
"""A run that has taken this long in all [s] is not timed again."""


@dataclass(frozen=True)
class Problem:
    """A short simulation that every method has to do.

    Attributes:
        name: One of `PROBLEMS`.
        links: n.
        parameters: Of the chain.
        starts: States that it begins in; each is run by itself.
        duration: Simulated time of each [s].
        fixed_body: What there is to hit: ``"none"``, ``"floor"`` or ``"sprocket"``.
        sprocket_speed: Angular velocity of the sprocket [rad/s].
    """

    name: str
    links: int
    parameters: Parameters
    starts: tuple[State, ...]
    duration: float
    fixed_body: str
    sprocket_speed: float = 0.0

    def momenta(self, ends: Sequence[State]) -> Array | None:
        """What converges although contacts do not, a row for each start; None for a flight.

        Impact: the floor's impulse on the chain (x, y) [N s]. Sprocket: the angular momentum about its centre [N m s].
        """
        if self.name == "impact":
            mass = motion_equations.link_masses(self.links, self.parameters).sum()
            fall = np.array([0.0, mass * self.parameters.gravity * self.duration])
            gained = [
                motion_equations.linear_momentum(end[1], self.parameters)
                - motion_equations.linear_momentum(start[1], self.parameters)
                for start, end in zip(self.starts, ends, strict=True)
            ]
            impulses: Array = np.array(gained) + fall
            return impulses
        if self.name == "sprocket":
            return np.array([[_angular_momentum(end, self.parameters)] for end in ends])
        return None


@dataclass(frozen=True)
class Errors:
    """Distance of the ends of a problem from those of its reference; NaN where there is no such distance."""

    position_error: Annotated[float, Column("m", "greatest error of the position of a link's centre at the end")]
    velocity_error: Annotated[float, Column("m/s", "greatest error of the velocity of a link's centre at the end")]
    momentum_error: Annotated[
        float,
        Column(
            "1",
            "impact: of the floor's impulse on the chain, rms over the impacts; sprocket: of the angular momentum "
            "about its centre; relative to the reference's",
        ),
    ]
    momentum_bias: Annotated[
        float, Column("1", "mean relative error of the vertical impulse or the angular momentum, with its sign")
    ]


@dataclass(frozen=True)
class Reference:
    """What the errors of a problem are measured against.

    Attributes:
        ends: State at the end of each start.
        trust: How far another method at 1e-11 is from it.
    """

    ends: tuple[State, ...]
    trust: Errors


@dataclass(frozen=True)
class Point(Errors):
    """One point of a work–precision diagram; errors are NaN unless the run finished."""

    problem: Annotated[
        str, Column("1", "flight: a circulating ellipse thrown; impact: it hits the floor; sprocket: one turn at 15 Hz")
    ]
    links: Annotated[int, Column("1", "number of links")]
    method: Annotated[str, Column("1", "method of the engine, or of SciPy on the NumPy model")]
    tolerance: Annotated[float, Column("1", "tolerance asked for, absolute in SI units and relative alike")]
    status: Annotated[str, Column("1", "how it ended")]
    simulated: Annotated[float, Column("s", "simulated time of all starts together")]
    seconds: Annotated[
        float, Column("s", "processor time of that, median of the rounds; of a run that failed, up to then")
    ]
    evaluations: Annotated[
        int | None, Column("1", "evaluations of the chain's equations in it; null if the method does not count them")
    ]
    accepted: Annotated[int, Column("1", "accepted steps in it")]
    rejected: Annotated[int | None, Column("1", "rejected steps in it; null if the solver does not tell")]


def make_problem(name: str, links: int) -> Problem:
    """Set a problem up, at Table 1's values.

    Every start has been carried on for a while by ``rkf78``, so that the joints bear their loads when it begins.

    Raises:
        InputError: The chain is too short for the sprocket.
    """
    parameters = preset("paper")
    if name == "sprocket":
        scene = Scene(links=links, frequency=FREQUENCY, start="spinning")
        check_scene(scene, parameters)
        radius, turning = joint_radius(scene, parameters), 2 * math.pi * FREQUENCY
        laid = lay_chain(stadium(radius), links, parameters.link_length, turning * radius)
        problem = Problem(name, links, parameters, (laid,), 1 / FREQUENCY, "sprocket", -turning)
        return replace(problem, starts=(_run(problem, laid, "rkf78", 1e-9).end,))
    count = IMPACTS if name == "impact" else 1
    starts = []
    for number in range(count):
        laid = lay_chain(ellipse(1.5), links, parameters.link_length, speed=5.0, phase=number / count / links)
        free = Problem("flight", links, parameters, (laid,), 2e-3, "none")
        position, velocity = _run(free, laid, "rkf78", 1e-9).end
        drift = (
            motion_equations.linear_momentum(velocity, parameters)
            / motion_equations.link_masses(links, parameters).sum()
        )
        velocity[:, :2] += np.array([0.0, -2.0] if name == "impact" else [2.0, 3.0]) - drift
        starts.append((set_down(position, 5e-4, parameters), velocity))
    duration, fixed_body = (IMPACT_TIME, "floor") if name == "impact" else (FLIGHT_TIME, "none")
    return Problem(name, links, parameters, tuple(starts), duration, fixed_body)


def make_reference(problem: Problem) -> Reference:
    """Run the reference of a problem, and another method to tell how far it can be trusted."""
    ends, others = (
        tuple(_run(problem, start, method, tolerance, contact_step=step).end for start in problem.starts)
        for method, tolerance, step in (("rkf78", 1e-12, CONTACT_STEP), ("dp5", 1e-11, 2 * CONTACT_STEP))
    )
    return Reference(ends, errors(problem, others, ends))


def errors(problem: Problem, ends: Sequence[State], true: Sequence[State]) -> Errors:
    """Compare the ends of a problem with true ones."""
    position, velocity = (
        max(float(np.linalg.norm((end[k] - aim[k])[:, :2], axis=1).max()) for end, aim in zip(ends, true, strict=True))
        for k in (0, 1)
    )
    momenta, aims = problem.momenta(ends), problem.momenta(true)
    if momenta is None or aims is None:
        return Errors(position, velocity, math.nan, math.nan)
    relative = math.sqrt(float(((momenta - aims) ** 2).sum() / (aims**2).sum()))
    return Errors(position, velocity, relative, float(momenta[:, -1].mean() / aims[:, -1].mean()) - 1)


def points(
    problem: Problem,
    true: Reference,
    chosen: Sequence[str],
    tolerances: Sequence[float],
    rounds: int,
    report: Callable[[str], None],
) -> list[Point]:
    """Run a problem with each method at each tolerance, the methods taking turns in several rounds.

    Args:
        problem: What is run.
        true: Its reference.
        chosen: Methods.
        tolerances: Of each.
        rounds: Measurements of each; the median counts. What takes long is not repeated.
        report: Called with a line of progress.
    """
    done: dict[tuple[str, float], list[list[_Run]]] = {(name, tol): [] for name in chosen for tol in tolerances}
    for turn in range(rounds):
        for (method, tolerance), runs in done.items():
            if sum(run.seconds for once in runs for run in once) > ENOUGH_SECONDS:
                continue
            report(f"{problem.name}, {problem.links} links: round {turn + 1} of {rounds}, {method} at {tolerance:g}")
            runs.append([_run(problem, start, method, tolerance) for start in problem.starts])
    return [_engine_point(problem, true, *key, runs) for key, runs in done.items()]


def evaluations(method: str, accepted: int, rejected: int, impulses: int) -> int | None:
    """Evaluations of the chain's equations; None for methods that are no one-step pair of a fixed number of stages.

    Jacobians and solutions of linear systems are not counted.

    A rejected step leaves its first stage to the next attempt. So does an accepted one to the next step if the method
    is so made, unless an impulse came between: then at most one more for each impulse.
    """
    if method not in method_names() or find_method(method).has_rigid_flight:
        return None
    facts, attempts = find_method(method), accepted + rejected
    if facts.reuses_last:
        return attempts * (facts.stages - 1) + 1 + min(impulses, accepted)
    return attempts * (facts.stages - 1) + accepted


def make_point(
    problem: Problem, true: Reference, ends: Sequence[State] | None, method: str, tolerance: float, **columns: Any
) -> Point:
    """The point of a run that ended in these states; None if it did not finish."""
    return Point(
        **vars(errors(problem, ends, true.ends) if ends is not None else Errors(*[math.nan] * 4)),
        problem=problem.name,
        links=problem.links,
        method=method,
        tolerance=tolerance,
        simulated=problem.duration * len(problem.starts),
        **columns,
    )


class _Run(NamedTuple):
    """A start of a problem that has been carried on: the state reached, processor time [s], counters of the engine."""

    end: State
    status: Status
    seconds: float
    counts: dict[str, int]


def _engine_point(
    problem: Problem, true: Reference, method: str, tolerance: float, rounds: Sequence[Sequence[_Run]]
) -> Point:
    """The point of a method of the engine; all rounds are alike but for their times."""
    runs = rounds[0]
    worst = next((run.status for run in runs if not run.status.ok), Status.FINISHED)
    counts = sum((Counter(run.counts) for run in runs), Counter[str]())
    accepted, rejected = counts["accepted"], counts["rejected"]
    return make_point(
        problem,
        true,
        [run.end for run in runs] if worst.ok else None,
        method,
        tolerance,
        status=worst.label,
        seconds=statistics.median(sum(run.seconds for run in once) for once in rounds),
        evaluations=evaluations(method, accepted, rejected, counts["floor"] + counts["sprocket"]),
        accepted=accepted,
        rejected=rejected,
    )


def _run(problem: Problem, start: State, method: str, tolerance: float, **settings: float) -> _Run:
    """Carry one start of a problem to its end."""
    given = {"method": method, "tolerance": tolerance, "flight_tolerance": tolerance, "self_contact": False, **settings}
    batch = Batch(1, problem.links, validated(Options, given, "options"))
    batch.set_chain(0, problem.parameters, problem.links)
    batch.load(0, *start, stop_time=problem.duration, stop_status=Status.FINISHED)
    batch.set_drive(0, sprocket_speed=problem.sprocket_speed)
    features = batch.features(fixed_body=problem.fixed_body, watch="none")
    batch.compile(features, [problem.links])
    began = time.process_time()
    batch.run([0], features)
    seconds = time.process_time() - began
    return _Run((batch.position(0), batch.velocity(0)), batch.status(0), seconds, batch.counts(0))


def _angular_momentum(state: State, parameters: Parameters) -> float:
    """About the origin [N m s]."""
    (position, velocity), n = state, len(state[0])
    mass, inertia = motion_equations.link_masses(n, parameters), motion_equations.link_inertias(n, parameters)
    orbital = mass * (position[:, 0] * velocity[:, 1] - position[:, 1] * velocity[:, 0])
    return float((orbital + inertia * velocity[:, 2]).sum())
