"""The command `warpchain`.

Exit status: 0 when the walk ended as it should, 1 when it failed, a file is damaged or a disk is full or broken, 2 when
the input is refused or a path cannot be read or written, 130 when interrupted. Values are checked like keyword
arguments and YAML files, so they are refused in the same words. Heavy libraries are imported by the functions that need
them, so that help is quick.
"""

import contextlib
import io
import sys
import warnings
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, Final, NoReturn

import typer

from warpchain.cli.input_commands import bench, parameters, schema
from warpchain.cli.interrupts import INTERRUPTED, interrupts_heard
from warpchain.cli.live_command import live
from warpchain.cli.sweep_commands import compile_kernels, info, merge, plot, report, sweep
from warpchain.cli.walk_commands import FAILED, animate, walk
from warpchain.files import DISK_FAILURES, described
from warpchain.version import VERSION

REFUSED: Final = 2
"""Exit status beside `FAILED` and `INTERRUPTED`."""

app = typer.Typer(pretty_exceptions_enable=False, rich_markup_mode=None)  # boxes of rich would double the time of help


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; `arguments` follow the name of the command, by default those of this process."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a terminal without Δ gets a question mark
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
    from warpchain.inputs.validation import DamagedFileError, InputError, one_line
    from warpchain.run.workers import LostWorkersError

    problems, status = [str(error)], REFUSED
    if isinstance(error, typer.TyperException):
        context = getattr(error, "ctx", None)
        command = context.command_path if context is not None else "warpchain"
        problems, status = [f"{error.format_message().rstrip('.')}; see {command} --help"], error.exit_code
    elif isinstance(error, OSError):
        problems, status = [described(error)], FAILED if error.errno in DISK_FAILURES else REFUSED
    elif isinstance(error, MemoryError):
        problems, status = (
            [f"out of memory ({error or 'no size is known'}); compute less at once, or free memory"],
            FAILED,
        )
    elif isinstance(error, InputError):
        problems, status = [*error.args], FAILED if isinstance(error, DamagedFileError) else REFUSED
    elif isinstance(error, LostWorkersError):
        status = FAILED
    else:
        return
    for problem in problems:
        print(one_line(problem, "error: "), file=sys.stderr)
    sys.exit(status)


@contextlib.contextmanager
def _warnings_on_one_line() -> Iterator[None]:
    """Print warnings about input as one line, without the line of code that gave them."""
    with warnings.catch_warnings():
        usual = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
            from warpchain.inputs.validation import InputWarning, one_line

            if issubclass(category, InputWarning):
                print(one_line(str(message), "warning: "), file=sys.stderr)
            else:
                usual(message, category, *where, **more)

        warnings.showwarning = show
        yield


@app.callback(invoke_without_command=True)
def _warpchain(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Walking roller chains: a loop of chain, spun up on a sprocket, is dropped and walks away."""
    if version:
        print("warpchain", VERSION)
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())


for _command in (walk, sweep, info, plot, report, merge, animate, live, parameters, schema, bench):
    app.command()(_command)
app.command("compile")(compile_kernels)
