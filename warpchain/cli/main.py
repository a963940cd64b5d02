"""The command `warpchain`.

Exit status: 0 when the walk ended as it should, 1 when it failed, a file is damaged or a disk is full or broken, 2 when
the input is refused or a path cannot be read or written, 130 when interrupted. Values are checked like keyword
arguments and YAML files, so they are refused in the same words. Heavy libraries are imported by the functions that need
them, so that help is quick.
"""

import contextlib
import io
import json
import os
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, NoReturn, TextIO

import typer

from warpchain.cli import completions
from warpchain.cli.bench_commands import bench
from warpchain.cli.input_commands import parameters, schema
from warpchain.cli.interrupts import INTERRUPTED, interrupts_heard
from warpchain.cli.output_paths import output_path
from warpchain.cli.sweep_commands import FAILED, add_commands
from warpchain.cli.walk_commands import animate, setup_like
from warpchain.files import DISK_FAILURES, is_possible
from warpchain.inputs.methods import METHODS
from warpchain.version import VERSION

if TYPE_CHECKING:
    from warpchain.inputs.setup import Setup

REFUSED: Final = 2
"""Exit status beside `FAILED` and `INTERRUPTED`."""

Sections = dict[str, dict[str, object]]

app = typer.Typer(pretty_exceptions_enable=False)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit.

    Args:
        arguments: words after the name of the command; by default those of this process.
    """
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal without Δ gets a question mark
    for word in sys.argv[1:] if arguments is None else arguments:
        if not is_possible(word):
            _refuse([f"{ascii(word)[:100]}: has a NUL or a lone surrogate; leave it out"])
    with interrupts_heard() as heard:
        try:
            with _warnings_on_one_line():
                status = app(arguments, prog_name="warpchain", standalone_mode=False)
        except KeyboardInterrupt:
            status = INTERRUPTED
        except Exception as error:
            if not heard():  # else a library made another error of it
                _refuse_for(error)
                raise
            status = INTERRUPTED
        if status == INTERRUPTED:
            print("interrupted", file=sys.stderr)
    sys.exit(status)


def _refuse_for(error: Exception) -> None:
    """Print what was refused or failed, and exit; return if the error is a defect of the program."""
    from warpchain.inputs.validation import DamagedFileError, InputError
    from warpchain.run.lost_workers import LostWorkersError

    if isinstance(error, typer.TyperException):
        context = getattr(error, "ctx", None)
        command = context.command_path if context is not None else "warpchain"
        _refuse([f"{error.format_message().rstrip('.')}; see {command} --help"], error.exit_code)
    if isinstance(error, FileNotFoundError) and not _is_somewhere():
        _refuse(["working directory: it was deleted; change to another one"])
    if isinstance(error, OSError):
        _refuse([str(error)], FAILED if error.errno in DISK_FAILURES else REFUSED)
    if isinstance(error, InputError):
        _refuse(error.args, FAILED if isinstance(error, DamagedFileError) else REFUSED)
    if isinstance(error, LostWorkersError):
        _refuse([str(error)], FAILED)


def _is_somewhere() -> bool:
    """Whether the working directory of this process is still there."""
    try:
        os.getcwd()
    except FileNotFoundError:
        return False
    return True


@contextlib.contextmanager
def _warnings_on_one_line() -> Iterator[None]:
    """Print warnings about input as one line, without the line of code that gave them."""
    with warnings.catch_warnings():
        usual = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            from warpchain.inputs.validation import InputWarning, one_line

            if issubclass(category, InputWarning):
                print(one_line(str(message), "warning: "), file=sys.stderr)
            else:
                usual(message, category, filename, lineno, file, line)

        warnings.showwarning = show
        yield


def _refuse(problems: Sequence[str], status: int = REFUSED) -> NoReturn:
    """Print each problem on a line of its own and exit."""
    from warpchain.inputs.validation import one_line

    for problem in problems:
        print(one_line(problem, "error: "), file=sys.stderr)
    sys.exit(status)


def _print_version(wanted: bool) -> None:
    if wanted:
        print("warpchain", VERSION)
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
            autocompletion=completions.starts,
        ),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Parameters to start from. paper: Table 1 of the paper; soft: softer joints, 10 to 15 "
            "times fewer steps with reference, about as many with standard. Default: paper.",
            autocompletion=completions.presets,
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="standard: hybrid at 3e-3, joints softened on the sprocket and in the pile, on a GPU the next; "
            "explicit: os32 at 3e-3, softened likewise; reference: rkf78 at 1e-6, as in the paper; or an integrator, "
            f"{'; '.join(f'{name}: {title}' for name, title in METHODS.items())}. Default: standard.",
            autocompletion=completions.methods,
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
            help="Any other value by its name or symbol, in SI units, such as clearance=0.005 (in m), mu_fc=0.3 or "
            "parameters.floor_friction=0.3; may be repeated. `warpchain parameters` lists them.",
            autocompletion=completions.assignments,
        ),
    ] = None,
    seed: Annotated[
        str | None,
        typer.Option(
            metavar="S",
            help="Draw the parameters, phase and clearance that are not given at random: one Monte Carlo sample for "
            "each whole number. Without it: the means of Table 1, phase 0.",
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
    like: Annotated[
        Path | None,
        typer.Option(
            metavar="WALK.h5",
            help="Take setup and seed of a saved walk, which repeats it to the bit; other options change single "
            "values, and nothing is drawn anew. Not with --config, --preset or --seed.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            parser=output_path,
            help="Write walk.h5, figure5.png, film_strip.png, of a chain on a sprocket loop.png, and if its plane "
            "tilts tilt.png to this folder; files of these names are replaced.",
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
            help="Simulated time between two recorded pictures of the chain, in s; needs a folder; with --record-loads "
            "by default 0.0001. Default: 0.002.",
        ),
    ] = None,
    record_loads: Annotated[
        bool,
        typer.Option(
            "--record-loads",
            help="Record forces and moments of the joints with each picture after the release, and draw waves.png; "
            "needs a folder. standard then is explicit: rigid joints have no forces. 60 links take 24 MB a second.",
        ),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object, in SI units, instead of the table.")
    ] = False,
) -> None:
    """Let one chain walk: hang it on its sprocket, spin it up, drop it and follow it until it rests."""
    from warpchain.cli.terminal import print_walk, progress_text, status_line, try_walk_folder, write_files
    from warpchain.inputs.distributions import LARGEST_SEED
    from warpchain.inputs.validation import InputError, checked_whole, printable
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
    if like is None:
        chosen_seed = None if seed is None else checked_whole(_parsed("seed", seed), "seed", 0, LARGEST_SEED)
        setup = _setup(config, preset, given, chosen_seed, record_loads)
    else:
        for option, value in (("--config", config), ("--preset", preset), ("--seed", seed)):
            if value is not None:
                raise InputError(f"{option}: given together with --like, and a saved walk has its own; leave one out")
        setup, chosen_seed = setup_like(like, given, record_loads)
    interval = _frame_interval(output, animation, frame_interval, record_loads)
    if output is not None:
        try_walk_folder(output, animation)

    with status_line() as show:
        result = run_walk(
            setup,
            seed=chosen_seed,
            frame_interval=interval,
            record_loads=record_loads,
            on_progress=lambda progress: show(progress_text(progress)),
        )
    if as_json:
        print(json.dumps(result.to_dict(), indent=2, allow_nan=False))
    else:
        print_walk(result)
    if output is not None:
        for path in write_files(result, output, animation):
            if not as_json:
                print(printable(str(path)))
    if not result.status.ok:
        print(f"{result.status.label}: {result.status.sentence}", file=sys.stderr)
        raise typer.Exit(FAILED)


add_commands(app)
app.command()(animate)
app.command()(parameters)
app.command()(schema)
app.command()(bench)


def _given_values(named: Mapping[str, str], assignments: Sequence[str]) -> Sections:
    """Values of the command line by section; named options and `NAME=VALUE` are on a par.

    Raises:
        InputError: an assignment is not of that form, its name is unknown, or a name is given twice.
    """
    from warpchain.inputs.sections import SECTION_OF, by_section, dotted_name
    from warpchain.inputs.validation import InputError, shown

    pairs = list(named.items())
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
        values[name] = _parsed(path, text)
    return by_section(values)


def _parsed(path: str, text: str) -> Any:
    """The value of a text, read as in a YAML file.

    Raises:
        InputError: the text is not YAML.
    """
    from warpchain.inputs.yaml_files import parse_yaml

    return parse_yaml(text, path)


def _setup(config: Path | None, preset: str | None, given: Sections, seed: int | None, records_loads: bool) -> "Setup":
    """The setup of a walk: the file's values, the command line's over them, and the sample of the seed.

    Raises:
        InputError: something is refused; one line with the field's path and the remedy.
    """
    from warpchain.inputs.distributions import random_generator, sampled
    from warpchain.inputs.parameters import warn_of_units
    from warpchain.inputs.setup import read_setup, resolve
    from warpchain.inputs.validation import InputError

    file_preset, sections = read_setup(config) if config is not None else ("paper", {section: {} for section in given})
    preset = file_preset if preset is None else preset
    if preset is None:
        raise InputError("preset: missing; name the parameters to start from, such as preset: paper")
    for section, values in given.items():
        if isinstance(sections[section], Mapping):  # `resolve` refuses anything else
            sections[section] = {**sections[section], **values}
    setup = resolve(
        preset,
        scene=sections["scene"],
        options=sections["options"],
        parameters=sections["parameters"],
        records_loads=records_loads,
    )
    warn_of_units((f"parameters.{name}", name, value) for name, value in sections["parameters"].items())
    kept = {*sections["scene"], *sections["parameters"]}
    return setup if seed is None else sampled(setup, random_generator(seed), kept=kept)


def _frame_interval(output: Path | None, animation: str | None, text: str | None, records_loads: bool) -> float | None:
    """Time between two frames [s]; None without a folder to write them to.

    Raises:
        InputError: an option needs a folder, the time is not a positive number, or MP4 cannot be written.
    """
    from importlib.util import find_spec

    from warpchain.inputs.validation import InputError, checked_positive

    needing = (("--animate", animation), ("--frame-interval", text), ("--record-loads", records_loads or None))
    for option, value in needing:
        if value is not None and output is None:
            raise InputError(f"{option}: there is no folder to write to; add -o DIR")
    if animation == "mp4" and find_spec("imageio_ffmpeg") is None:
        raise InputError("--animate mp4: imageio-ffmpeg is not installed; pip install 'warpchain[video]'")
    usual = 1e-4 if records_loads else 2e-3
    interval = usual if text is None else _parsed("--frame-interval", text)
    return float(checked_positive(interval, "--frame-interval", "time in s")) if output is not None else None
