"""Joints that reverse within a step: which methods see the kink that this makes in the right-hand side.

Joint friction τ_c tanh(w/ω_c) changes its sign while the relative angular velocity w of two links passes from −ω_c to
ω_c. At Table 1's ω_c, springs that ring after an impact reverse joints in a small fraction of a step: the right-hand
side jumps inside the step.

Fehlberg's estimate of a step's error is h · 41/840 · (k₁ + k₁₁ − k₁₂ − k₁₃), of stages at the times 0, 1, 0 and 1 of
the step. If the right-hand side depends on the time only, k₁ = k₁₂ and k₁₁ = k₁₃: the estimate is zero, whatever the
error. A jump at a given time is of this kind. What `rkf78` sees of it is what comes back through the springs in the
later stages: less, the shorter the step. So it accepts steps whose error is thousands of tolerances. The estimates of
the other methods have weights at stages within the step.

Flights of 1 ms without floor are compared with `dp5` at 1e-13. How far `os32` at 1e-12, which has other stages and
steps, is from that says how far the reference can be trusted.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from warpchain.bench.problems.hard_starts import PAPER, reversing_loop, struck_loop
from warpchain.bench.problems.numpy_steps import accepted_steps
from warpchain.bench.record import Column
from warpchain.bench.starts import State
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import validated
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS
from warpchain.kernels.methods.method import find_method
from warpchain.oracle import motion_equations
from warpchain.status import Status

Array = NDArray[np.float64]

LINKS: Final = 40
DURATION: Final = 1e-3
"""Of the flights [s]."""
COUNT: Final = 8
"""Starts of each kind: how large an error is depends on where in a step the joints happen to reverse."""
STARTS: Final[dict[str, Callable[[float], State]]] = {
    "struck": lambda part: struck_loop(2 * math.pi * part / LINKS),
    "reversing": lambda part: reversing_loop(2 * math.pi * part),
}
"""Name → start, of a number from 0 to 1."""
SMOOTHINGS: Final = (PAPER.friction_smoothing, 0.1, 1.0)
"""Values of ω_c [rad/s]: Table 1's, that of `soft`, and one that joints pass in many steps."""
TOLERANCES: Final = (1e-6, 1e-9, 1e-11)
REFERENCE: Final = ("dp5", 1e-13)
CHECK: Final = ("os32", 1e-12)
WATCHED_TIME: Final = 1e-4
"""Time [s] in which the errors of single steps are looked at, of the second start."""
WATCHED_AT_ONCE: Final = 500
"""Steps that are repeated together."""
SCIPY: Final = "DOP853 (SciPy)"
"""Order 8 like Fehlberg's, with estimates of orders 5 and 3 from stages within the step."""
SCIPY_STAGES: Final = 12
"""Evaluations of an attempt."""


@dataclass(frozen=True)
class Reversal:
    """Errors of a method at a tolerance, over all starts of a kind."""

    start: Annotated[
        str,
        Column(
            "1",
            "struck: a circular loop that turns at 60 rad/s, just after it hit the floor at 2 m/s; reversing: one "
            "whose links turn at 60 (1 + 0.2 sin 2θ) rad/s; 40 links each",
        ),
    ]
    friction_smoothing: Annotated[float, Column("rad/s", "ω_c; the other parameters are Table 1's")]
    method: Annotated[str, Column("1", "method of the engine, or of SciPy on the NumPy model")]
    tolerance: Annotated[float, Column("1", "tolerance asked for, absolute in SI units and relative alike")]
    attempts: Annotated[float, Column("1", "attempted steps in 1 ms, accepted or not, mean over the starts")]
    error: Annotated[
        float, Column("rad/s", "greatest error of a link's angular velocity after 1 ms, median over the starts")
    ]
    greatest_error: Annotated[float, Column("rad/s", "the same, greatest over the starts")]
    trust: Annotated[
        float,
        Column("rad/s", "distance of the reference, dp5 at 1e-13, from rodas5p at 1e-12, greatest over the starts"),
    ]
    step_error: Annotated[
        float,
        Column(
            "1",
            "greatest true error of an accepted step in the first 0.1 ms of one start, over the tolerance: about 1 if "
            "the estimate sees all; null unless the method is an explicit one of the engine",
        ),
    ]


class Ends(NamedTuple):
    """Ends of some flights: angular velocities (starts, n) [rad/s], and the mean number of attempted steps."""

    spins: Array
    attempts: float

    def errors(self, true: "Ends") -> Array:
        """Greatest error of a link's angular velocity, (starts,) [rad/s]."""
        greatest: Array = np.abs(self.spins - true.spins).max(axis=1)
        return greatest


def starts_of(kind: str, count: int = COUNT) -> list[State]:
    """Starts of a kind, evenly spread."""
    return [STARTS[kind](number / count) for number in range(count)]


def fly(parameters: Parameters, starts: Sequence[State], method: str, tolerance: float) -> Ends:
    """Carry chains on for `DURATION` without a floor.

    Raises:
        RuntimeError: A flight did not come to its end.
    """
    batch = _carried_on(parameters, starts, [DURATION] * len(starts), method, tolerance)
    counts = [batch.counts(world) for world in range(len(starts))]
    return Ends(
        np.array([batch.velocity(world)[:, 2] for world in range(len(starts))]),
        float(np.mean([count["accepted"] + count["rejected"] for count in counts])),
    )


def fly_in_scipy(parameters: Parameters, starts: Sequence[State], tolerance: float) -> Ends:
    """The same by SciPy's DOP853 on the NumPy model.

    Raises:
        ImportError: SciPy is not installed.
    """
    spins, evaluations = [], []
    for position, velocity in starts:
        _, velocities, count = motion_equations.solve_flight(
            position, velocity, np.array([0.0, DURATION]), parameters, rtol=tolerance, atol=tolerance
        )
        spins.append(velocities[-1][:, 2])
        evaluations.append(count)
    return Ends(np.array(spins), float(np.mean(evaluations)) / SCIPY_STAGES)


def step_errors(parameters: Parameters, start: State, method: str, tolerance: float, duration: float) -> Array:
    """True errors of the accepted steps of a flight in the norm of the step control, over the tolerance.

    Each step is made in NumPy, with the coefficients and the controller of the engine, and repeated by the engine's
    `REFERENCE` from where it began.

    Args:
        parameters: Of the chain.
        start: Its state.
        method: An explicit method.
        tolerance: Of each step.
        duration: Of the flight [s].
    """
    acceleration = partial(motion_equations.acceleration, parameters=parameters)
    steps = accepted_steps(TABLEAUS[method], acceleration, start, duration, tolerance)
    ratios = []
    for first in range(0, len(steps), WATCHED_AT_ONCE):
        together = steps[first : first + WATCHED_AT_ONCE]
        batch = _carried_on(parameters, [s.start for s in together], [s.length for s in together], *REFERENCE)
        for world, step in enumerate(together):
            true = batch.position(world), batch.velocity(world)
            ratios.append(step.ratio((step.end[0] - true[0], step.end[1] - true[1])) / tolerance)
    return np.array(ratios)


def reversals(methods: Sequence[str], scipy: bool, report: Callable[[str], None]) -> Iterator[list[Reversal]]:
    """Errors of methods at `TOLERANCES`, a list for each kind of start and ω_c.

    Args:
        methods: Integrators; those that take joints for rigid are left out, for they solve other equations.
        scipy: Run SciPy's DOP853 as well, at Table 1's ω_c.
        report: Called with a line of progress.
    """
    chosen = [method for method in methods if not find_method(method).has_rigid_flight]
    for kind, smoothing in itertools.product(STARTS, SMOOTHINGS) if chosen else ():
        parameters, starts = PAPER.with_values({"friction_smoothing": smoothing}), starts_of(kind)
        name = f"reversing joints, {kind}, ω_c = {smoothing:g} rad/s"
        report(f"{name}: reference")
        true = fly(parameters, starts, *REFERENCE)
        trust = float(fly(parameters, starts, *CHECK).errors(true).max())
        rows = []
        for method, tolerance in itertools.product(chosen, TOLERANCES):
            report(f"{name}: {method} at {tolerance:g}")
            ends = fly(parameters, starts, method, tolerance)
            greatest = math.nan
            if method in TABLEAUS:
                greatest = float(step_errors(parameters, starts[1], method, tolerance, WATCHED_TIME).max())
            rows.append(_row(kind, smoothing, method, tolerance, ends, true, trust, greatest))
        for tolerance in TOLERANCES if scipy and smoothing == PAPER.friction_smoothing else ():
            report(f"{name}: {SCIPY} at {tolerance:g}")
            ends = fly_in_scipy(parameters, starts, tolerance)
            rows.append(_row(kind, smoothing, SCIPY, tolerance, ends, true, trust, math.nan))
        yield rows


def _row(
    kind: str, smoothing: float, method: str, tolerance: float, ends: Ends, true: Ends, trust: float, step_error: float
) -> Reversal:
    """The row of some ends."""
    errors = ends.errors(true)
    return Reversal(
        start=kind,
        friction_smoothing=smoothing,
        method=method,
        tolerance=tolerance,
        attempts=ends.attempts,
        error=float(np.median(errors)),
        greatest_error=float(errors.max()),
        trust=trust,
        step_error=step_error,
    )


def _carried_on(
    parameters: Parameters, starts: Sequence[State], durations: Sequence[float], method: str, tolerance: float
) -> Batch:
    """A batch with a chain for each start, at its end.

    Raises:
        RuntimeError: One did not come to its end.
    """
    given = {"method": method, "tolerance": tolerance, "self_contact": False}
    batch = Batch(len(starts), LINKS, validated(Options, given, "options"))
    for world, (start, duration) in enumerate(zip(starts, durations, strict=True)):
        batch.set_chain(world, parameters, LINKS)
        batch.load(world, *start, stop_time=duration, stop_status=Status.FINISHED)
    features = batch.features(fixed_body="none", watch="none")
    batch.compile(features, [LINKS])
    batch.run(range(len(starts)), features)
    for world in range(len(starts)):
        if batch.status(world) != Status.FINISHED:
            raise RuntimeError(f"{method} at {tolerance:g}: {batch.status(world).sentence}")
    return batch
