"""The commands for single walks: walk and animate."""

import contextlib
import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from warpchain.chain.keep import FRAME_INTERVAL
from warpchain.cli.words import JSON, argument, option, output
from warpchain.inputs.methods import METHODS
from warpchain.inputs.starts import DESCRIBED

if TYPE_CHECKING:
    from warpchain.results.sweep_result import SweepResult

FAILED: Final = 1
"""Exit status of a command whose walks failed."""

_STARTS: Final = f"{DESCRIBED}. Default: rest."
_PRESETS: Final = "Parameters to start from. paper: Table 1 of the paper; soft: softer joints. Default: paper."
_METHODS: Final = (
    "A solver profile: standard (hybrid on a CPU), explicit (os32, also on a GPU) or reference (rkf78, as in the "
    f"paper); or an integrator, {'; '.join(f'{name}: {title}' for name, title in METHODS.items())}. Default: standard."
)
_TOLERANCE: Final = (
    "Maximum error of a step, absolute in SI units and relative. Default: that of the profile; 1e-6 for an integrator, "
    "1e-4 for hybrid."
)
_SET: Final = (
    "Set any other value by its name or symbol, in SI units, e.g. clearance=0.005 or mu_fc=0.3; may be repeated. "
    "`warpchain parameters` lists all names."
)
_SEED: Final = (
    "Sample every parameter that you do not set from its distribution; each integer seed gives one sample. "
    "Default: mean values and phase 0."
)
_SAMPLES: Final = (
    "Run N samples of the walk, each with its own sampled values, and show the mean Δx and its standard error; with "
    "-o DIR also write the sweep of these walks and samples.png. A larger N adds samples to DIR."
)
_CONFIG: Final = "Read preset, scene, options and parameters from a YAML file; command-line options take precedence."
_LIKE: Final = (
    "Repeat a saved walk (its file or folder) or, with --index, a walk of a sweep (its folder or a merged file), "
    "bit for bit. Other options change single values; --config, --preset and --seed are not possible."
)
_INDEX: Final = "Number of the walk in the sweep of --like, from the column index of its results."
_OUTPUT: Final = (
    "Write walk.h5 and film_strip.png to this folder; figures of an earlier walk there are deleted. `warpchain plot` "
    "draws the other figures, `warpchain animate` an animation."
)
_FILM: Final = "File to write; its name ends in .gif, .mp4 or .html. Default: walk.gif beside the walk."
_LOADED_FRAMES: Final = 1e-4
"""Time [s] between two frames with joint forces, unless another is given."""
_FRAMES: Final = f"Simulated time between two frames, in s; needs a folder. Default: {FRAME_INTERVAL:g}."
_LOADS: Final = (
    f"Record the forces and moments of the joints with each frame, by default every {_LOADED_FRAMES:g} s; needs a "
    "folder. standard then means explicit, because rigid joints have no forces. 60 links take 24 MB per simulated "
    "second."
)

_Text = str | None


def walk(
    links: Annotated[_Text, option("N", "Number of links; even if inner and outer links differ. Default: 60.")] = None,
    frequency: Annotated[_Text, option("HZ", "Frequency of the sprocket, in Hz. Default: 15.")] = None,
    start: Annotated[_Text, option("NAME", _STARTS)] = None,
    preset: Annotated[_Text, option("NAME", _PRESETS)] = None,
    method: Annotated[_Text, option("NAME", _METHODS)] = None,
    tolerance: Annotated[_Text, option("NUMBER", _TOLERANCE, "--tol")] = None,
    device: Annotated[_Text, option("NAME", "Where it runs: cpu, cuda (first GPU) or cuda:N. Default: cpu.")] = None,
    assignments: Annotated[list[str] | None, option("NAME=VALUE", _SET, "--set")] = None,
    seed: Annotated[_Text, option("S", _SEED)] = None,
    samples: Annotated[int | None, option("N", _SAMPLES, min=1)] = None,
    config: Annotated[Path | None, option("FILE.yaml", _CONFIG)] = None,
    like: Annotated[Path | None, option("PATH", _LIKE)] = None,
    index: Annotated[_Text, option("I", _INDEX)] = None,
    folder: Annotated[Path | None, output("DIR", _OUTPUT)] = None,
    frame_interval: Annotated[_Text, option("SECONDS", _FRAMES)] = None,
    record_joint_forces: Annotated[bool, typer.Option("--record-joint-forces", help=_LOADS)] = False,
    as_json: Annotated[bool, JSON] = False,
) -> None:
    """Spin up one chain, drop it, and follow it until it rests."""
    from warpchain.chain.resolution import continued, resolve
    from warpchain.chain.setup import DEFAULT_PRESET
    from warpchain.cli.output import print_walk, saved, try_walk_folder, write_walk
    from warpchain.inputs.distributions import Seed
    from warpchain.inputs.validation import InputError, checked, printable
    from warpchain.inputs.yaml_files import parse_yaml
    from warpchain.results.one_walk import run_walk
    from warpchain.results.walk_result import WalkResult
    from warpchain.run.progress_bar import changing_line, walk_progress_text
    from warpchain.sweeps.block import refuse_axes

    named = {"links": links, "frequency": frequency, "start": start}
    given = _given_values(named | {"method": method, "tolerance": tolerance, "device": device}, assignments or [])
    for section in given.values():
        refuse_axes(section)
    if samples is not None:
        alone = {"--like": like, "--index": index, "--frame-interval": frame_interval}
        alone["--record-joint-forces"] = "asked" if record_joint_forces else None
        if others := [name for name, value in alone.items() if value is not None]:
            raise InputError(f"{others[0]}: only for one walk, not with --samples; remove one of them")
    own: Mapping[str, Mapping[str, Any]] = {}
    number = None if seed is None else checked(parse_yaml(seed, "seed"), "seed", Seed)
    if like is not None:
        for name, value in (("--config", config), ("--preset", preset), ("--seed", seed)):
            if value is not None:
                raise InputError(f"{name}: not possible with --like, which sets it; remove one")
        found = saved(like, "use a saved walk, or the folder or merged file of a sweep with --index")
        if isinstance(found, WalkResult):
            if index is not None:
                raise InputError(f"--index: not possible for {like}, a single walk; remove it")
            base, number = found.setup, found.seed
        elif index is None:
            raise InputError(f"--like: {like} has many walks; add --index, the number of one")
        else:
            block, place = found.located(parse_yaml(index, "--index"))
            base, number = block.setup_at(place), block.origin.seed
        preset, kept = base.preset, base.options.beside(given["options"])
        own = base.sections | {"options": kept}
    elif config is not None:
        from warpchain.sweeps.sweep_file import read_walk_file  # its grammar takes long to build

        file_preset, own = read_walk_file(config)
        preset = preset or file_preset
        if preset is None:
            raise InputError("preset: missing; set the parameters to start from, e.g. preset: paper")
    elif index is not None:
        raise InputError("--index: --like is missing; add --like DIR, the sweep that has this walk")
    sections = {name: {**own.get(name, {}), **values} for name, values in given.items()}
    if samples is not None:
        content = {"preset": preset or DEFAULT_PRESET, "samples": samples, "seed": number or 0, **sections}
        return _run_samples(content, folder, as_json)
    if like is not None and base.start is not None:
        setup = continued(base.start, given)
    else:
        setup = resolve(preset or DEFAULT_PRESET, **sections, seed=number, loads=record_joint_forces)
    if folder is None and (frame_interval is not None or record_joint_forces):
        name = "--record-joint-forces" if frame_interval is None else "--frame-interval"
        raise InputError(f"{name}: has no folder to write to; add -o DIR")
    usual = None if folder is None else _LOADED_FRAMES if record_joint_forces else FRAME_INTERVAL
    interval = usual if frame_interval is None else parse_yaml(frame_interval, "frame_interval")
    if folder is not None:
        try_walk_folder(folder)
    with changing_line() as show:
        result = run_walk(
            setup,
            seed=number,
            frame_interval=interval,
            record_joint_forces=record_joint_forces,
            on_progress=lambda progress: show(walk_progress_text(progress), progress.phase == "compile"),
        )
    paths: list[Path] = []
    try:
        if folder is not None:
            paths.extend(write_walk(result, folder))
    finally:  # a full disk does not take the numbers, nor `| head` the files
        if as_json:
            print(json.dumps(result.to_dict(), indent=2, allow_nan=False))
        else:
            print_walk(result)
            for path in paths:
                print(printable(str(path)))
    if not result.status.ok:
        print(f"{result.status.label}: {result.status.sentence}", file=sys.stderr)
        raise typer.Exit(FAILED)


def _run_samples(content: Mapping[str, object], folder: Path | None, as_json: bool) -> None:
    """Run the samples of one walk as a sweep of one cell, and show their mean; a folder keeps them, and a picture."""
    from warpchain.cli.output import print_samples, print_sweep
    from warpchain.inputs.validation import printable
    from warpchain.reports.samples_picture import samples_picture
    from warpchain.run.sweep_run import sweep
    from warpchain.status import Status

    with contextlib.nullcontext(folder) if folder else tempfile.TemporaryDirectory(prefix="warpchain-") as place:
        result = sweep({"version": 1, "name": "samples", **content}, place)
    if as_json:
        print_sweep(result, None, True)
    else:
        print_samples(result)
    if folder is not None and result.summary()[Status.AT_REST.label]:
        from warpchain.pictures.style import save_figure

        path = folder / "samples.png"
        save_figure(samples_picture(result), path)
        print(printable(str(path)))
    exit_if_any_failed(result)


def exit_if_any_failed(result: "SweepResult") -> None:
    """Say on standard error how many walks failed and what to try, and exit, if any did."""
    from warpchain.status import Status

    counts = result.summary()
    failed = [status for status in Status if not status.ok and status.label in counts]
    for status in failed:
        print(f"{counts[status.label]} {status.label}: {status.sentence}", file=sys.stderr)
    if failed:
        raise typer.Exit(FAILED)


def animate(
    walk: Annotated[Path, argument("PATH", "Folder or file of a saved walk.")],
    path: Annotated[Path | None, output("FILE", _FILM)] = None,
    fps: Annotated[float, option("NUMBER", "Pictures per second; in HTML the browser decides. Default: 30.")] = 30.0,
    slow: Annotated[float, option("NUMBER", "Playing time per simulated time. Default: 4.")] = 4.0,
) -> None:
    """Animate a saved walk as GIF, MP4 or HTML."""
    from warpchain.hdf5_files import WALK_FILE
    from warpchain.inputs.validation import InputError, printable
    from warpchain.results.walk_result import load_walk

    record = walk / WALK_FILE if walk.is_dir() else walk
    result, path = load_walk(walk), path or record.with_suffix(".gif")
    try:
        result.animate(path, fps=fps, slow=slow)
    except (ValueError, ImportError) as error:
        raise InputError(str(error)) from None
    print(printable(str(path)))


def _given_values(named: Mapping[str, str | None], assignments: Sequence[str]) -> dict[str, dict[str, object]]:
    """Values of the command line by section; named options and `NAME=VALUE` are on a par."""
    from warpchain.inputs.fields import SECTION_OF, by_section, dotted_name
    from warpchain.inputs.validation import InputError, shown
    from warpchain.inputs.yaml_files import parse_yaml

    pairs = [(name, text) for name, text in named.items() if text is not None]
    for assignment in assignments:
        written, equals, text = assignment.partition("=")
        if not equals:
            raise InputError(f"--set: expected NAME=VALUE, got {shown(assignment)}; write e.g. clearance=0.005")
        written = written.strip()
        pairs.append((dotted_name(written, f"--set {shown(written)}"), text))
    values: dict[str, object] = {}
    for name, text in pairs:
        path = f"{SECTION_OF[name]}.{name}"
        if name in values:
            raise InputError(f"{path}: given twice on the command line; remove one")
        values[name] = parse_yaml(text, path)
    return by_section(values)
