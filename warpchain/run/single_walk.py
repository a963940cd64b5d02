"""One walk, from a user's few words to its result."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, Unpack

from warpchain.engine.devices import gpu_turn, versions
from warpchain.inputs.distributions import LARGEST_SEED, random_generator, sampled
from warpchain.inputs.keywords import Method, Number, Preset, Truth, WalkSettings, Whole
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import warn_of_units
from warpchain.inputs.sections import by_section
from warpchain.inputs.setup import DEFAULT_PRESET, Setup, check_has_joint_forces, resolve
from warpchain.inputs.validation import InputError, checked_positive, checked_whole, full_name, plain, shown
from warpchain.walks.motion import LONGEST_INTERVAL, Keep
from warpchain.walks.scheduler import run_setups
from warpchain.walks.walk_phases import WalkRun
from warpchain.walks.walk_result import WalkResult

SHORTEST_INTERVAL = 1e-6
"""Least time [s] between two frames, as between two samples."""
RECORD_BEFORE = 0.5
"""Time [s] before the release that is kept if frames are, unless told otherwise."""


@dataclass(frozen=True)
class Progress:
    """Where a walk is.

    Attributes:
        phase: ``"compile"``, ``"settle"``, ``"spin up"``, ``"hold"`` or ``"walk"``.
        time: Simulated time [s] since the start, in phase ``"walk"`` since the release.
        speed: Speed [m/s] along the loop, in phase ``"walk"`` of the centre of mass.
        attempts: Attempted steps so far.
    """

    phase: str
    time: float
    speed: float
    attempts: int


OnProgress = Callable[[Progress], None]


def walk(
    *,
    links: Whole | None = None,
    frequency: Number | None = None,
    preset: Preset | None = None,
    method: Method | None = None,
    tolerance: Number | None = None,
    start: Literal["rest", "spinning", "ellipse"] | None = None,
    setup: Setup | None = None,
    seed: Whole | None = None,
    frame_interval: Number | None = 2e-3,
    record_before: Number | None = None,
    record_loads: Truth = False,
    on_progress: OnProgress | None = None,
    **settings: Unpack[WalkSettings],
) -> WalkResult:
    """Simulate one walk: hang a chain on its sprocket, spin it up, release it and follow it to rest.

    Args:
        links: Number of links n, even where two kinds alternate; None: 60.
        frequency: Turns of the sprocket per second [Hz]; None: 15.
        preset: None or ``"paper"`` (Table 1), or ``"soft"`` (softer joints, with ``reference`` 10 to 15
            times fewer steps).
        method: None or ``"standard"`` (``"hybrid"`` at 3e-3, with joints softened on the sprocket and in the pile; on a
            GPU, and with ``record_loads``, the next), ``"explicit"`` (``"os32"`` at 3e-3, softened likewise),
            ``"reference"`` (``"rkf78"`` at 1e-6, as in the paper), or an integrator: a key of
            ``warpchain.inputs.methods.METHODS``, such as ``"dp5"``.
        tolerance: Error allowed in a step, absolute (SI units) and relative alike; None: the method's, 1e-6 for an
            integrator, 1e-4 for ``"hybrid"``, and of ``"standard"`` and ``"explicit"`` 3e-3 while joints are soft.
        start: None or ``"rest"``, ``"spinning"`` or ``"ellipse"``.
        setup: ``setup`` of another walk, which is repeated to the bit, whatever was drawn for it. It is complete: no
            other setting is taken beside it, nothing is drawn, and ``seed`` is only noted in the result.
        seed: Draw those parameters, phase and clearance that are not given from their distributions; None: Table 1's
            means, phase 0.
        frame_interval: Time between kept frames of all joints [s], at least 1e-6; None keeps none. It is rounded to
            whole samples; less than a ``record_interval`` holds after the release. Frames and samples do not change
            the walk: they are taken at the end of the first step after their time.
        record_before: Time [s] before the release of which frames and samples are kept as well, as ``before_release``
            of the result, with the forces in the joints; None: 0.5 s if frames are kept; 0: none. Nothing is kept of
            a loop under multiplied loads; ``further_hold`` makes room for more.
        record_loads: Whether ``frame_forces`` and ``frame_moments``, the loads of the joints, are kept with each frame
            after the release. No method with rigid joints has them: ``"standard"`` then is ``"explicit"``. The picture
            of waves needs frames some 1e-4 s apart; with 60 links they take 24 MB for each second of the walk.
        on_progress: Called before kernels are compiled and after each launch, several times a second.
        settings: Any other field of :class:`Parameters`, :class:`Scene` or :class:`Options`, by its name or the
            paper's symbol, such as ``mu_fc``; ``warpchain parameters`` lists them.

    Returns:
        The walk; look at ``status`` before ``dx``.

    Raises:
        InputError: A value is refused; nothing has been computed. It is a ``ValueError``.

    Warns:
        InputWarning: A parameter looks like one in another unit.
    """
    named = {"links": links, "frequency": frequency, "method": method, "tolerance": tolerance, "start": start}
    for symbol in settings:
        name = full_name(symbol)
        if name in named:
            raise InputError(f"{symbol}: an argument of its own has this value; give {name}=…")
    given: dict[str, object] = {name: value for name, value in named.items() if value is not None}
    given.update(settings)
    loads = _truth(record_loads, "record_loads")
    if setup is None:
        sections = by_section(given)
        setup = complete_setup(DEFAULT_PRESET if preset is None else preset, sections, seed, loads)
        parameters = plain(sections["parameters"], "parameters")
        warn_of_units((f"parameters.{name}", name, value) for name, value in parameters.items())
    else:
        _check_repeated(setup, given if preset is None else {"preset": preset, **given}, seed)
    return run_walk(
        setup,
        seed=seed,
        frame_interval=frame_interval,
        record_before=record_before,
        record_loads=loads,
        on_progress=on_progress,
    )


def _check_repeated(setup: object, others: Mapping[str, object], seed: Whole | None) -> None:
    """Refuse what is no complete setup, settings beside one, and what is no seed, by an `InputError`."""
    if not isinstance(setup, Setup):
        raise InputError(
            f"setup: {shown(setup)} is none of a walk; give setup of a WalkResult, such as load_walk(…).setup"
        )
    if others:
        raise InputError(f"{', '.join(others)}: given together with setup, which is complete; leave one out")
    if seed is not None:
        checked_whole(plain(seed, "seed"), "seed", 0, LARGEST_SEED)


def setup_walk(preset: str, settings: Mapping[str, object], seed: Whole | None, records_loads: bool = False) -> Setup:
    """The setup of settings by name or symbol; arguments and errors as of `complete_setup`."""
    return complete_setup(preset, by_section(settings), seed, records_loads)


def complete_setup(
    preset: str, sections: Mapping[str, Mapping[str, object]], seed: Whole | None, records_loads: bool = False
) -> Setup:
    """Check values by section, complete them, and draw the sample of a seed.

    From the seed's generator come first the parameters, then phase and clearance, of what is not set, as in the first
    walk of a sweep. `records_loads` is as in :func:`resolve`.

    Raises:
        InputError: A name is unknown or a value is refused.
    """
    setup = resolve(preset, **sections, records_loads=records_loads)
    kept = {*sections["scene"], *sections["parameters"]}
    return setup if seed is None else sampled(setup, random_generator(plain(seed, "seed")), kept=kept)


def run_walk(
    setup: Setup,
    *,
    seed: Whole | None = None,
    frame_interval: Number | None = 2e-3,
    record_before: Number | None = None,
    record_loads: bool = False,
    on_progress: OnProgress | None = None,
) -> WalkResult:
    """Run a walk whose setup is complete, samples drawn; the seed is only noted. The rest is as of :func:`walk`."""
    started = time.perf_counter()
    frame_every, between = _frame_marks(plain(frame_interval, "frame_interval"), setup.options)
    before = _time_before(plain(record_before, "record_before"), frame_every) if setup.scene.start != "ellipse" else 0.0

    if record_loads:
        check_has_joint_forces(setup.options)
        if frame_every is None:
            raise InputError("record_loads: loads are kept with frames, but frame_interval is None; give one")

    def watch(run: WalkRun, compiling: bool) -> None:
        if on_progress is not None:
            phase = "compile" if compiling else run.phase.value
            on_progress(Progress(phase, run.walk_time or run.simulated_time, run.speed, run.attempts))

    keep = Keep(series_every=1, frame_every=frame_every, frame_interval=between, loads=record_loads, before=before)
    with gpu_turn([setup.options.device]):
        ((_, run),) = run_setups([setup], keeps=[keep], watch=watch)
        return WalkResult(
            **run.outcome(),
            **run.recorder.motion(),
            setup=setup,
            seed=plain(seed),
            versions=versions(),
            wall_time=time.perf_counter() - started - run.compile_time,
        )


def _frame_marks(frame_interval: object, options: Options) -> tuple[int | None, float]:
    """Whole samples between two kept frames, None for no frames, and their time if it is less than a sample, else 0.

    Raises:
        InputError: it is no such time.
    """
    if frame_interval is None:
        return None, 0.0
    interval = checked_positive(frame_interval, "frame_interval", "time in s")
    if not SHORTEST_INTERVAL <= interval < LONGEST_INTERVAL:
        raise InputError(
            f"frame_interval: {shown(interval)} is not between {SHORTEST_INTERVAL} s and {LONGEST_INTERVAL} s; "
            "give a time between, or None"
        )
    samples = interval / options.record_interval
    return (round(samples), 0.0) if samples > 0.999 else (1, float(interval))


def _time_before(record_before: float | None, frame_every: int | None) -> float:
    """Time [s] before the release that is kept, or an `InputError`."""
    if record_before is None:
        return RECORD_BEFORE if frame_every is not None else 0.0
    is_number = isinstance(record_before, int | float) and not isinstance(record_before, bool)
    if not (is_number and 0 <= record_before <= LONGEST_INTERVAL):
        raise InputError(
            f"record_before: {shown(record_before)} is not a time in s from 0 to {LONGEST_INTERVAL}; give one, or None"
        )
    if record_before > 0 and frame_every is None:
        raise InputError("record_before: a time is given, but frame_interval is None; give a frame_interval as well")
    return float(record_before)


def _truth(value: object, name: str) -> bool:
    """A truth value, NumPy's included, or an `InputError`."""
    value = plain(value, name)
    if not isinstance(value, bool):
        raise InputError(f"{name}: {shown(value)} is not a truth value; give True or False")
    return value
