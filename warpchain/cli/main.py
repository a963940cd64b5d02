"""The command `warpchain`.

Exit status: 0 when the walk ended as it should, 1 when it failed, 2 when the input is refused or a file
cannot be read or written, 130 when interrupted. Values go through the same door as keyword arguments and YAML
files, so they are refused in the same words. Heavy libraries are imported by the functions that need them:
help is quick.
"""

import io
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, NoReturn

import typer

from warpchain.cli.bench_commands import bench_app
from warpchain.cli.speed_commands import bench
from warpchain.cli.sweep_commands import add_commands
from warpchain.inputs.methods import METHODS

if TYPE_CHECKING:
    from warpchain.inputs.setup import Setup

FAILED: Final = 1
REFUSED: Final = 2
INTERRUPTED: Final = 130
"""Exit statuses; the last one is what typer makes of Ctrl-C."""

Sections = dict[str, dict[str, object]]

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit.

    Args:
        arguments: words after the name of the command; by default those of this process.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal without Δ gets a question mark
    try:
        status = app(arguments, prog_name="warpchain", standalone_mode=False)
    except typer.TyperException as error:
        context = getattr(error, "ctx", None)
        command = context.command_path if context is not None else "warpchain"
        _refuse(f"{error.format_message().rstrip('.')}; see {command} --help", error.exit_code)
    except OSError as error:
        _refuse(str(error))
    except ValueError as error:
        from warpchain.inputs.validation import InputError

        if not isinstance(error, InputError):
            raise
        _refuse(str(error))
    except KeyboardInterrupt:
        status = INTERRUPTED
    if status == INTERRUPTED:
        print("interrupted", file=sys.stderr)
    sys.exit(status)


def _refuse(problem: str, status: int = REFUSED) -> NoReturn:
    print("error:", " ".join(problem.split()), file=sys.stderr)
    sys.exit(status)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print("warpchain", version("warpchain"))
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _warpchain(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    """Walking roller chains: a loop of chain, spun up on a sprocket, is dropped and walks away."""
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command()
def walk(
    links: Annotated[
        str | None,
        typer.Option(metavar="N", help="Number of links of the loop, an even number. Default: 60."),
    ] = None,
    frequency: Annotated[
        str | None,
        typer.Option(metavar="HZ", help="Turns of the sprocket per second, in Hz. Default: 15."),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="rest: hang on the sprocket and spin up; spinning: circulate on it already; "
            "ellipse: circulate without a sprocket. Default: rest.",
        ),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Parameters to start from. paper: Table 1 of the paper; soft: softer joints, many times "
            "faster. Default: paper.",
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="standard: hybrid at 1e-3, joints softened on the sprocket and in the pile, on a GPU the next; "
            "explicit: os32 at 1e-3, softened likewise; reference: rkf78 at 1e-6, as in the paper; or an integrator, "
            f"{'; '.join(f'{name}: {title}' for name, title in METHODS.items())}. Default: standard.",
        ),
    ] = None,
    tolerance: Annotated[
        str | None,
        typer.Option(
            "--tol",
            metavar="NUMBER",
            help="Error allowed in a step: absolute, in SI units (m, rad, m/s, rad/s), and relative alike. "
            "Default: that of the word, 1e-6 for an integrator, 1e-4 for hybrid.",
        ),
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Where it runs: cpu, cuda (the first GPU) or cuda:N. Default: cpu."),
    ] = None,
    assignments: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Any other value by its name, in SI units, such as clearance=0.005 (in m) or "
            "parameters.floor_friction=0.3; may be repeated.",
        ),
    ] = None,
    seed: Annotated[
        str | None,
        typer.Option(
            metavar="S",
            help="Draw parameters, phase and clearance at random: one Monte Carlo sample for each whole "
            "number. Without it: the means of Table 1, phase 0.",
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.yaml",
            help="Read preset, scene, options and parameters (in SI units) from a file; what the command "
            "line gives counts more.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            help="Write walk.h5, figure5.png, film_strip.png and, of a chain on a sprocket, loop.png to this folder; "
            "files of these names are replaced.",
        ),
    ] = None,
    animation: Annotated[
        Literal["gif", "mp4", "html"] | None,
        typer.Option("--animate", help="Write walk.gif, walk.mp4 or walk.html to the folder as well."),
    ] = None,
    frame_interval: Annotated[
        str | None,
        typer.Option(
            metavar="SECONDS",
            help="Simulated time between two recorded pictures of the chain, in s; needs a folder. Default: 0.002.",
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object, in SI units, instead of the table.")
    ] = False,
) -> None:
    """Let one chain walk: hang it on its sprocket, spin it up, drop it and follow it until it rests."""
    from warpchain.cli.terminal import print_walk, progress_text, status_line, try_folder, write_files
    from warpchain.run.single_walk import run_walk

    named = {
        "links": links,
        "frequency": frequency,
        "start": start,
        "method": method,
        "tolerance": tolerance,
        "device": device,
    }
    given = _given_values({name: text for name, text in named.items() if text is not None}, assignments or [])
    chosen_seed = None if seed is None else _seed(seed)
    setup = _setup(config, preset, given, chosen_seed)
    interval = _frame_interval(output, animation, frame_interval)
    if output is not None:
        try_folder(output)

    with status_line() as show:
        result = run_walk(
            setup,
            seed=chosen_seed,
            frame_interval=interval,
            on_progress=lambda progress: show(progress_text(progress)),
        )
    if as_json:
        print(json.dumps(result.to_dict(), indent=2, allow_nan=False))
    else:
        print_walk(result)
    if output is not None:
        for path in write_files(result, output, animation):
            if not as_json:
                print(path)
    if not result.status.ok:
        print(f"{result.status.label}: {result.status.sentence}", file=sys.stderr)
        raise typer.Exit(FAILED)


add_commands(app)
bench_app.callback(invoke_without_command=True)(bench)
app.add_typer(bench_app, name="bench")


def _given_values(named: Mapping[str, str], assignments: Sequence[str]) -> Sections:
    """Values of the command line by section; named options and `NAME=VALUE` are on a par.

    Raises:
        InputError: an assignment is not of that form, its name is unknown, or a name is given twice.
    """
    from warpchain.inputs.validation import InputError, shown

    pairs = list(named.items())
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise InputError(f"--set: {shown(assignment)} gives no value; write NAME=VALUE, as in clearance=0.005")
        pairs.append((name.strip(), text))
    given: Sections = {"parameters": {}, "scene": {}, "options": {}}
    for written, text in pairs:
        section, name = _located(written)
        if name in given[section]:
            raise InputError(f"{section}.{name}: given twice on the command line; give it once")
        given[section][name] = _parsed(f"{section}.{name}", text)
    return given


def _seed(text: str) -> int:
    """The number of a sample.

    Raises:
        InputError: the text is no whole number, or too large.
    """
    from warpchain.inputs.distributions import random_generator

    seed: int = _parsed("seed", text)
    random_generator(seed)
    return seed


def _located(name: str) -> tuple[str, str]:
    """Section and field of a name such as `clearance` or `scene.clearance`.

    Raises:
        InputError: there is no such field.
    """
    from warpchain.inputs.options import Options
    from warpchain.inputs.parameters import Parameters
    from warpchain.inputs.scene import Scene
    from warpchain.inputs.validation import InputError, shown, suggestion

    fields = {
        "parameters": list(Parameters.model_fields),
        "scene": list(Scene.model_fields),
        "options": list(Options.model_fields),
    }
    dotted = {f"{section}.{field}": (section, field) for section, names in fields.items() for field in names}
    plain = {field: (section, field) for section, field in dotted.values()}
    known = dotted if "." in name else plain
    if name not in known:
        raise InputError(f"--set {shown(name)}: unknown name; {suggestion(name, known)}")
    return known[name]


def _parsed(path: str, text: str) -> Any:
    """The value of a text, read as in a YAML file.

    Raises:
        InputError: the text is not YAML.
    """
    import yaml

    from warpchain.inputs.validation import InputError, shown
    from warpchain.inputs.yaml_files import Loader

    try:
        return yaml.load(text, Loader=Loader)
    except (yaml.YAMLError, ValueError, RecursionError):
        raise InputError(f"{path}: {shown(text)} cannot be read; give a number, true, false or a name") from None


def _setup(config: Path | None, preset: str | None, given: Sections, seed: int | None) -> "Setup":
    """The setup of a walk: the file's values, the command line's over them, and the sample of the seed.

    Raises:
        InputError: something is refused; one line with the field's path and the remedy.
    """
    from warpchain.inputs.setup import read_setup, resolve
    from warpchain.inputs.validation import InputError
    from warpchain.run.single_walk import setup_walk

    file_preset, sections = read_setup(config) if config is not None else ("paper", {name: {} for name in given})
    preset = file_preset if preset is None else preset
    if preset is None:
        raise InputError("preset: missing; name the parameters to start from, such as preset: paper")
    for section, values in given.items():
        if isinstance(sections[section], Mapping):  # what is none is left for `resolve` to refuse
            sections[section] = {**sections[section], **values}
    resolve(preset, **sections)  # setup_walk knows names only; here a field in the wrong section is refused
    flat = {name: value for values in sections.values() for name, value in values.items()}
    return setup_walk(preset, flat, seed)


def _frame_interval(output: Path | None, animation: str | None, text: str | None) -> float | None:
    """Time between two frames [s], None if nobody wants frames.

    Raises:
        InputError: an option needs a folder, a length of time is no such thing, or MP4 cannot be written.
    """
    from importlib.util import find_spec

    from warpchain.inputs.validation import InputError, shown

    for option, value in (("--animate", animation), ("--frame-interval", text)):
        if value is not None and output is None:
            raise InputError(f"{option}: there is no folder to write to; add -o DIR")
    if animation == "mp4" and find_spec("imageio_ffmpeg") is None:
        raise InputError("--animate mp4: imageio-ffmpeg is not installed; pip install 'warpchain[video]'")
    interval = 2e-3 if text is None else _parsed("--frame-interval", text)
    if isinstance(interval, bool) or not isinstance(interval, int | float) or not 0 < interval <= sys.float_info.max:
        raise InputError(f"--frame-interval: {shown(interval)} is not a positive time in s; give one, as in 0.002")
    return float(interval) if output is not None else None
