"""`warpchain.walk`, which users and the command `walk` call to simulate one walk."""

from typing import TYPE_CHECKING, Never, Unpack

from warpchain.chain.keep import FRAME_INTERVAL
from warpchain.chain.resolution import MAY_BE_NONE, continued, resolve
from warpchain.chain.setup import DEFAULT_PRESET, Setup, State
from warpchain.inputs.distributions import Seed
from warpchain.inputs.fields import by_section
from warpchain.inputs.keywords import takes_fields
from warpchain.inputs.validation import InputError, by_name, checked, shown
from warpchain.results.one_walk import OnProgress, run_walk
from warpchain.results.walk_result import WalkResult
from warpchain.run.progress_bar import changing_line, walk_progress_text
from warpchain.sweeps.block import refuse_axes

if TYPE_CHECKING:
    from warpchain.typed import WalkFields


@takes_fields("parameters", "scene", "options")
def walk(
    *,
    preset: str | None = None,
    setup: Setup | None = None,
    seed: int | None = None,
    frame_interval: float | None = FRAME_INTERVAL,
    record_before: float | None = None,
    record_joint_forces: bool = False,
    on_progress: OnProgress | None = None,
    **settings: "Unpack[WalkFields[Never]]",
) -> WalkResult:
    """Simulate one walk: hang a chain on its sprocket, spin it up, release it and follow it to rest.

    Args:
        links: Number of links n; even if inner and outer links differ.
        frequency: Frequency of the sprocket [Hz].
        preset: Set of physical parameters: ``"paper"`` (Table 1) or ``"soft"`` (softer joints; with ``reference`` 15 to
            19 times fewer steps). None: ``"paper"``.
        method: Solver profile: ``"standard"``, ``"explicit"`` or ``"reference"``; or an integrator, a key of
            ``warpchain.inputs.methods.METHODS`` such as ``"dp5"``. None: ``"standard"``. On a GPU, with a tilting plane
            and with ``record_joint_forces``, ``"standard"`` means ``"explicit"``.
        tolerance: Maximum error of a step, absolute (SI units) and relative. None: that of the profile; 1e-6 for an
            integrator, 1e-4 for ``"hybrid"``.
        start: How the walk begins: ``"rest"``, ``"spinning"`` or ``"ellipse"``; or a :class:`State`, from which the
            walk continues. An unchanged state of a walk continues that walk bit for bit. With a state, only
            parameters, options, limits of the walk, floors and properties of single links can be set. None: ``"rest"``.
        setup: Setup of another walk, ``other.setup``, which is repeated bit for bit. It is complete, so no other
            setting is possible; ``seed`` is only recorded in the result.
        seed: Seed with which parameters, phase and clearance that are not set are sampled from their distributions.
            None: Table 1's means, phase 0.
        frame_interval: Time between recorded frames of all joints [s], at least 1e-6, rounded to whole record
            intervals; None: no frames. Recording does not change the walk: a frame is taken at the end of the first
            step after its time.
        record_before: Time before the release that is recorded as well, with the joint forces, as ``before_release``
            of the result [s]; 0: none; None: 0.5 s if frames are recorded. A loop under scaled loads is not recorded;
            ``extra_hold`` holds the loop longer.
        record_joint_forces: Whether to record ``frame_forces`` and ``frame_moments`` of the joints with each frame
            after the release. The figure of waves needs frames every 1e-4 s or so; with 60 links they take 24 MB for
            each second of the walk.
        on_progress: Function that is called before kernels are compiled, if any are, and after each launch, several
            times a second. None: a notebook shows a progress line.
        settings: Any other field of :class:`Parameters`, :class:`Scene` or :class:`Options`, by its name or the
            paper's symbol, e.g. ``mu_fc``; ``warpchain parameters`` lists them.

    Returns:
        The walk. Check ``status`` before you use ``dx``, which is NaN unless the chain came to rest.

    Raises:
        InputError: A value is refused, before anything is computed. It is a ``ValueError``.
    """
    given = by_name({name: value for name, value in settings.items() if value is not None or name not in MAY_BE_NONE})
    refuse_axes(given)
    loads, seed = checked(record_joint_forces, "record_joint_forces", bool), checked(seed, "seed", Seed | None)
    start = given.get("start")
    if isinstance(start, State) and setup is None:
        for name, value in {"preset": preset, "seed": seed}.items():
            if value is not None:
                raise InputError(f"{name}: not possible with a state, which has its own chain; remove it")
        del given["start"]
        setup = continued(start, by_section(given, walk.__kwdefaults__ or ()))
    elif setup is None:
        preset = DEFAULT_PRESET if preset is None else preset
        setup = resolve(preset, **by_section(given, walk.__kwdefaults__ or ()), seed=seed, loads=loads)
    else:
        if not isinstance(setup, Setup):
            raise InputError(
                f"setup: expected the setup of a walk, got {shown(setup)}; pass walk.setup, e.g. load_walk(…).setup"
            )
        if others := [*["preset"] * (preset is not None), *given]:
            raise InputError(f"{', '.join(others)}: not possible with setup, which is complete; remove one")
    with changing_line(in_terminals=False) as show:
        return run_walk(
            setup,
            seed=seed,
            frame_interval=frame_interval,
            record_before=record_before,
            record_joint_forces=loads,
            on_progress=on_progress
            or (lambda progress: show(walk_progress_text(progress), progress.phase == "compile")),
        )
