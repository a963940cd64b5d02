"""One walk, from a user's few words to its result."""

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
        links: Number of links n, even where two kinds alternate.
        frequency: Turns of the sprocket per second [Hz].
        preset: None or ``"paper"`` (Table 1), or ``"soft"`` (softer joints, with ``reference`` 15 to 19
            times fewer steps).
        method: ``"standard"`` (``"hybrid"`` at 3e-3, with joints softened on the sprocket and in the pile; on a
            GPU, and with ``record_joint_forces``, the next), ``"explicit"`` (``"os32"`` at 3e-3, softened likewise),
            ``"reference"`` (``"rkf78"`` at 1e-6, as in the paper), or an integrator: a key of
            ``warpchain.inputs.methods.METHODS``, such as ``"dp5"``.
        tolerance: Error allowed in a step, absolute (SI units) and relative alike; None: the method's, 1e-6 for an
            integrator, 1e-4 for ``"hybrid"``, and of ``"standard"`` and ``"explicit"`` 3e-3 while joints are soft.
        start: ``"rest"``, ``"spinning"`` or ``"ellipse"``; or a :class:`State`, from which the walk goes on to
            its end, by itself the rest of the same walk to the bit. Beside a state only parameters, options, limits
            of the walk, floors and what its links have of their own are taken, and nothing is drawn.
        setup: ``setup`` of another walk, which is repeated to the bit, whatever was drawn for it. It is complete: no
            other setting is taken beside it, nothing is drawn, and ``seed`` is only noted in the result.
        seed: Draw those parameters, phase and clearance that are not given from their distributions; None: Table 1's
            means, phase 0.
        frame_interval: Time between kept frames of all joints [s], at least 1e-6; None keeps none. It is rounded to
            whole samples; less than a ``record_interval`` holds after the release. Frames and samples do not change
            the walk: they are taken at the end of the first step after their time.
        record_before: Time [s] before the release of which frames and samples are kept as well, as ``before_release``
            of the result, with the forces in the joints; None: 0.5 s if frames are kept; 0: none. Nothing is kept of
            a loop under multiplied loads; ``extra_hold`` makes room for more.
        record_joint_forces: Whether ``frame_forces`` and ``frame_moments`` of the joints are recorded with each frame
            after the release. No method with rigid joints has them: ``"standard"`` then is ``"explicit"``. The picture
            of waves needs frames some 1e-4 s apart; with 60 links they take 24 MB for each second of the walk.
        on_progress: Called before kernels are compiled, if any are, and after each launch, several times a second; by
            default a notebook shows a line of progress.
        settings: Any other field of :class:`Parameters`, :class:`Scene` or :class:`Options`, by its name or the
            paper's symbol, such as ``mu_fc``; ``warpchain parameters`` lists them.

    Returns:
        The walk; look at ``status`` before ``dx``.

    Raises:
        InputError: A value is refused; nothing has been computed. It is a ``ValueError``.
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
        setup = continued(start, by_section(given))
    elif setup is None:
        preset = DEFAULT_PRESET if preset is None else preset
        setup = resolve(preset, **by_section(given), seed=seed, loads=loads)
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
