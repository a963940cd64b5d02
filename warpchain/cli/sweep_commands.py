"""The commands of the command line that are about sweeps: sweep, info, plot, report, merge."""

import contextlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

if TYPE_CHECKING:
    from warpchain.run.sweep_run import Executor, SweepProgress
    from warpchain.store.sweep_result import SweepResult

FAILED: Final = 1

SweepFile = Annotated[
    Path, typer.Argument(metavar="FILE.yaml", help="The sweep, as those in sweeps/.", show_default=False)
]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a sweep.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, in SI units, instead of a table.")]


def sweep(
    source: SweepFile,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="DIR", help="Folder of the results; a killed sweep goes on in it."),
    ],
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
    as_json: AsJson = False,
) -> None:
    """Run a sweep, or what is left of it: many walks over a grid, with random samples in each cell."""
    from warpchain.cli.terminal import status_line
    from warpchain.run.sweep_run import sweep as run

    if gpus is not None:
        device = _device_of_gpus(scheduler, workers, device)
    with status_line() as show, _gpus(gpus) if gpus is not None else _dask(scheduler) as cluster:
        executor, threads = cluster
        result = run(
            source,
            output,
            device=device,
            executor=executor,
            workers=workers or threads,
            fresh=fresh,
            on_progress=lambda progress: show(_progress_text(progress)),
        )
    _print_result(result, as_json)
    _note_failures(result)


def info(directory: Folder, as_json: AsJson = False) -> None:
    """Show how far a sweep is and what it has found so far."""
    from warpchain.store.sweep_result import load

    _print_result(load(directory), as_json)


def plot(
    directory: Folder,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Folder of the figures. Default: DIR."),
    ] = None,
) -> None:
    """Draw every figure that the sweep has something for: Figures 6 and 5, maps, tolerance, sensitivity, statuses."""
    from warpchain.cli.terminal import PICTURE_DPI, try_folder
    from warpchain.reports.sweep_figures import figures
    from warpchain.store.shards import check_not_own
    from warpchain.store.sweep_result import load
    from warpchain.walks.walk_result import replacing

    result = load(directory)
    folder = output or directory
    check_not_own(directory, folder.resolve())
    try_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for picture in figures(result):
        path = folder / f"{picture.name}.png"
        with replacing(path) as part:
            picture.figure.savefig(part, dpi=PICTURE_DPI)
        print(path)


def report(
    directory: Folder,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE.html", help="The page. Default: DIR/report.html.")
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
    from warpchain.inputs.validation import InputError
    from warpchain.reports.sweep_page import write_report

    if device is not None and walk is None:
        raise InputError("--device: no walk is run for this page; add --walk INDEX, or leave it out")
    path = output or directory / "report.html"
    write_report(directory, path, animation_of=walk, device=device)
    print(path)


def merge(
    directory: Folder,
    output: Annotated[Path, typer.Argument(metavar="FILE.h5", help="The file to write.", show_default=False)],
) -> None:
    """Put all results into one HDF5 file with named axes and units, which xarray opens."""
    from warpchain.store.merged_file import merge as merge_shards

    merge_shards(directory, output)
    print(output)


def add_commands(app: typer.Typer) -> None:
    """Register the commands."""
    for command in (sweep, info, plot, report, merge):
        app.command()(command)


def _device_of_gpus(scheduler: str | None, workers: int | None, device: str | None) -> str:
    """The device of a sweep on several GPUs.

    Raises:
        InputError: another option contradicts --gpus.
    """
    from warpchain.inputs.validation import InputError

    for name, value in (("--scheduler", scheduler), ("--workers", workers)):
        if value is not None:
            raise InputError(f"{name}: given together with --gpus; leave one out")
    if device not in (None, "cuda"):
        raise InputError(f"--device: {device} is given together with --gpus; give cuda, or leave one out")
    return "cuda"


@contextlib.contextmanager
def _gpus(count: int) -> "Iterator[tuple[Executor | None, int | None]]":
    """An executor with a process for each GPU, and their number."""
    from warpchain.run.gpu_workers import gpu_workers

    with gpu_workers(count) as executor:
        yield executor, count


@contextlib.contextmanager
def _dask(address: str | None) -> "Iterator[tuple[Executor | None, int | None]]":
    """An executor on a Dask cluster and its number of threads; (None, None) without an address.

    Raises:
        InputError: Dask is not installed, or the scheduler does not answer.
    """
    if address is None:
        yield None, None
        return
    from warpchain.inputs.validation import InputError, shown

    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler: Dask is not installed; pip install 'warpchain[dask]'") from None
    try:
        client: Any = Client(address, timeout=10)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InputError(f"--scheduler: {shown(address)}: {error}; give the address of a running scheduler") from None
    with client:
        yield client.get_executor(), sum(client.nthreads().values())


def _progress_text(progress: "SweepProgress") -> str:
    """How far a sweep is, in columns."""
    if progress.compiling:
        return "compiling kernels; later runs find them ready"
    left = progress.time_left
    counts = ", ".join(f"{count} {label}" for label, count in sorted(progress.statuses.items()))
    remaining = "" if left is None else f"   {_duration(left)} left"
    return f"{progress.done:,} of {progress.walks:,} walks   {progress.rate:.2f} a second{remaining}   {counts}"


def _duration(seconds: float) -> str:
    """Hours, minutes and seconds, as far as needed."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s" if minutes else f"{rest} s"


def _print_result(result: "SweepResult", as_json: bool) -> None:
    """Print the statuses and the mean Δx of each cell."""
    if as_json:
        print(json.dumps(_as_json(result), indent=2, allow_nan=False))
        return
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    counts = ", ".join(f"{count:,} {label}" for label, count in result.summary().items() if count or label == "at_rest")
    console.print(f"{result.name}: {result.walk_count:,} walks, {counts}")
    for name, block in result.blocks.items():
        statistics = block.statistics()
        table = Table(box=None, pad_edge=False, title=name if len(result.blocks) > 1 else None, title_justify="left")
        for axis in statistics.axes:
            table.add_column(axis, justify="right")
        for heading in ("mean Δx / m", "s.d. / m", "at rest", "failed", "missing"):
            table.add_column(heading, justify="right")
        for cell in _cells(statistics.mean.shape):
            place = [str(values[index]) for values, index in zip(statistics.axes.values(), cell, strict=True)]
            numbers = [f"{statistics.mean[cell]:.4f}", f"{statistics.sd[cell]:.4f}"]
            walks = [str(array[cell]) for array in (statistics.count, statistics.failed, statistics.missing)]
            table.add_row(*place, *numbers, *walks)
        console.print(table)


def _cells(shape: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """All places of an array of this shape."""
    import numpy as np

    return iter(np.ndindex(*shape))


def _as_json(result: "SweepResult") -> dict[str, Any]:
    """Statuses and cell statistics as JSON has them."""

    def plain(array: Any) -> Any:
        values = array.tolist() if hasattr(array, "tolist") else array
        if isinstance(values, list):
            return [plain(value) for value in values]
        return None if isinstance(values, float) and values != values else values

    blocks = {}
    for name, block in result.blocks.items():
        statistics = block.statistics()
        numbers = {key: plain(getattr(statistics, key)) for key in ("mean", "sd", "count", "failed", "missing")}
        blocks[name] = {"axes": {axis: plain(values) for axis, values in statistics.axes.items()}, "dx": numbers}
    return {"name": result.name, "walks": result.walk_count, "statuses": result.summary(), "blocks": blocks}


def _note_failures(result: "SweepResult") -> None:
    """Say which walks failed and leave with exit status 1 if any did."""
    from warpchain.status import Status

    failed = {label: n for label, n in result.summary().items() if n and label not in ("at_rest", "missing")}
    for label, count in failed.items():
        print(f"{count} {label}: {Status[label.upper()].sentence}", file=sys.stderr)
    if failed:
        raise typer.Exit(FAILED)
