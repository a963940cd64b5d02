"""The problems of the work–precision diagrams by SciPy's solvers on the NumPy model, one core: flights and impacts.

SciPy is an extra; nothing here is imported without it. Radau gets the pattern of the Jacobian, so that its finite
differences and its factorisation are sparse.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.bench.problems.work_precision import Point, Problem, Reference, make_point
from warpchain.bench.starts import State
from warpchain.inputs.options import Options
from warpchain.oracle import contact_equations, motion_equations

Array = NDArray[np.float64]

SOLVERS: Final = ("DOP853", "Radau")
PATIENCE: Final = 40.0
"""A run that would take more processor time [s] is given up."""
GAVE_UP: Final = f"over {PATIENCE:g} s"


class _OutOfPatienceError(Exception):
    """A run has taken longer than `PATIENCE`."""


def solvers_for(problem: Problem) -> tuple[str, ...]:
    """Solvers that can do a problem: an impulse ends Radau's large steps, and a turn has 100,000 contacts in Python."""
    return {"flight": SOLVERS, "impact": SOLVERS[:1]}.get(problem.name, ())


def scipy_points(
    problem: Problem, true: Reference, tolerances: Sequence[float], report: Callable[[str], None]
) -> list[Point]:
    """Run a problem with SciPy's solvers, each once; what takes longer than `PATIENCE` has the status `GAVE_UP`."""
    found = []
    for solver in solvers_for(problem):
        for tolerance in tolerances:
            report(f"{problem.name}, {problem.links} links: SciPy's {solver} at {tolerance:g}")
            began = time.process_time()
            counts = {"evaluations": 0, "steps": 0}
            ends = None
            with suppress(_OutOfPatienceError):
                ends = [_run(problem, start, solver, tolerance, began + PATIENCE, counts) for start in problem.starts]
            found.append(
                make_point(
                    problem,
                    true,
                    ends,
                    f"{solver} (SciPy)",
                    tolerance,
                    status=GAVE_UP if ends is None else "finished",
                    seconds=time.process_time() - began,
                    evaluations=counts["evaluations"],
                    accepted=counts["steps"],
                    rejected=None,
                )
            )
    return found


def _run(
    problem: Problem, start: State, solver: str, tolerance: float, deadline: float, counts: dict[str, int]
) -> State:
    """Carry one start to its end, floor contacts after each step.

    Raises:
        _OutOfPatienceError: the deadline has passed.
        RuntimeError: the solver failed.
    """
    import scipy.integrate

    n = problem.links

    def derivative(_: float, state: Array) -> Array:
        counts["evaluations"] += 1
        if time.process_time() > deadline:
            raise _OutOfPatienceError
        x, v = state.reshape(2, n, 3)
        rates: Array = np.concatenate([v, motion_equations.acceleration(x, v, problem.parameters)]).ravel()
        return rates

    make = getattr(scipy.integrate, solver)
    settings: dict[str, Any] = {"rtol": tolerance, "atol": tolerance}
    if problem.fixed_body == "floor":
        settings["max_step"] = Options().contact_step
    if solver == "Radau":
        settings["jac_sparsity"] = _pattern(n)
    now, state, first = 0.0, np.concatenate(start).ravel(), 1e-7
    while now < problem.duration:
        stepper = make(
            derivative, now, state, problem.duration, first_step=min(first, problem.duration - now), **settings
        )
        while stepper.status == "running":
            message = stepper.step()
            if stepper.status == "failed":
                raise RuntimeError(f"SciPy's {solver} failed at {stepper.t} s: {message}")
            counts["steps"] += 1
            if problem.fixed_body == "floor":
                position, velocity = stepper.y.reshape(2, n, 3)
                after = _after_contacts(problem, position, velocity)
                if after is not None:
                    now, state, first = stepper.t, np.concatenate([position, after]).ravel(), stepper.step_size
                    break
        else:
            now, state = stepper.t, stepper.y
    position, velocity = state.reshape(2, n, 3)
    return position, velocity


def _after_contacts(problem: Problem, position: Array, velocity: Array) -> Array | None:
    """Velocity (n, 3) after the impulses of the floor; None if there were none."""
    ends = np.concatenate(motion_equations.link_ends(position, problem.parameters))
    if ends[:, 1].min() > problem.parameters.circle_radius:
        return None
    after, hits = contact_equations.resolve_contacts(position, velocity, problem.parameters, self_contact=False)
    return after if hits["floor"] else None


def _pattern(n: int) -> Any:
    """Which derivatives of a chain's rates are not zero, (6 n, 6 n): accelerations hang on links and neighbours."""
    from scipy.sparse import bmat, coo_matrix, identity, kron

    links = np.arange(n)
    beside = [coo_matrix((np.ones(n), (links, (links + k) % n)), shape=(n, n)) for k in (-1, 0, 1)]
    coupled = kron(sum(beside[1:], beside[0]), np.ones((3, 3)))
    return bmat([[None, identity(3 * n)], [coupled, coupled]], format="csc")
