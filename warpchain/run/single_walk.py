"""One walk, from a user's few words to its result."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.engine.devices import versions
from warpchain.inputs.distributions import random_generator, sampled
from warpchain.inputs.options import Options
from warpchain.inputs.scene import contact_radius
from warpchain.inputs.setup import Setup, by_section, resolve
from warpchain.inputs.validation import InputError, shown
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.walks.recorder import EVERYTHING
from warpchain.walks.walk_phases import WalkRun
from warpchain.walks.walk_result import CONTACTS, WalkResult

Array = NDArray[np.float64]

RECORD_BEFORE = 0.5
"""Time [s] before the release that is kept if frames are, unless told otherwise."""
LONGEST_FRAME_INTERVAL = 1000.0
"""Greatest time [s] between frames."""


@dataclass(frozen=True)
class Progress:
    """Where a walk is.

    Attributes:
        phase: ``"compile"``, ``"settle"``, ``"spin up"``, ``"hold"`` or ``"walk"``.
        time: Simulated time [s] since the start, in phase ``"walk"`` since the release.
        speed: Speed [m/s] along the loop, in phase ``"walk"`` of the centre of mass.
        attempts: Steps tried so far, accepted or not.
    """

    phase: str
    time: float
    speed: float
    attempts: int


OnProgress = Callable[[Progress], None]


def walk(
    *,
    links: int = 60,
    frequency: float = 15.0,
    preset: str = "paper",
    method: str = "standard",
    tolerance: float | None = None,
    start: str = "rest",
    seed: int | None = None,
    frame_interval: float | None = 2e-3,
    record_before: float | None = None,
    on_progress: OnProgress | None = None,
    **settings: object,
) -> WalkResult:
    """Simulate one walk: hang a chain on its sprocket, spin it up, release it and follow it to rest.

    Args:
        links: Number of links n, even.
        frequency: Turns of the sprocket per second [Hz].
        preset: ``"paper"`` (Table 1) or ``"soft"`` (softer joints, 10 to 15 times fewer steps).
        method: ``"standard"`` (``"hybrid"`` at 1e-3, with joints softened on the sprocket and in the pile; on a GPU
            the next), ``"explicit"`` (``"os32"`` at 1e-3, softened likewise), ``"reference"`` (``"rkf78"`` at 1e-6, as
            in the paper), or an integrator: a key of ``warpchain.inputs.methods.METHODS``, such as ``"dp5"``.
        tolerance: Error allowed in a step, absolute (SI units) and relative alike; None: the method's, 1e-6 for an
            integrator, 1e-4 for ``"hybrid"``, and of ``"standard"`` and ``"explicit"`` 3e-3 while joints are soft.
        start: ``"rest"``, ``"spinning"`` or ``"ellipse"``.
        seed: Draw parameters, phase and clearance from their distributions; None: Table 1's means, phase 0.
        frame_interval: Time between kept frames of all joints [s], to whole samples; None keeps none. Neither frames
            nor samples change the walk: they are taken at the first step's end after their time.
        record_before: Time [s] before the release of which frames and samples are kept as well, as ``before_release``
            of the result, with the forces in the joints; None: 0.5 s if frames are kept; 0: none. Nothing is kept of
            a loop under multiplied loads; ``further_hold`` makes room for more.
        on_progress: Called about ten times a second.
        settings: Any other field of :class:`Parameters`, :class:`Scene` or :class:`Options`, by its name.

    Returns:
        The walk; look at ``status`` before ``dx``.

    Raises:
        InputError: A value is refused; nothing has been computed. It is a ``ValueError``.
    """
    named = {"links": links, "frequency": frequency, "method": method, "start": start}
    chosen = {} if tolerance is None else {"tolerance": tolerance}
    setup = setup_walk(preset, named | chosen | settings, seed)
    return run_walk(
        setup, seed=seed, frame_interval=frame_interval, record_before=record_before, on_progress=on_progress
    )


def setup_walk(preset: str, settings: Mapping[str, object], seed: int | None) -> Setup:
    """Sort settings by name into parameters, scene and options, check them, and draw the sample of a seed.

    From the seed's generator come first the parameters, then phase and clearance. A phase or clearance that is
    set is drawn as well; then the set value counts.

    Raises:
        InputError: A name is unknown or a value is refused.
    """
    sections = by_section(settings)
    setup = resolve(preset, **sections)
    return setup if seed is None else sampled(setup, random_generator(seed), kept=sections["scene"])


def run_walk(
    setup: Setup,
    *,
    seed: int | None = None,
    frame_interval: float | None = 2e-3,
    record_before: float | None = None,
    on_progress: OnProgress | None = None,
) -> WalkResult:
    """Run a walk that is set up completely; arguments and result as of :func:`walk`.

    Args:
        setup: Everything that says what the walk is, samples drawn.
        seed: Only noted in the result.
        frame_interval: See :func:`walk`.
        record_before: See :func:`walk`.
        on_progress: See :func:`walk`.
    """
    started = time.perf_counter()
    report = on_progress or (lambda progress: None)
    options = setup.options
    frame_every = None if frame_interval is None else _samples_per_frame(frame_interval, options)
    before = _time_before(record_before, frame_every) if setup.scene.start != "ellipse" else 0.0
    batch = Batch(1, setup.scene.links, options, keeps_samples=True, frame_every=frame_every, keeps_loads=before > 0)
    run = WalkRun(batch, 0, setup, replace(EVERYTHING, before=before))
    compiled: set[Features] = set()

    def after_launch() -> None:
        run.drain()
        report(Progress(run.phase.value, run.walk_time or run.simulated_time, run.speed, run.attempts))

    running = True
    while running:
        features = run.features
        if features not in compiled:
            report(Progress("compile", run.simulated_time, 0.0, run.attempts))
            compiled.add(features)
        batch.run([0], features, after_launch)
        running = run.next_phase()
    return _result(run, seed, time.perf_counter() - started)


def _samples_per_frame(frame_interval: float, options: Options) -> int:
    """Whole samples between two kept frames.

    Raises:
        InputError: The interval is no time, or shorter than that between samples.
    """
    if not (_is_number(frame_interval) and 0 < frame_interval < math.inf):
        raise InputError(f"frame_interval: {shown(frame_interval)} is not a positive time in s; give one, or None")
    samples = frame_interval / options.record_interval if frame_interval < LONGEST_FRAME_INTERVAL else math.inf
    if not 0.999 < samples < math.inf:
        raise InputError(
            f"frame_interval: {shown(frame_interval)} is not between options.record_interval "
            f"{options.record_interval} s and {LONGEST_FRAME_INTERVAL} s; give a time between, or None"
        )
    return round(samples)


def _time_before(record_before: float | None, frame_every: int | None) -> float:
    """Time [s] before the release that is kept.

    Raises:
        InputError: It is no time, or no frames are kept.
    """
    if record_before is None:
        return RECORD_BEFORE if frame_every is not None else 0.0
    if not (_is_number(record_before) and 0 <= record_before < math.inf):
        raise InputError(f"record_before: {shown(record_before)} is not a time in s; give one, 0 for none, or None")
    if record_before > 0 and frame_every is None:
        raise InputError("record_before: a time is given, but frame_interval is None; give a frame_interval as well")
    return float(record_before)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _result(run: WalkRun, seed: int | None, wall_time: float) -> WalkResult:
    """Put the result together; the record is empty if the chain was never released."""
    setup, counts, extremes = run.setup, run.counts, run.extremes
    on_sprocket = setup.scene.start != "ellipse"
    samples, (frame_time, frames) = run.recorder.samples(), run.recorder.frames(setup.scene.links)
    return WalkResult(
        status=run.status,
        dx=run.dx,
        walk_time=run.walk_time,
        simulated_time=run.simulated_time,
        hold_time=run.hold_time,
        drift=run.drift,
        softened_at=run.softened_at,
        wall_time=wall_time,
        bounces=counts["bounces"],
        steps_accepted=counts["accepted"],
        steps_rejected=counts["rejected"],
        impulses={kind: counts[kind] for kind in CONTACTS},
        greatest_opening=extremes["opening"],
        greatest_penetration={kind: extremes[kind] for kind in CONTACTS},
        energy=run.energy(),
        sprocket_center=np.array([0.0, run.raised]) if on_sprocket else None,
        sprocket_radius=contact_radius(setup.scene, setup.parameters) if on_sprocket else math.nan,
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
        before_release=run.recorder.before,
    )
