"""What a step of each method takes, how far a flight by it ends from where it should, and walks a second.

Identical chains fly for a millisecond, at whose end their error is taken, then on, while they are timed: so neither
compilation nor the small steps after the start are measured. Methods take turns, several times over; medians count.

Errors are those beside a chain in free flight in plain NumPy, integrated by SciPy, which shares no code with the
kernels. It has `position` (n, 3), x, y [m] and angle [rad] of each link's centre, and `velocity` (n, 3), their rates.
"""

import itertools
import math
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Any, Final

import numpy as np

from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.engine.devices import gpu_turn
from warpchain.engine.machine import machine_of
from warpchain.inputs.arrays import Array
from warpchain.inputs.options import Options, on_gpu
from warpchain.inputs.parameters import Parameters, preset
from warpchain.kernels.methods.method import find_method, method_names
from warpchain.run.progress_bar import SweepProgress
from warpchain.run.simulation import simulate
from warpchain.run.sweep_run import sweep
from warpchain.status import Status
from warpchain.version import package_versions

Row = dict[str, Any]
Motion = tuple[Array, Array]
"""Position x, y [m], θ [rad] of each link and their rates, (n, 3) each."""
Report = Callable[[str], None]
"""Called with a line of progress."""

PARAMETERS: Final = preset("paper")
SCIPY: Final = "DOP853 (SciPy)"
SCIPY_TOLERANCE: Final = 1e-6
REFERENCE_TOLERANCE: Final = 1e-10
"""Of SciPy's DOP853, whose error is below 1e-9 m/s then; at 1e-12 it follows rounding errors in tiny steps."""
COMPARED_TIME: Final = 1e-3
"""Simulated time [s] after which errors are taken; SciPy needs seconds for it."""
TIMED: Final = 0.05
"""Simulated time [s] at whose end the measurement of a step ends."""
ROUNDS: Final = 5
CHAINS_ON_GPU: Final = 4000
WALKS: Final = {"cpu": 32, "gpu": 2000}
WALK: Final[Row] = {"links": 60, "frequency": 15.0, "start": "spinning"}


def step_costs(device: str, links: Sequence[int], report: Report) -> list[Row]:
    """Cost and error of a step of all methods of a device, and of SciPy's DOP853, at default tolerances.

    For each even number of links and each method: `links`, `method`, `tolerance`, `chains` that fly side by side,
    `microseconds` that an attempted step of one chain takes, of wall time on a GPU, and on a CPU of the processor's
    time, which other programs hardly change; `step` [s], the mean accepted one (of SciPy the attempted one),
    `rejected`, the share of attempts (NaN for SciPy, which does not tell), `chain_seconds` simulated in a second, and
    the greatest `position_error` [m] and `velocity_error` [m/s] of a link after
    `COMPARED_TIME`. An `InputError` says that there is no such device, a `RuntimeError` that a flight ended early.
    """
    methods = [name for name in method_names() if not (on_gpu(device) and find_method(name).has_rigid_flight)]
    starts, chains = {n: flying(n, device) for n in links}, CHAINS_ON_GPU if on_gpu(device) else 1
    flights: dict[tuple[int, str], list[tuple[Motion, float, int, int]]] = {}
    for turn, n, method in itertools.product(range(ROUNDS), links, methods):
        report(f"round {turn + 1} of {ROUNDS}: {n} links, {method}; the first compiles kernels")
        flights.setdefault((n, method), []).append(fly(starts[n], method, chains, device))
    rows = []
    for n, start in starts.items():
        report(f"SciPy's DOP853, {n} links")
        aim, *_ = fly_by_scipy(*start, COMPARED_TIME, PARAMETERS, REFERENCE_TOLERANCE)
        for method in methods:
            end, _, accepted, rejected = flights[n, method][0]
            seconds = statistics.median(flight[1] for flight in flights[n, method])
            options = Options.model_validate({"method": method})
            tolerance = options.flight_tolerance if find_method(method).has_rigid_flight else options.tolerance
            about = {"links": n, "method": method, "tolerance": tolerance, "chains": chains}
            rows.append(about | _cost(chains, seconds, TIMED - COMPARED_TIME, accepted, rejected) | _errors(end, aim))
        end, seconds, attempts = fly_by_scipy(*start, COMPARED_TIME, PARAMETERS, SCIPY_TOLERANCE)
        about = {"links": n, "method": SCIPY, "tolerance": SCIPY_TOLERANCE, "chains": 1}
        rows.append(about | _cost(1, seconds, COMPARED_TIME, attempts, math.nan) | _errors(end, aim))
    return rows


def flying(links: int, device: str = "cpu") -> Motion:
    """A circulating ellipse above the floor, whose joints have come to bear their loads."""
    position, velocity = lay_chain(ellipse(1.5), links, PARAMETERS.link_length, speed=5.0)
    position[:, 1] += 0.1 - position[:, 1].min()
    ended = simulate(PARAMETERS, position, velocity, 2e-3, times=[2e-3], method="dp5", tolerance=1e-9, device=device)
    return ended.position[-1], ended.velocity[-1]


def fly(start: Motion, method: str, chains: int, device: str) -> tuple[Motion, float, int, int]:
    """Carry identical chains of a batch through the air; a `RuntimeError` says that one did not come to the end.

    The state of a chain after `COMPARED_TIME`; from then on time [s], accepted and rejected steps of a chain.
    """
    worlds, links = range(chains), len(start[0])
    clock = time.perf_counter if on_gpu(device) else time.process_time
    with gpu_turn([device]):
        batch = Batch(chains, links, Options.model_validate({"method": method, "device": device}))
        for world in batch.worlds:
            world.set_chain(PARAMETERS, links)
            world.load(*start, stop_time=COMPARED_TIME, stop_status=Status.FINISHED)
        features = batch.features(fixed_body="floor")
        batch.run(worlds, features)
        one = batch.worlds[0]
        compared, before = (one.position, one.velocity), one.counts
        batch.several(worlds).resume(TIMED, Status.FINISHED)
        began = clock()
        batch.run(worlds, features)
        seconds, after = clock() - began, one.counts
        if (batch.statuses() != Status.FINISHED).any():
            raise RuntimeError(f"{method}: {one.status.sentence}")  # all chains are alike
    return compared, seconds, after["accepted"] - before["accepted"], after["rejected"] - before["rejected"]


def _cost(chains: int, seconds: float, flown: float, accepted: float, rejected: float) -> Row:
    """What `step_costs` says of the steps of a flight; `rejected` is NaN where attempts are counted as accepted."""
    attempts = np.nansum([accepted, rejected])
    rates = {"step": flown / accepted, "rejected": rejected / attempts, "chain_seconds": chains * flown / seconds}
    return {"microseconds": 1e6 * seconds / (attempts * chains)} | rates


def _errors(end: Motion, aim: Motion) -> Row:
    """What `step_costs` says of the end of a flight."""
    place, rate = (float(np.hypot(*(one - other)[:, :2].T).max()) for one, other in zip(end, aim, strict=True))
    return {"position_error": place, "velocity_error": rate}


def walk_rate(device: str, report: Report) -> Row:
    """Method, tolerance, walks, those at rest, wall time [s] and walks a second of a sweep, kernels loaded before.

    `waited` is the share of that time in which the host waited for a GPU, and had nothing else to do. On a CPU all
    processors take part. Errors as of :func:`warpchain.sweep`.
    """
    options, walks = Options.model_validate({"device": device}), WALKS["gpu" if on_gpu(device) else "cpu"]
    seen: list[SweepProgress] = []
    with tempfile.TemporaryDirectory(prefix="warpchain-bench-") as folder:
        report("walks of a sweep")
        result = sweep(**WALK, samples=walks, device=device, out=f"{folder}/bench", on_progress=seen.append)
    return {
        **{"method": options.method, "tolerance": options.tolerance, "walks": walks},
        **{"at_rest": result.summary()["at_rest"], "seconds": seen[-1].seconds, "walks_per_second": seen[-1].rate},
        "waited": seen[-1].waited / seen[-1].seconds,
    }


def machine(device: str) -> dict[str, str]:
    """Processor, system, GPU if the device is one, and versions; an `InputError` if it is not there."""
    return machine_of([device]) | package_versions() | {"scipy": version("scipy")}


def acceleration(position: Array, velocity: Array, parameters: Parameters) -> Array:
    """Second derivatives of a chain's positions without contacts, (n, 3) [m/s², m/s², rad/s²].

    A joint pulls on the right end of link i with F_i = k C_i + b Ċ_i, where C_i is how far the left end of link i + 1
    lies from it, and on link i + 1 with −F_i. Links rub on their neighbours with β w + τ_c tanh(w/ω_c), w their
    relative angular velocity.
    """

    def following(values: Array) -> Array:
        return np.roll(values, -1, axis=0)

    links = len(position)
    mass = np.resize([parameters.inner_mass, parameters.outer_mass], links)
    inertia = np.resize([parameters.inner_inertia, parameters.outer_inertia], links)
    angle, spin = position[:, 2], velocity[:, 2]
    along = parameters.link_length / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    turning = spin[:, None] * across
    opening = following(position[:, :2] - along) - position[:, :2] - along
    opening_rate = following(velocity[:, :2] - turning) - velocity[:, :2] - turning
    pull = parameters.joint_stiffness * opening + parameters.joint_damping * opening_rate
    slip = spin - following(spin)
    sticking = parameters.coulomb_friction * np.tanh(slip / parameters.friction_smoothing)
    friction = parameters.viscous_friction * slip + sticking
    before = np.roll(pull, 1, axis=0)
    torque = (across * (pull + before)).sum(axis=1) - friction + np.roll(friction, 1)
    result = np.column_stack([(pull - before) / mass[:, None], torque / inertia])
    result[:, 1] -= parameters.gravity
    return result


def fly_by_scipy(
    position: Array, velocity: Array, duration: float, parameters: Parameters, tolerance: float
) -> tuple[Motion, float, float]:
    """Integrate a chain in flight by SciPy's DOP853, at a tolerance that is absolute (SI units) and relative.

    Position and velocity after the duration [s], time of the processor [s], and attempted steps, accepted or not.
    """
    from scipy.integrate import solve_ivp

    start = np.stack([position, velocity])

    def rates(_: float, state: Array) -> Array:
        place, rate = state.reshape(start.shape)
        return np.concatenate([rate, acceleration(place, rate, parameters)]).ravel()

    began = time.process_time()
    done = solve_ivp(rates, (0.0, duration), start.ravel(), "DOP853", [duration], rtol=tolerance, atol=tolerance)
    seconds = time.process_time() - began
    if not done.success:
        raise RuntimeError(f"DOP853 failed: {done.message}")
    end = done.y[:, -1].reshape(start.shape)
    return (end[0], end[1]), seconds, done.nfev / 12  # evaluations in an attempted step
