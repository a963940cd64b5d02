"""Error against cost of every method in a flight, an impact and a turn of the sprocket, each chain on one core.

Errors are against a run of ``rkf78`` at tolerance 1e-12 whose steps near contacts are short; what another method at
1e-11 with contact steps twice as long makes of the same says how far that reference can be trusted.

Contacts are looked for after each step and met by hundreds of small impulses, so single links never agree to better
than about a percent of the speed at which they hit. What converges is kept beside them: the impulse of the whole
impact, the chain's angular momentum about the sprocket.
"""

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

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
State = tuple[Array, Array]
"""Position (n, 3) and velocity (n, 3) of a chain."""

ProblemName = Literal["flight", "impact", "sprocket"]
PROBLEMS: Final[tuple[str, ...]] = get_args(ProblemName)
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
    """Something short that every method has to do.

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
    """Distance of the ends of a problem from those of its reference.

    Attributes:
        position: Greatest over links and starts [m].
        velocity: Greatest over links and starts [m/s].
        momentum: See `Problem.momenta`: rms over the starts relative to the rms of the reference; NaN for a flight.
        bias: Mean of the last component of the momenta less the reference's, relative to the latter; NaN for a flight.
    """

    position: float
    velocity: float
    momentum: float
    bias: float


@dataclass(frozen=True)
class Reference:
    """What the errors of a problem are measured against.

    Attributes:
        problem: Name of the problem.
        links: n.
        ends: State at the end of each start.
        trust: How far another method at 1e-11 is from it.
    """

    problem: str
    links: int
    ends: tuple[State, ...]
    trust: Errors


@dataclass(frozen=True)
class Point:
    """One point of a work–precision diagram.

    Attributes:
        problem: One of `PROBLEMS`.
        links: n.
        method: A method of the engine, or one of SciPy on the NumPy model.
        tolerance: Asked for.
        status: Label of how it ended; errors are NaN unless it is ``"finished"``.
        position_error: See `Errors` [m].
        velocity_error: See `Errors` [m/s].
        momentum_error: See `Errors`, relative.
        momentum_bias: See `Errors`, relative.
        simulated: Simulated time of all starts together [s].
        seconds: Processor time of the same [s], the median of several runs: the wall time of a core that does nothing
            else.
        evaluations: Evaluations of the chain's equations in it; None if the method does not count them.
        accepted: Accepted steps in it.
        rejected: Rejected steps in it; None if the solver does not tell.
    """

    problem: str
    links: int
    method: str
    tolerance: float
    status: str
    position_error: float
    velocity_error: float
    momentum_error: float
    momentum_bias: float
    simulated: float
    seconds: float
    evaluations: int | None
    accepted: int
    rejected: int | None


def methods() -> tuple[str, ...]:
    """Every method that the options know, the reference first."""
    return method_names()


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
        end, _ = _run(problem, laid, "rkf78", 1e-9)
        return Problem(name, links, parameters, (end,), problem.duration, "sprocket", -turning)
    count = IMPACTS if name == "impact" else 1
    starts = []
    for number in range(count):
        laid = lay_chain(ellipse(1.5), links, parameters.link_length, speed=5.0, phase=number / count / links)
        free = Problem("flight", links, parameters, (laid,), 2e-3, "none")
        (position, velocity), _ = _run(free, laid, "rkf78", 1e-9)
        drift = (
            motion_equations.linear_momentum(velocity, parameters)
            / motion_equations.link_masses(links, parameters).sum()
        )
        velocity[:, :2] += np.array([0.0, -2.0] if name == "impact" else [2.0, 3.0]) - drift
        ends = np.concatenate(motion_equations.link_ends(position, parameters))
        position[:, 1] -= ends[:, 1].min() - parameters.circle_radius - 5e-4
        starts.append((position, velocity))
    if name == "impact":
        return Problem(name, links, parameters, tuple(starts), IMPACT_TIME, "floor")
    return Problem(name, links, parameters, tuple(starts), FLIGHT_TIME, "none")


def make_reference(problem: Problem) -> Reference:
    """Run the reference of a problem, and another method to tell how far it can be trusted."""
    ends, others = (
        tuple(_run(problem, start, method, tolerance, contact_step=step)[0] for start in problem.starts)
        for method, tolerance, step in (("rkf78", 1e-12, CONTACT_STEP), ("dp5", 1e-11, 2 * CONTACT_STEP))
    )
    return Reference(problem.name, problem.links, ends, errors(problem, others, ends))


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
    seconds: dict[tuple[str, float], list[float]] = {}
    found: dict[tuple[str, float], Point] = {}
    for turn in range(rounds):
        for method in chosen:
            for tolerance in tolerances:
                key = method, tolerance
                if sum(seconds.get(key, [])) > ENOUGH_SECONDS:
                    continue
                report(
                    f"{problem.name}, {problem.links} links: round {turn + 1} of {rounds}, {method} at {tolerance:g}"
                )
                runs = [_run(problem, start, method, tolerance) for start in problem.starts]
                seconds.setdefault(key, []).append(sum(cost["seconds"] for _, cost in runs))
                if key not in found:
                    found[key] = _point(problem, true, method, tolerance, runs)
    return [Point(**{**vars(point), "seconds": statistics.median(seconds[key])}) for key, point in found.items()]


def evaluations(method: str, accepted: int, rejected: int, impulses: int) -> int | None:
    """Evaluations of the chain's equations; None for methods that are no one-step pair of a fixed number of stages.

    Jacobians and solutions of linear systems are not counted.

    A rejected step leaves its first stage to the next attempt. So does an accepted one to the next step if the method
    is so made, unless an impulse came between: then at most one more for each impulse.
    """
    if method not in method_names() or find_method(method).has_rigid_flight:
        return None
    stages, attempts = find_method(method).stages, accepted + rejected
    if find_method(method).reuses_last:
        return attempts * (stages - 1) + 1 + min(impulses, accepted)
    return attempts * (stages - 1) + accepted


def _point(
    problem: Problem, true: Reference, method: str, tolerance: float, runs: Sequence[tuple[State, dict[str, Any]]]
) -> Point:
    ends, costs = zip(*runs, strict=True)
    statuses = [cost["status"] for cost in costs]
    worst = next((status for status in statuses if not status.ok), Status.FINISHED)
    found = errors(problem, ends, true.ends) if worst.ok else Errors(*[math.nan] * 4)
    accepted, rejected = (sum(cost[name] for cost in costs) for name in ("accepted", "rejected"))
    impulses = sum(cost["impulses"] for cost in costs)
    return Point(
        problem=problem.name,
        links=problem.links,
        method=method,
        tolerance=tolerance,
        status=worst.label,
        position_error=found.position,
        velocity_error=found.velocity,
        momentum_error=found.momentum,
        momentum_bias=found.bias,
        simulated=problem.duration * len(problem.starts),
        seconds=math.nan,
        evaluations=evaluations(method, accepted, rejected, impulses),
        accepted=accepted,
        rejected=rejected,
    )


def _run(
    problem: Problem, start: State, method: str, tolerance: float, **settings: float
) -> tuple[State, dict[str, Any]]:
    """Carry one start of a problem to its end: the state there, and status, seconds and counts."""
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
    counts = batch.counts(0)
    cost = {
        "status": batch.status(0),
        "seconds": seconds,
        "accepted": counts["accepted"],
        "rejected": counts["rejected"],
        "impulses": counts["floor"] + counts["sprocket"],
    }
    return (batch.position(0), batch.velocity(0)), cost


def _angular_momentum(state: State, parameters: Parameters) -> float:
    """About the origin [N m s]."""
    (position, velocity), n = state, len(state[0])
    mass, inertia = motion_equations.link_masses(n, parameters), motion_equations.link_inertias(n, parameters)
    orbital = mass * (position[:, 0] * velocity[:, 1] - position[:, 1] * velocity[:, 0])
    return float((orbital + inertia * velocity[:, 2]).sum())
