"""The commands of the command line that are about sweeps: sweep, info, plot, report, merge."""

import contextlib
import logging
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from warpchain.cli import completions
from warpchain.cli.output_paths import output_path
from warpchain.cli.walk_commands import plot_walk

if TYPE_CHECKING:
    from warpchain.run.sweep_run import DaskClient, Executor
    from warpchain.store.sweep_result import SweepResult

FAILED: Final = 1
"""Exit status of a command whose walks failed."""

LOG_EVERY: Final = 30.0
"""Time [s] between two lines of progress where there is no terminal."""

SWEEP_FILE: Final = typer.Argument(
    metavar="FILE.yaml",
    help="The sweep, or the bare name of one that comes with warpchain, such as figure6.",
    autocompletion=completions.sweep_files,
    show_default=False,
)
SweepFile = Annotated[Path, SWEEP_FILE]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep, or a merged file.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, in SI units, instead of a table.")]


def sweep(
    context: typer.Context,
    source: Annotated[Path | None, SWEEP_FILE] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            parser=output_path,
            help="Folder of the results; a killed sweep goes on in it.",
        ),
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="cpu, cuda (the first GPU) or cuda:N, instead of what the sweep says."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Shards in work at once. Default: processors, or Dask's threads."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="tcp://HOST:PORT", help="Run on the workers of this Dask scheduler; they must see DIR."),
    ] = None,
    gpus: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Run on the first N GPUs of this machine, a process for each."),
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Discard what another sweep left in the folder.")] = False,
    new: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.yaml",
            parser=output_path,
            help="Write a small sweep file that explains its keys; run nothing.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run a sweep, or what is left of it: many walks over a grid, with random samples in each cell."""
    from warpchain.inputs.validation import InputError

    if new is not None:
        _write_new(new, alone=not any(value for name, value in context.params.items() if name != "new"))
        return
    if source is None:
        raise InputError("FILE.yaml: missing; give a sweep file, or --new FILE.yaml to have one written")
    if output is None:
        raise InputError("--output: missing; give a folder for the results with -o DIR")
    from warpchain.cli.terminal import print_sweep, status_line, sweep_progress_text
    from warpchain.run.sweep_run import sweep as run

    if gpus is not None:
        for name, value in (("--scheduler", scheduler), ("--workers", workers)):
            if value is not None:
                raise InputError(f"{name}: given together with --gpus; leave one out")
        if device not in (None, "cuda"):
            raise InputError(f"--device: {device} is given together with --gpus; give cuda, or leave one out")
        device = "cuda"
    with status_line(LOG_EVERY) as show, _executor(gpus, scheduler) as (executor, count):
        result = run(
            source,
            output,
            device=device,
            executor=executor,
            workers=workers or count,
            fresh=fresh,
            on_progress=lambda progress: show(sweep_progress_text(progress)),
        )
    print_sweep(result, as_json)
    _note_failures(result)


def _write_new(path: Path, *, alone: bool) -> None:
    """Write a sweep file to start from.

    Raises:
        InputError: other arguments are given, or there is such a file already.
        OSError: it cannot be written.
    """
    from warpchain.inputs.validation import InputError, printable
    from warpchain.sweeps.shipped import write_new_sweep

    if not alone:
        raise InputError("--new: given together with other arguments; leave them out")
    write_new_sweep(path)
    print(printable(str(path)))


def info(
    directory: Folder,
    as_json: AsJson = False,
) -> None:
    """Show how far a sweep is and what it has found so far; of a merged file, after its checksum is compared."""
    from warpchain.cli.terminal import print_sweep
    from warpchain.store.folder import running_rate
    from warpchain.store.sweep_result import load

    print_sweep(load(directory), as_json, None if os.path.isfile(directory) else running_rate(directory))


def plot(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="PATH", help="Folder of a sweep, a merged file, or the file of a saved walk.", show_default=False
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="DIR", parser=output_path, help="Folder of the figures. Default: that of PATH."
        ),
    ] = None,
    quantity: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Column of a sweep to draw: dx, walk_time, bounces, hold_time ... Default: dx."
        ),
    ] = None,
    kind: Annotated[
        Literal["figure5", "film_strip", "loop", "energy", "tilt"] | None,
        typer.Option(help="Only figure of a walk to draw. Default: all that it has something for."),
    ] = None,
) -> None:
    """Draw every figure that a sweep or a saved walk has something for.

    Of a sweep: Figures 6 and 5, grids, tolerance, sensitivity, statuses. Of a walk: figure5.png, film_strip.png,
    loop.png, energy.png and, if the plane tilts, tilt.png; a line says what is left out and why.
    """
    from warpchain.hdf5_files import kind_of_hdf5
    from warpchain.inputs.validation import InputError, printable
    from warpchain.store.sweep_result import KIND

    is_file = os.path.isfile(path)
    if (
        is_file and kind_of_hdf5(path, "give the folder of a sweep, a merged file, or the file of a saved walk") != KIND
    ) or (path.suffix == ".h5" and not os.path.exists(path)):
        if quantity is not None:
            raise InputError("--quantity: a saved walk has no columns; leave it out, or give the folder of a sweep")
        if not plot_walk(path, output, kind):
            raise typer.Exit(FAILED)
        return
    if kind is not None:
        raise InputError("--kind: a sweep has none; leave it out, or give the file of a saved walk")
    from warpchain.cli.terminal import try_folder
    from warpchain.files import make_folder
    from warpchain.reports.sweep_figures import figures
    from warpchain.store.sweep_result import load

    result = load(path)
    folder = output or (path.parent if is_file else path)
    try_folder(folder)
    make_folder(folder)
    drawn = False
    for picture in figures(result, quantity or "dx"):
        print(printable(str(picture.save(folder))))
        drawn = True
    if not drawn:
        raise InputError(
            f"--quantity: {quantity}: no walk at rest has one, or no axis has several values; give another"
        )


def report(
    directory: Folder,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE.html",
            parser=output_path,
            help="The page, which replaces an older one only. Default: DIR/report.html.",
        ),
    ] = None,
    walk: Annotated[
        int | None,
        typer.Option(
            metavar="INDEX",
            min=0,
            help="Show this walk in motion: its frames if the sweep kept them, or else run again.",
        ),
    ] = None,
    device: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Where the walk is run again: cpu, cuda (the first GPU) or cuda:N, instead of what the sweep says.",
        ),
    ] = None,
) -> None:
    """Write one self-contained HTML page: figures, table, parameters, provenance, failed walks, a walk in motion."""
    from warpchain.inputs.validation import InputError, printable
    from warpchain.reports.sweep_page import write_report

    if device is not None and walk is None:
        raise InputError("--device: no walk is run for this page; add --walk INDEX, or leave it out")
    path = output or (directory.parent if os.path.isfile(directory) else directory) / "report.html"
    write_report(directory, path, animation_of=walk, device=device)
    print(printable(str(path)))


def merge(
    directories: Annotated[
        list[Path],
        typer.Argument(metavar="DIR...", help="Folder of a sweep, or several; merged files, too.", show_default=False),
    ],
    output: Annotated[
        Path, typer.Argument(metavar="FILE.h5", parser=output_path, help="The file to write.", show_default=False)
    ],
) -> None:
    """Put all results into one HDF5 file with named axes and units, which xarray opens.

    Folders of the same sweep with different seeds are put together: their samples stand one behind the other.
    """
    from warpchain.inputs.validation import printable
    from warpchain.store.merged_file import merge as merge_shards

    merge_shards(directories, output)
    print(printable(str(output)))


def add_commands(app: typer.Typer) -> None:
    """Register the commands."""
    for command in (sweep, info, plot, report, merge):
        app.command()(command)


@contextlib.contextmanager
def _executor(gpus: int | None, scheduler: str | None) -> "Iterator[tuple[Executor | DaskClient | None, int | None]]":
    """Workers on GPUs, and their number, or the client of a Dask cluster; (None, None) if neither is asked for.

    Raises:
        InputError: there are not so many GPUs, Dask is not installed, or the scheduler does not answer.
    """
    from warpchain.engine.devices import gpu_count
    from warpchain.inputs.validation import InputError
    from warpchain.run.gpu_workers import gpu_workers, visible_gpus

    if gpus is not None:
        visible_gpus(gpus)
        if gpus > (there := gpu_count()):
            raise InputError(f"--gpus: {gpus} wanted, but this machine has {there}; give at most {there}")
        with gpu_workers(gpus) as executor:
            yield executor, gpus
    elif scheduler is not None:
        with _without_logs(), _dask_client(scheduler) as client:
            yield client, None
    else:
        yield None, None


@contextlib.contextmanager
def _without_logs() -> Iterator[None]:
    """Keep tracebacks that Dask logs off the terminal: what is wrong is said in one line."""
    logging.disable(logging.ERROR)
    try:
        yield
    finally:
        logging.disable(logging.NOTSET)


def _dask_client(address: str) -> Any:
    from warpchain.inputs.validation import InputError, shown

    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler: Dask is not installed; pip install 'warpchain[dask]'") from None
    # A client that does not connect has to be closed. Left alone, it closes itself when it is collected as garbage. If
    # that happens while this thread starts another client, the thread waits for ever.
    client = Client.__new__(Client)
    try:
        client.__init__(address, timeout=10)  # type: ignore[misc]
        return client
    except Exception as error:  # of any class, by protocol: tls and ucx without their settings give a TypeError
        client.close()  # type: ignore[no-untyped-call]
        problem = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"--scheduler: {shown(address)}: {problem}; give the address of a running scheduler") from None


def _note_failures(result: "SweepResult") -> None:
    """Say which walks failed and leave with exit status 1 if any did."""
    from warpchain.status import Status

    failed = {label: n for label, n in result.summary().items() if n and label not in ("at_rest", "missing")}
    for label, count in failed.items():
        print(f"{count} {label}: {Status[label.upper()].sentence}", file=sys.stderr)
    if failed:
        raise typer.Exit(FAILED)
