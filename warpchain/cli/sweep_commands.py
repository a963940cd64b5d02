"""The commands for sweeps: sweep, compile, info, plot, report and merge."""

import contextlib
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import typer

from warpchain.cli.walk_commands import FAILED, exit_if_any_failed
from warpchain.cli.words import JSON, argument, option, output, output_path
from warpchain.inputs.figure_kinds import KINDS, FigureWord

_FILE: Final = "Sweep file, or the bare name of a sweep that comes with warpchain, e.g. figure6."
_FILES: Final = "Sweep files, or bare names of sweeps that come with warpchain. Default: all of the latter."
_KIND: Final = (
    f"The only figure of a walk to draw. {'; '.join(f'{word}: {kind.described}' for word, kind in KINDS.items())}. "
    "Default: all that the walk has data for."
)
_DEVICE: Final = "cpu, cuda (the first GPU) or cuda:N, instead of the device in the sweep file."

_PLAN: Final = (
    "Run nothing: check the sweep, and show its walks, files, disk and memory; with -o DIR of a sweep that has begun, "
    "what is left of it."
)
_PILOT: Final = "Plan with times, on a CPU: run a walk of each corner of the grid first."
_UNTIL: Final = (
    "Add samples to each cell until the standard error of its mean Δx is so small, as 1% or 2mm; NAME=ERROR, which may "
    "be repeated, for other columns."
)

AsJson = Annotated[bool, JSON]


def sweep(
    context: typer.Context,
    source: Annotated[Path | None, argument("FILE.yaml", _FILE)] = None,
    folder: Annotated[
        Path | None, output("DIR", "Results folder. If it already holds part of this sweep, the sweep resumes.")
    ] = None,
    device: Annotated[str | None, option("NAME", _DEVICE)] = None,
    workers: Annotated[int | None, option("N", "Number of shards computed at once. Default: CPU cores.", min=1)] = None,
    gpus: Annotated[
        int | None, option("N", "Run on the first N GPUs of this machine, with one process each.", min=1)
    ] = None,
    part: Annotated[str | None, option("K/N", "Run only the K-th of N parts; `merge` joins them.")] = None,
    seed: Annotated[int | None, option("S", "Seed instead of the file's.", min=0)] = None,
    samples: Annotated[int | None, option("N", "Samples of each cell instead of the file's.", min=1)] = None,
    until: Annotated[list[str] | None, option("ERROR", _UNTIL)] = None,
    at_most: Annotated[int | None, option("N", "Most samples of each cell with --until. Default: 1024.", min=1)] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Delete the results of another sweep in the folder.")] = False,
    new: Annotated[
        Path | None,
        option(
            "FILE.yaml", "Write a small sweep file whose comments explain its keys; run nothing.", parser=output_path
        ),
    ] = None,
    plan: Annotated[bool, typer.Option("--plan", help=_PLAN)] = False,
    pilot: Annotated[bool, typer.Option("--pilot", help=_PILOT)] = False,
    as_json: AsJson = False,
) -> None:
    """Run or resume a sweep: many walks over a grid of values."""
    from warpchain.inputs.validation import InputError, printable
    from warpchain.sweeps.sweep_file import write_new_sweep

    if new is not None:
        others = [value for name, value in context.params.items() if name != "new" and value not in ((), [])]
        if any(value is not None and value is not False for value in others):
            raise InputError("--new: not possible with other arguments; remove them")
        write_new_sweep(new)
        print(printable(str(new)))
        return
    if source is None:
        raise InputError("FILE.yaml: missing; pass a sweep file, or write one with --new FILE.yaml")
    replaced: dict[str, Any] = {"seed": seed, "samples": samples, "until": _errors(until or []), "at_most": at_most}
    if plan or pilot:
        from warpchain.cli.output import print_plan
        from warpchain.run.sweep_plan import plan_sweep

        if fresh:
            raise InputError("--fresh: a plan deletes nothing; remove it, or use another folder")
        device = "cuda" if gpus else device
        how: dict[str, Any] = {"device": device, "workers": workers, "gpus": gpus, "part": part, "pilot": pilot}
        print_plan(*plan_sweep(source, folder, **how, **replaced), as_json)
        return
    if folder is None:
        raise InputError("--output: missing; set a folder for the results with -o DIR")
    if device is not None and device.startswith("cuda") and gpus is None:
        from warpchain.engine.devices import start_early

        start_early(device)
    from warpchain.cli.output import print_sweep
    from warpchain.run.sweep_run import sweep as run
    from warpchain.run.workers import gpu_workers

    if gpus is not None:
        from warpchain.engine.devices import gpu_count

        if workers is not None:
            raise InputError("--workers: not possible with --gpus; remove one")
        if device not in (None, "cuda"):
            raise InputError(f"--device: {device} is not possible with --gpus; use cuda, or remove one")
        device = "cuda"
        if gpus > (there := gpu_count()):
            remedy = f"use at most {there}" if there else "remove it to run on the CPU"
            raise InputError(f"--gpus: expected at most {there}, the GPUs of this machine, got {gpus}; {remedy}")
    try:
        with contextlib.nullcontext() if gpus is None else gpu_workers(gpus) as executor:
            result = run(
                source,
                folder,
                device=device,
                executor=executor,
                workers=workers or gpus,
                fresh=fresh,
                part=part,
                **replaced,
            )
    except KeyboardInterrupt:
        print(f"rerun the same command{', without --fresh,' if fresh else ''} to resume the sweep", file=sys.stderr)
        raise
    print_sweep(result, folder, as_json)
    exit_if_any_failed(result)


def _errors(given: Sequence[str]) -> dict[str, str] | None:
    """Quantity → error of `--until`, of Δx without a name; None if there is none."""
    from warpchain.inputs.validation import InputError

    errors: dict[str, str] = {}
    for text in given:
        name, equals, error = text.rpartition("=")
        name = name.strip() if equals else "dx"
        if name in errors:
            raise InputError(f"--until: {name} is given twice; remove one")
        errors[name] = error
    return errors or None


def compile_kernels(
    sources: Annotated[list[Path] | None, argument("[FILE.yaml]...", _FILES)] = None,
    device: Annotated[str | None, option("NAME", _DEVICE)] = None,
) -> None:
    """Compile the kernels of sweeps into Warp's cache.

    The sweeps that come with warpchain have the kernels of walks with default settings. WARP_CACHE_PATH names the
    folder of the cache. A kernel serves only the versions of warpchain, Warp and Python that compiled it, and
    processors or GPUs of the same kind.
    """
    from warpchain.run.progress_bar import COMPILING, changing_line
    from warpchain.run.sweep_run import compile_sweep
    from warpchain.sweeps.sweep_file import shipped_sweeps

    for source in sources or map(Path, shipped_sweeps()):
        with changing_line() as show:
            planned = compile_sweep(source, device, partial(show, f"{source}: {COMPILING}", True))
        print(f"{planned.name}: kernels compiled")


def info(
    directories: Annotated[list[Path], argument("DIR...", "Folder of a sweep, or of each part, or merged files.")],
    as_json: AsJson = False,
) -> None:
    """Show the progress and the results of a sweep.

    For a merged file, the checksum is checked first.
    """
    from warpchain.cli.output import print_sweep
    from warpchain.results.sweep_result import load

    print_sweep(load(directories), directories[0] if len(directories) == 1 else None, as_json)


def plot(
    paths: Annotated[
        list[Path],
        argument("PATH...", "Folder of a sweep, of each part, or of a saved walk; or their files."),
    ],
    folder: Annotated[
        Path | None, output("DIR", "Folder for the figures. Default: the folder of the first PATH.")
    ] = None,
    quantity: Annotated[
        str | None, option("NAME", "Column of a sweep to draw: dx, walk_time, bounces, hold_time ... Default: dx.")
    ] = None,
    kind: Annotated[FigureWord | None, typer.Option(help=_KIND)] = None,
    width: Annotated[
        str | None,
        option("WIDTH", "Width on paper in mm, such as 85mm: texts have 6 pt at least. Default: as suits."),
    ] = None,
    format: Annotated[
        Literal["png", "pdf", "svg"], typer.Option(help="Format of the files. Default: png.", show_default=False)
    ] = "png",
) -> None:
    """Draw all figures of a sweep or of a saved walk.

    For a sweep these are the distance as in the paper's Figure 6, maps, lines over any axes, and sensitivity. For a
    walk there is a file for each --kind that it has. A line names each figure that cannot be drawn, and why.
    """
    from warpchain.cli.output import draw_figures, saved
    from warpchain.files import make_folder
    from warpchain.inputs.validation import InputError, printable
    from warpchain.inputs.yaml_files import parse_yaml
    from warpchain.pictures.style import on_paper
    from warpchain.pictures.walk_figures import kinds_of
    from warpchain.reports.sweep_figures import figures
    from warpchain.results.sweep_result import load
    from warpchain.results.walk_result import WalkResult

    path, *others = paths
    wanted = "use the folder of a sweep, a merged file, or the file of a saved walk"
    found = load(paths) if others else saved(path, wanted)
    folder = folder or (path.parent if path.is_file() else path)
    is_walk = isinstance(found, WalkResult)
    if is_walk and quantity is not None:
        raise InputError("--quantity: not possible for a saved walk; remove it, or use the folder of a sweep")
    if not is_walk and kind is not None:
        raise InputError("--kind: not possible for a sweep; remove it, or use the file of a saved walk")
    count = 0
    with on_paper(None if width is None else parse_yaml(width.removesuffix("mm"), "width")) as inches:
        if isinstance(found, WalkResult):
            kinds = kinds_of(found) if kind is None else (kind,)
            drawn = draw_figures(found, folder, kinds, format, inches)
        else:
            pictures = list(figures(found, quantity or "dx", inches))
            if not pictures:
                name = path if quantity is None else f"--quantity: {quantity}"
                problem = "no walk at rest has a value, or no axis has several"
                raise InputError(f"{name}: {problem}; use another --quantity")
            drawn = (picture.save(folder, format) for picture in pictures)
        make_folder(folder)
        for count, drawing in enumerate(drawn, 1):  # noqa: B007
            print(printable(str(drawing)))
    if not count:
        raise typer.Exit(FAILED)


def report(
    directory: Annotated[Path, argument("DIR", "Folder of a sweep.")],
    path: Annotated[
        Path | None,
        output("FILE.html", "HTML file to write; it may replace an older report only. Default: DIR/report.html."),
    ] = None,
    walk: Annotated[
        int | None,
        option(
            "INDEX", "Animate this walk, from its recorded frames if there are any; otherwise it is run again.", min=0
        ),
    ] = None,
    device: Annotated[str | None, option("NAME", f"Device on which the walk is run again: {_DEVICE}")] = None,
) -> None:
    """Write a sweep as one HTML page.

    The page has figures, tables, parameters, provenance, failed walks and, with --walk, an animated walk. It needs no
    other files.
    """
    from warpchain.inputs.validation import InputError, printable
    from warpchain.reports.sweep_page import write_report

    if device is not None and walk is None:
        raise InputError("--device: this page runs no walk; add --walk INDEX, or remove it")
    path = path or (directory.parent if directory.is_file() else directory) / "report.html"
    write_report(directory, path, animation_of=walk, device=device)
    print(printable(str(path)))


def merge(
    directories: Annotated[list[Path], argument("DIR...", "Folder of a sweep, or of each part, or merged files.")],
    path: Annotated[Path, argument("FILE.h5", "File to write.", parser=output_path)],
) -> None:
    """Merge parts of a sweep into one HDF5 file.

    xarray opens the file, and all commands that read a folder of a sweep read it as well.
    """
    from warpchain.inputs.validation import printable
    from warpchain.results.sweep_result import merge as merge_shards

    merge_shards(directories, path)
    print(printable(str(path)))
