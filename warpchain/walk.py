"""One walk from the sprocket to rest.

The scene's phases are run one after the other on a batch of one: the drive (settle, spin-up, hold until steady) needs
a sprocket and no floor, the walk a floor and no sprocket. The equations do not know where the floor is, so the chain
is driven about the origin and raised to its clearance at the release.
"""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from warpchain.engine import COUNTS, EXTREMES, Batch, versions
from warpchain.kernels import layout
from warpchain.options import Options, Scene, Setup, check_scene, contact_radius, joint_radius, resolve
from warpchain.parameters import InputError, Parameters, shown, suggestion, validated
from warpchain.results import CONTACTS, ENERGIES, WalkResult
from warpchain.sampling import random_generator, sample_parameters, sample_scene
from warpchain.shapes import ellipse, lay_chain, stadium
from warpchain.status import Status

Array = NDArray[np.float64]

STILL_WINDOW = 0.25
"""Length [s] of a window of the steadiness watch when the sprocket stands still."""


@dataclass(frozen=True)
class Progress:
    """Where a walk is.

    Attributes:
        phase: ``"compile"``, ``"settle"``, ``"spin up"``, ``"hold"`` or ``"walk"``.
        time: Simulated time [s] since the start, in phase ``"walk"`` since the release.
        speed: Speed [m/s] along the loop, in phase ``"walk"`` of the centre of mass.
        tries: Steps tried so far, accepted or not.
    """

    phase: str
    time: float
    speed: float
    tries: int


OnProgress = Callable[[Progress], None]


def walk(
    *,
    links: int = 60,
    frequency: float = 15.0,
    preset: str = "paper",
    method: str = "rkf78",
    tolerance: float = 1e-6,
    start: str = "rest",
    seed: int | None = None,
    frame_interval: float | None = 2e-3,
    on_progress: OnProgress | None = None,
    **settings: object,
) -> WalkResult:
    """Simulate one walk: hang a chain on its sprocket, spin it up, release it and follow it to rest.

    Args:
        links: Number of links n, even.
        frequency: Turns of the sprocket per second [Hz].
        preset: ``"paper"`` (Table 1) or ``"soft"`` (softer joints, 10 to 15 times fewer steps).
        method: ``"rkf78"``, ``"dp5"`` or ``"bs32"``.
        tolerance: Error allowed in a step, absolute (SI units) and relative alike.
        start: ``"rest"``, ``"spinning"`` or ``"ellipse"``.
        seed: Draw parameters, phase and clearance from their distributions; None: Table 1's means, phase 0.
        frame_interval: Time between kept frames of all joints [s]; None keeps none. Frames do not change the walk.
        on_progress: Called about ten times a second.
        settings: Any other field of :class:`Parameters`, :class:`Scene` or :class:`Options`, by its name.

    Returns:
        The walk; look at ``status`` before ``dx``.

    Raises:
        InputError: A value is refused; nothing has been computed. It is a ``ValueError``.
    """
    named = {"links": links, "frequency": frequency, "method": method, "tolerance": tolerance, "start": start}
    setup = setup_walk(preset, named | settings, seed)
    return run_walk(setup, seed=seed, frame_interval=frame_interval, on_progress=on_progress)


def setup_walk(preset: str, settings: Mapping[str, object], seed: int | None) -> Setup:
    """Sort settings by name into parameters, scene and options, check them, and draw the sample of a seed.

    From the seed's generator come first the parameters, then phase and clearance. A phase or clearance that is
    set is drawn as well; then the set value counts.

    Raises:
        InputError: A name is unknown or a value is refused.
    """
    models = {"parameters": Parameters, "scene": Scene, "options": Options}
    sections: dict[str, dict[str, object]] = {name: {} for name in models}
    for name, value in settings.items():
        section = next((key for key, model in models.items() if name in model.model_fields), None)
        if section is None:
            known = [field for model in models.values() for field in model.model_fields]
            raise InputError(f"{shown(name)}: unknown name; {suggestion(name, known)}")
        sections[section][name] = value
    setup = resolve(
        preset, scene=sections["scene"], options=sections["options"], parameters=sections["parameters"]
    )
    if seed is None:
        return setup
    rng = random_generator(seed)
    parameters = sample_parameters(setup.parameters, rng)
    drawn = sample_scene(setup.scene, rng).model_dump() | sections["scene"]
    scene = validated(Scene, drawn, "scene")
    check_scene(scene, parameters)
    return Setup(preset=setup.preset, parameters=parameters, scene=scene, options=setup.options)


def run_walk(
    setup: Setup,
    *,
    seed: int | None = None,
    frame_interval: float | None = 2e-3,
    on_progress: OnProgress | None = None,
) -> WalkResult:
    """Run a walk that is set up completely; arguments and result as of :func:`walk`.

    Args:
        setup: Everything that says what the walk is, samples drawn.
        seed: Only noted in the result.
        frame_interval: See :func:`walk`.
        on_progress: See :func:`walk`.
    """
    started = time.perf_counter()
    report = on_progress or (lambda progress: None)
    scene, options, parameters = setup.scene, setup.options, setup.parameters
    if frame_interval is not None and not (math.isfinite(frame_interval) and frame_interval > 0):
        raise InputError(
            f"frame_interval: {shown(frame_interval)} is not a positive time in s; give one, or None"
        )
    touched = 0.0 if scene.start == "ellipse" else contact_radius(scene, parameters)
    batch = Batch(
        [parameters],
        [scene.links],
        [touched],
        options,
        keeps_samples=True,
        keeps_frames=frame_interval is not None,
        frame_every=max(1, round(frame_interval / options.record_interval)) if frame_interval else 1,
    )
    report(Progress("compile", 0.0, 0.0, 0))
    drive = _drive(batch, setup, report)
    if drive.status != Status.FINISHED:
        return _result(batch, setup, drive, None, math.nan, seed, started)

    position, velocity = drive.position, drive.velocity
    raised = scene.clearance - (drive.hanging_lowest if scene.clearance_of == "hanging" else drive.lowest)
    position[:, 1] += raised
    series = _Series(batch)
    batch.load(0, position, velocity, stop_time=scene.walk_limit, stop_status=Status.TIME_LIMIT)

    def after_launch() -> None:
        series.drain()
        speed = math.hypot(series.last[layout.CENTER_U], series.last[layout.CENTER_V])
        report(Progress("walk", batch.time(0), speed, drive.tries + batch.tries(0)))

    batch.run([0], batch.features(fixed_body="floor", watch="rest"), after_launch)
    return _result(batch, setup, drive, series, raised, seed, started)


@dataclass
class _Drive:
    """The chain at its release, in the sprocket's frame, and what it took to get there."""

    status: Status
    position: Array
    velocity: Array
    lowest: float
    hanging_lowest: float = math.nan
    time: float = 0.0
    counts: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(COUNTS, 0))
    extremes: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(EXTREMES, 0.0))

    @property
    def tries(self) -> int:
        return self.counts["accepted"] + self.counts["rejected"]


def _drive(batch: Batch, setup: Setup, report: OnProgress) -> _Drive:
    """Everything before the release."""
    scene, parameters = setup.scene, setup.parameters
    joints_ride = joint_radius(scene, parameters)
    speed = 2 * math.pi * scene.frequency * joints_ride
    if scene.start == "ellipse":
        position, velocity = lay_chain(
            ellipse(scene.ellipse_aspect), scene.links, parameters.link_length, speed, scene.phase
        )
        return _Drive(Status.FINISHED, position, velocity, lowest_point(position, parameters))

    from_rest = scene.start == "rest"
    period = scene.links * parameters.link_length / speed if speed > 0 else STILL_WINDOW
    settled = scene.settle_time if from_rest else 0.0
    spin_up = scene.spin_up_time if from_rest and speed > 0 else 0.0
    full_speed = settled + spin_up
    position, velocity = lay_chain(
        stadium(joints_ride), scene.links, parameters.link_length, 0.0 if from_rest else speed
    )
    batch.load(0, position, velocity, stop_time=settled, stop_status=Status.FINISHED)
    batch.set_program(
        0,
        sprocket_speed=-2 * math.pi * scene.frequency,  # clockwise, so that the walk goes towards +x
        spin_up_start=settled,
        spin_up_time=spin_up,
        hold_start=full_speed,
        loop_speed=speed,
        loop_period=period,
        release_phase=scene.phase,
    )
    loop_speed = 0.0

    def after_launch() -> None:
        nonlocal loop_speed
        samples = batch.drain_samples(0)
        if len(samples):
            loop_speed = samples[-1, layout.LOOP_SPEED]
        batch.drain_frames(0)
        now = batch.time(0)
        phase = "settle" if now < settled else "spin up" if now < full_speed else "hold"
        report(Progress(phase, now, loop_speed, batch.tries(0)))

    features = batch.features(fixed_body="sprocket", watch="steady")
    hanging_lowest = math.nan
    if from_rest:
        batch.run([0], features, after_launch)
        hanging_lowest = lowest_point(batch.position(0), parameters)
    if batch.status(0) == Status.FINISHED or not from_rest:
        batch.resume(0, full_speed + scene.hold_limit, Status.NOT_STEADY)
        batch.run([0], features, after_launch)
    position = batch.position(0)
    return _Drive(
        batch.status(0),
        position,
        batch.velocity(0),
        lowest_point(position, parameters),
        hanging_lowest,
        batch.time(0),
        batch.counts(0),
        batch.extremes(0),
    )


def lowest_point(position: Array, parameters: Parameters) -> float:
    """Height [m] of the lowest point of a chain's circles; position (n, 3)."""
    ends = position[:, 1] - parameters.link_length / 2 * np.abs(np.sin(position[:, 2]))
    return float(np.min(ends)) - parameters.circle_radius


def _result(
    batch: Batch,
    setup: Setup,
    drive: _Drive,
    series: "_Series | None",
    raised: float,
    seed: int | None,
    started: float,
) -> WalkResult:
    """Put the result together; without a series the chain was never released."""
    if series is None:
        status, walked = drive.status, 0.0
        counts: Mapping[str, int] = dict.fromkeys(COUNTS, 0)
        extremes: Mapping[str, float] = dict.fromkeys(EXTREMES, 0.0)
        energy = dict.fromkeys(ENERGIES, math.nan)
        samples, frame_time, frames = (
            np.empty((0, layout.SAMPLE_COLUMNS)),
            np.empty(0),
            np.empty((0, setup.scene.links, 2)),
        )
    else:
        status, walked = batch.status(0), batch.time(0)
        counts, extremes = batch.counts(0), batch.extremes(0)
        samples, frame_time, frames = series.arrays()
        energy = _ledger(samples, batch.losses(0))
    has_sprocket = setup.scene.start != "ellipse" and series is not None
    return WalkResult(
        status=status,
        dx=float(samples[-1, layout.CENTER_X]) if status == Status.AT_REST else math.nan,
        walk_time=walked,
        simulated_time=drive.time + walked,
        wall_time=time.perf_counter() - started,
        bounces=counts["bounces"],
        steps_accepted=drive.counts["accepted"] + counts["accepted"],
        steps_rejected=drive.counts["rejected"] + counts["rejected"],
        impulses={kind: drive.counts[kind] + counts[kind] for kind in CONTACTS},
        greatest_opening=max(drive.extremes["opening"], extremes["opening"]),
        greatest_penetration={kind: max(drive.extremes[kind], extremes[kind]) for kind in CONTACTS},
        energy=energy,
        sprocket_center=np.array([0.0, raised]) if has_sprocket else None,
        sprocket_radius=contact_radius(setup.scene, setup.parameters) if has_sprocket else 0.0,
        setup=setup,
        seed=seed,
        versions=versions(),
        time=samples[:, layout.TIME],
        center=samples[:, [layout.CENTER_X, layout.CENTER_Y]],
        center_velocity=samples[:, [layout.CENTER_U, layout.CENTER_V]],
        kinetic_energy=samples[:, layout.KINETIC],
        gravitational_energy=samples[:, layout.GRAVITATIONAL],
        spring_energy=samples[:, layout.SPRING],
        lowest=samples[:, layout.LOWEST],
        rms_speed=samples[:, layout.RMS_SPEED],
        frame_time=frame_time,
        frame_joints=frames,
    )


def _ledger(samples: Array, losses: Mapping[str, float]) -> dict[str, float]:
    """Where the energy of a walk went [J]; keys as :data:`warpchain.results.ENERGIES`."""
    first, last = samples[0], samples[-1]
    lost = {name: losses[name] for name in ("joint_friction", "joint_damping", "floor", "self_contact")}
    before = first[layout.KINETIC] + first[layout.GRAVITATIONAL] + first[layout.SPRING]
    after = last[layout.KINETIC] + last[layout.GRAVITATIONAL] + last[layout.SPRING]
    return {
        "kinetic_at_release": float(first[layout.KINETIC]),
        "potential_at_release": float(first[layout.GRAVITATIONAL] + first[layout.SPRING]),
        "kinetic_at_end": float(last[layout.KINETIC]),
        "potential_at_end": float(last[layout.GRAVITATIONAL] + last[layout.SPRING]),
        **lost,
        "residual": float(before - after - sum(lost.values())),
    }


class _Series:
    """Collects a walk's time series and frames from a batch of one."""

    def __init__(self, batch: Batch) -> None:
        self._batch = batch
        self._samples: list[Array] = []
        self._frame_times: list[Array] = []
        self._frames: list[Array] = []
        self.last = np.zeros(layout.SAMPLE_COLUMNS)

    def drain(self) -> None:
        samples = self._batch.drain_samples(0)
        if len(samples):
            self._samples.append(samples)
            self.last = samples[-1]
        times, frames = self._batch.drain_frames(0)
        self._frame_times.append(times)
        self._frames.append(frames)

    def arrays(self) -> tuple[Array, Array, Array]:
        """Samples (t, SAMPLE_COLUMNS), frame times (f,) [s], joint positions (f, n, 2) [m]."""
        return np.concatenate(self._samples), np.concatenate(self._frame_times), np.concatenate(self._frames)
