"""The commands of the command line that are about sweeps: sweep, info, plot, report, merge."""

import contextlib
import logging
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from warpchain.cli.walk_commands import FAILED
from warpchain.cli.words import JSON, argument, option, output, output_path

if TYPE_CHECKING:
    from warpchain.store.sweep_result import SweepResult

_FILE: Final = "The sweep, or the bare name of one that comes with warpchain, such as figure6."
_DEVICE: Final = "cpu, cuda (the first GPU) or cuda:N, instead of what the sweep says."
_SCHEDULER: Final = "Run on the workers of this Dask scheduler; they must see DIR."

AsJson = Annotated[bool, JSON]


def sweep(
    context: typer.Context,
    source: Annotated[Path | None, argument("FILE.yaml", _FILE)] = None,
    folder: Annotated[Path | None, output("DIR", "Folder of the results; a killed sweep goes on in it.")] = None,
    device: Annotated[str | None, option("NAME", _DEVICE)] = None,
    workers: Annotated[
        int | None, option("N", "Shards in work at once. Default: processors, or Dask's threads.", min=1)
    ] = None,
    scheduler: Annotated[str | None, option("tcp://HOST:PORT", _SCHEDULER)] = None,
    gpus: Annotated[
        int | None, option("N", "Run on the first N GPUs of this machine, a process for each.", min=1)
    ] = None,
    part: Annotated[
        str | None,
        option("K/N", "Run only the K-th of N parts; merge puts them together."),
    ] = None,
    seed: Annotated[int | None, option("S", "Seed instead of the file's.", min=0)] = None,
    samples: Annotated[int | None, option("N", "Samples of each cell instead of the file's.", min=1)] = None,
    estimate: Annotated[
        bool, typer.Option("--estimate", help="Try a few walks; say how long all take, and their size.")
    ] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Discard what another sweep left in the folder.")] = False,
    new: Annotated[
        Path | None,
        option("FILE.yaml", "Write a small sweep file that explains its keys; run nothing.", parser=output_path),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run a sweep, or what is left of it: many walks over a grid."""
    from warpchain.inputs.validation import InputError, printable
    from warpchain.sweeps.shipped import write_new_sweep

    if new is not None:
        if any(value for name, value in context.params.items() if name != "new"):
            raise InputError("--new: given together with other arguments; leave them out")
        write_new_sweep(new)
        print(printable(str(new)))
        return
    if source is None:
        raise InputError("FILE.yaml: missing; give a sweep file, or --new FILE.yaml to have one written")
    if estimate:
        if gpus is not None or scheduler is not None:
            raise InputError("--estimate: tries walks in this process; leave out --gpus and --scheduler")
        _print_estimate(source, device=device, workers=workers, part=part, seed=seed, samples=samples)
        return
    if folder is None:
        raise InputError("--output: missing; give a folder for the results with -o DIR")
    from warpchain.cli.terminal import print_sweep
    from warpchain.run.sweep_run import sweep as run

    if gpus is not None:
        for name, value in (("--scheduler", scheduler), ("--workers", workers)):
            if value is not None:
                raise InputError(f"{name}: given together with --gpus; leave one out")
        if device not in (None, "cuda"):
            raise InputError(f"--device: {device} is given together with --gpus; give cuda, or leave one out")
        device = "cuda"
    try:
        with _executor(gpus, scheduler) as executor:
            result = run(
                source,
                folder,
                device=device,
                executor=executor,
                workers=workers or gpus,
                fresh=fresh,
                part=part,
                seed=seed,
                samples=samples,
            )
    except KeyboardInterrupt:
        print(f"the same command{', without --fresh,' if fresh else ''} goes on with the sweep", file=sys.stderr)
        raise
    print_sweep(result, as_json)
    _note_failures(result)


def info(
    directory: Annotated[Path, argument("DIR", "Folder of a sweep, or a merged file.")], as_json: AsJson = False
) -> None:
    """Show how far a sweep is and what it has found so far.

    Of a merged file the checksum is compared first.
    """
    from warpchain.cli.terminal import print_sweep
    from warpchain.store.folder import running_rate
    from warpchain.store.sweep_result import load

    print_sweep(load(directory), as_json, None if os.path.isfile(directory) else running_rate(directory))


def plot(
    path: Annotated[Path, argument("PATH", "Folder of a sweep or of a saved walk, or the file of either.")],
    folder: Annotated[Path | None, output("DIR", "Folder of the figures. Default: that of PATH.")] = None,
    quantity: Annotated[
        str | None,
        option("NAME", "Column of a sweep to draw: dx, walk_time, bounces, hold_time ... Default: dx."),
    ] = None,
    kind: Annotated[
        Literal["film_strip", "height_and_speed", "loop", "energy", "tilt"] | None,
        typer.Option(help="Only figure of a walk to draw. Default: all that it has something for."),
    ] = None,
) -> None:
    """Draw all figures of a sweep or of a saved walk.

    Of a sweep: the distance as in the paper's Figure 6, maps, lines over any axes, sensitivity, statuses. Of a walk:
    film_strip.png, height_and_speed.png, loop.png, energy.png and, if the plane tilts, tilt.png; a line says what is
    left out and why.
    """
    from warpchain.cli.walk_files import draw_figures, saved
    from warpchain.files import make_folder
    from warpchain.inputs.validation import InputError, printable
    from warpchain.pictures.walk_shape import kinds_of
    from warpchain.reports.sweep_figures import figures
    from warpchain.walks.walk_result import WalkResult

    found = saved(path, "give the folder of a sweep, a merged file, or the file of a saved walk")
    is_walk = isinstance(found, WalkResult)
    if is_walk and quantity is not None:
        raise InputError("--quantity: a saved walk has no columns; leave it out, or give the folder of a sweep")
    if kind is not None and not is_walk:
        raise InputError("--kind: a sweep has none; leave it out, or give the file of a saved walk")
    folder = folder or (path.parent if os.path.isfile(path) else path)
    make_folder(folder)
    drawn = (
        draw_figures(found, folder, kinds_of(found) if kind is None else (kind,))
        if isinstance(found, WalkResult)
        else (picture.save(folder) for picture in figures(found, quantity or "dx"))
    )
    count = 0
    for drawing in drawn:
        print(printable(str(drawing)))
        count += 1
    if not count and is_walk:
        raise typer.Exit(FAILED)
    if not count:
        name = path if quantity is None else f"--quantity: {quantity}"
        raise InputError(
            f"{name}: no walk at rest has a value, or no axis has several values; give another --quantity, as walk_time"
        )


def report(
    directory: Annotated[Path, argument("DIR", "Folder of a sweep.")],
    path: Annotated[
        Path | None, output("FILE.html", "The page, which replaces an older one only. Default: DIR/report.html.")
    ] = None,
    walk: Annotated[
        int | None,
        option("INDEX", "Show this walk in motion: its frames if the sweep kept them, or else run again.", min=0),
    ] = None,
    device: Annotated[str | None, option("NAME", f"Where the walk is run again: {_DEVICE}")] = None,
) -> None:
    """Write one HTML page with all of a sweep, and a walk in motion.

    It has figures, tables, parameters, provenance and failed walks, and loads nothing else.
    """
    from warpchain.inputs.validation import InputError, printable
    from warpchain.reports.sweep_page import write_report

    if device is not None and walk is None:
        raise InputError("--device: no walk is run for this page; add --walk INDEX, or leave it out")
    path = path or (directory.parent if os.path.isfile(directory) else directory) / "report.html"
    write_report(directory, path, animation_of=walk, device=device)
    print(printable(str(path)))


def merge(
    directories: Annotated[list[Path], argument("DIR...", "Folder of a sweep, or several; merged files, too.")],
    path: Annotated[Path, argument("FILE.h5", "The file to write.", parser=output_path)],
) -> None:
    """Put the results of folders into one file, which xarray opens.

    Folders of the same sweep with different seeds are put together: their samples stand one behind the other.
    """
    from warpchain.inputs.validation import printable
    from warpchain.store.merged_file import merge as merge_shards

    merge_shards(directories, path)
    print(printable(str(path)))


def _print_estimate(source: Path, **given: Any) -> None:
    """Say how long a sweep would take on this machine, and how much of the disk."""
    from warpchain.run.estimate import estimate_sweep
    from warpchain.run.progress_bar import duration_text

    found = estimate_sweep(source, **given)
    print(
        f"{found.walks:,} walks: about {duration_text(found.seconds)} with {found.workers} at once on this machine, "
        f"{found.bytes / 1e6:,.1f} MB on disk ({found.pilots} walks tried)"
    )


@contextlib.contextmanager
def _executor(gpus: int | None, scheduler: str | None) -> Iterator[Any]:
    """Workers on GPUs, or the client of a Dask cluster; None if neither is asked for."""
    from warpchain.engine.devices import gpu_count
    from warpchain.inputs.validation import InputError
    from warpchain.run.gpu_workers import gpu_workers, visible_gpus

    if gpus is not None:
        visible_gpus(gpus)
        if gpus > (there := gpu_count()):
            raise InputError(f"--gpus: {gpus} wanted, but this machine has {there}; give at most {there}")
        with gpu_workers(gpus) as executor:
            yield executor
    elif scheduler is not None:
        logging.disable(logging.ERROR)  # Dask logs tracebacks of what is said in one line
        try:
            with _dask_client(scheduler) as client:
                yield client
        finally:
            logging.disable(logging.NOTSET)
    else:
        yield None


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

    ended = {status.label: status for status in Status if not status.ok}
    failed = {label: n for label, n in result.summary().items() if n and label in ended}
    for label, count in failed.items():
        print(f"{count} {label}: {ended[label].sentence}", file=sys.stderr)
    if failed:
        raise typer.Exit(FAILED)
