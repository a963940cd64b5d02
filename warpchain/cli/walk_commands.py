"""The commands about single walks: walk, animate, and the figures of a saved walk."""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from warpchain.cli.words import JSON, argument, option, output
from warpchain.inputs.methods import METHODS
from warpchain.inputs.starts import STARTS

FAILED: Final = 1
"""Exit status of a command whose walks failed."""

_STARTS: Final = f"{'; '.join(f'{word}: {start.described}' for word, start in STARTS.items())}. Default: rest."
_PRESETS: Final = "Parameters to start from. paper: Table 1 of the paper; soft: softer joints. Default: paper."
_METHODS: Final = (
    "standard: hybrid at 3e-3, joints softened on the sprocket and in the pile, on a GPU the next; explicit: os32 at "
    "3e-3, softened likewise; reference: rkf78 at 1e-6, as in the paper; or an integrator, "
    f"{'; '.join(f'{name}: {title}' for name, title in METHODS.items())}. Default: standard."
)
_TOLERANCE: Final = (
    "Error allowed in a step, in SI units and relative alike. Default: that of the word, 1e-6 for an integrator, 1e-4 "
    "for hybrid."
)
_SET: Final = (
    "Any other value by its name or symbol, in SI units, as clearance=0.005 or mu_fc=0.3; may be repeated. "
    "`warpchain parameters` lists them."
)
_SEED: Final = "Draw what is not given at random, one sample for each whole number. Without it: means, phase 0."
_CONFIG: Final = "Read preset, scene, options and parameters from a file; what the command line gives counts more."
_LIKE: Final = (
    "Take setup and seed of a saved walk, its file or folder, or with --index of a walk of a sweep: its folder or a "
    "merged file. That repeats it to the bit; other options change single values. Not with --config, --preset, --seed."
)
_INDEX: Final = "Number of the walk in the sweep that --like names, as in the column index of its results."
_OUTPUT: Final = (
    "Write walk.h5 and film_strip.png to this folder; pictures of an earlier walk there are deleted. `warpchain plot` "
    "draws the others, `warpchain animate` a film."
)
_FILM: Final = "The file to write; its name ends in .gif, .mp4 or .html. Default: walk.gif beside the walk."
_FRAMES: Final = "Simulated time between two pictures of the chain, in s; needs a folder. Default: 0.002."
_LOADS: Final = (
    "Record forces and moments of the joints with each picture, by default every 0.0001 s; needs a folder. standard "
    "then is explicit: rigid joints have no forces. 60 links take 24 MB a second."
)

_Text = str | None


def walk(
    links: Annotated[_Text, option("N", "Number of links of the loop, even unless all are alike. Default: 60.")] = None,
    frequency: Annotated[_Text, option("HZ", "Turns of the sprocket per second, in Hz. Default: 15.")] = None,
    start: Annotated[_Text, option("NAME", _STARTS)] = None,
    preset: Annotated[_Text, option("NAME", _PRESETS)] = None,
    method: Annotated[_Text, option("NAME", _METHODS)] = None,
    tolerance: Annotated[_Text, option("NUMBER", _TOLERANCE, "--tol")] = None,
    device: Annotated[_Text, option("NAME", "Where it runs: cpu, cuda (first GPU) or cuda:N. Default: cpu.")] = None,
    assignments: Annotated[list[str] | None, option("NAME=VALUE", _SET, "--set")] = None,
    seed: Annotated[_Text, option("S", _SEED)] = None,
    config: Annotated[Path | None, option("FILE.yaml", _CONFIG)] = None,
    like: Annotated[Path | None, option("PATH", _LIKE)] = None,
    index: Annotated[_Text, option("I", _INDEX)] = None,
    folder: Annotated[Path | None, output("DIR", _OUTPUT)] = None,
    frame_interval: Annotated[_Text, option("SECONDS", _FRAMES)] = None,
    record_loads: Annotated[bool, typer.Option("--record-loads", help=_LOADS)] = False,
    as_json: Annotated[bool, JSON] = False,
) -> None:
    """Spin up one chain, drop it, and follow it until it rests."""
    from warpchain.chain.resolution import SECTIONS, continued, resolve
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
    own: Mapping[str, Mapping[str, Any]] = {}
    number = None if seed is None else checked(parse_yaml(seed, "seed"), "seed", Seed)
    if like is not None:
        for name, value in (("--config", config), ("--preset", preset), ("--seed", seed)):
            if value is not None:
                raise InputError(f"{name}: given together with --like, and a saved walk has its own; leave one out")
        found = saved(like, "give a saved walk, or the folder or merged file of a sweep and --index")
        if isinstance(found, WalkResult):
            if index is not None:
                raise InputError(f"--index: given, but {like} is a single walk; leave it out")
            base, number = found.setup, found.seed
        elif index is None:
            raise InputError(f"--like: {like} has many walks; give --index, the number of one, as well")
        else:
            block, place = found.located(parse_yaml(index, "--index"))
            base, number = block.setup_at(place), block.origin.seed
        preset, kept = base.preset, base.options.beside(given["options"])
        own = {name: getattr(base, name).model_dump() for name in SECTIONS} | {"options": kept}
    elif config is not None:
        from warpchain.sweeps.sweep_file import read_walk_file  # its grammar takes long to build

        file_preset, own = read_walk_file(config)
        preset = preset or file_preset
        if preset is None:
            raise InputError("preset: missing; name the parameters to start from, such as preset: paper")
    elif index is not None:
        raise InputError("--index: names a walk of a sweep, but --like is missing; give --like DIR, the sweep")
    if like is not None and base.start is not None:
        setup = continued(base.start, given)
    else:
        sections = {name: {**own.get(name, {}), **values} for name, values in given.items()}
        setup = resolve(preset or DEFAULT_PRESET, **sections, seed=number, loads=record_loads)
    if folder is None and (frame_interval is not None or record_loads):
        name = "--record-loads" if frame_interval is None else "--frame-interval"
        raise InputError(f"{name}: there is no folder to write to; add -o DIR")
    usual = None if folder is None else 1e-4 if record_loads else 2e-3
    interval = usual if frame_interval is None else parse_yaml(frame_interval, "frame_interval")
    if folder is not None:
        try_walk_folder(folder)
    with changing_line() as show:
        result = run_walk(
            setup,
            seed=number,
            frame_interval=interval,
            record_loads=record_loads,
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


def animate(
    walk: Annotated[Path, argument("PATH", "Folder or file of a saved walk.")],
    path: Annotated[Path | None, output("FILE", _FILM)] = None,
    fps: Annotated[float, option("NUMBER", "Pictures per second; in HTML the browser decides. Default: 30.")] = 30.0,
    slow: Annotated[float, option("NUMBER", "Playing time per simulated time. Default: 4.")] = 4.0,
) -> None:
    """Write a film of a saved walk: GIF, MP4 or HTML with a player."""
    from warpchain.cli.output import RECORD
    from warpchain.inputs.validation import InputError, printable
    from warpchain.results.walk_result import load_walk

    record = walk / RECORD if walk.is_dir() else walk
    result, path = load_walk(walk), path or record.with_suffix(".gif")
    try:
        result.animate(path, fps=fps, slow=slow)
    except (ValueError, ImportError) as error:
        raise InputError(str(error)) from None
    print(printable(str(path)))


def _given_values(named: Mapping[str, str | None], assignments: Sequence[str]) -> dict[str, dict[str, object]]:
    """Values of the command line by section; named options and `NAME=VALUE` are on a par."""
    from warpchain.inputs.validation import SECTION_OF, InputError, by_section, dotted_name, shown
    from warpchain.inputs.yaml_files import parse_yaml

    pairs = [(name, text) for name, text in named.items() if text is not None]
    for assignment in assignments:
        written, equals, text = assignment.partition("=")
        if not equals:
            raise InputError(f"--set: {shown(assignment)} gives no value; write NAME=VALUE, as in clearance=0.005")
        written = written.strip()
        pairs.append((dotted_name(written, f"--set {shown(written)}"), text))
    values: dict[str, object] = {}
    for name, text in pairs:
        path = f"{SECTION_OF[name]}.{name}"
        if name in values:
            raise InputError(f"{path}: given twice on the command line; give it once")
        values[name] = parse_yaml(text, path)
    return by_section(values)
