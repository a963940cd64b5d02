"""`warpchain.sweep`: hands the shards of a sweep to workers and follows their progress; an interrupted sweep resumes.

A worker runs the walks of shards, writes each shard to an immutable file and returns the name of its machine. So
any executor in the style of ``concurrent.futures`` will do, on this machine or another that sees the same folder.
"""

import itertools
import math
import os
import re
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Unpack

import numpy as np
from pydantic import Field

from warpchain.chain.resolution import MAY_BE_NONE, Values
from warpchain.chain.setup import DEFAULT_PRESET, Setup
from warpchain.engine.devices import gpu_turn, has_gpu_turn, start_device
from warpchain.engine.machine import machine_text, own_command
from warpchain.engine.processors import free_memory, processors
from warpchain.engine.world import World
from warpchain.files import AnyPath
from warpchain.inputs.fields import SECTION_OF, by_section
from warpchain.inputs.keywords import takes_fields, types_of
from warpchain.inputs.options import Options, on_gpu
from warpchain.inputs.validation import InputError, Whole, by_name, checked, checked_path, plain, shown, validated
from warpchain.results.sweep_result import SweepResult, load
from warpchain.run import progress_bar
from warpchain.run.progress_bar import OnProgress, SweepProgress, counts_text
from warpchain.run.workers import Pulse, losses_named, pulsing_threads
from warpchain.status import Status
from warpchain.store.crate import write_crate
from warpchain.store.folder import SweepFolder
from warpchain.store.shards import SHARDS, Part, Shard, check_numerics, opened_shard, rows_of, stamp, write_shard
from warpchain.sweeps.block import is_axis
from warpchain.sweeps.plan import Source, Sweep, load_sweep
from warpchain.sweeps.sweep_file import VERSION, BlockKeys, SweepFile
from warpchain.walks.landmarks import LENGTHS
from warpchain.walks.rows import derived_columns, faults_of_columns, fill_drawn, fill_outcomes, missing_rows
from warpchain.walks.scheduler import compile_kernels, run_setups
from warpchain.walks.walk_phases import WalkRun, outcomes, taken

if TYPE_CHECKING:
    from warpchain.typed import SweepFields

Tasks = Iterator[tuple[Future[str], list[Shard]]]

FILE_KEYS: Final = (*BlockKeys.model_fields, "same_samples_along", "record", "name", "seed")
"""Keys of a sweep file that are keywords."""
OF_FILE: Final = {name: f"{kind.removesuffix(' | None')} | None" for name, kind in types_of(SweepFile).items()}
"""Types of the keys of a sweep file as keywords."""
REPLACED: Final = ("seed", "samples", "until", "at_most")
"""Keys that are also taken beside a source, where they replace those at its top level."""
BYTES_OF_WALK = 1500
"""Memory that each walk of a sweep takes in the end, about: its row of some 700 bytes, read and put into columns."""
SHARD_WALKS = 256
"""Most walks in a shard."""
GPU_TASK_WALKS = 262144
"""Upper bound on the walks of a GPU's task, about; the GPU idles while the last walks finish."""
PASSES = 8
"""Times that a sweep on a CPU is gone through."""


@takes_fields("scene", "parameters", "options", beside={name: (OF_FILE[name], None) for name in FILE_KEYS})
def sweep(
    source: str | os.PathLike[str] | Mapping[str, Any] | Sweep | None = None,
    out: str | os.PathLike[str] | None = None,
    *,
    part: str | None = None,
    executor: Any = None,
    workers: int | None = None,
    fresh: bool = False,
    progress: bool = True,
    on_progress: OnProgress | None = None,
    **settings: "Unpack[SweepFields]",
) -> SweepResult:
    """Run a sweep, or resume it, and load its results.

        warpchain.sweep(links=[40, 60], frequency=np.linspace(5, 30, 6), start="spinning", samples=20, out="speeds")

    Args:
        source: A sweep file (YAML), the bare name of one that comes with the package, its content, or a :class:`Sweep`.
            None: the sweep is defined by the keywords below.
        out: Results folder. If it holds part of this sweep, the sweep resumes, and the results are the same bytes as
            without the interruption. If only ``samples`` is larger than in the folder, the new samples are added
            (not possible for Latin hypercubes).
        settings: Any setting of :func:`walk`. A list, an array or a range ``{"from":, "to":, "step":}`` is an axis of
            the grid; floors, releases and lists of numbers for links need a name each. The last axis varies fastest.
            The other keywords are the keys of a sweep file:
        grid: Further axes, which come before those of the settings.
        points: Parameter sets, as a table or as a mapping from each quantity to its values. They are an additional
            axis, ``point``, beside the grid.
        samples: Number of samples in each cell of the grid; with a source it replaces the number at its top level.
        until: Quantity → standard error of its mean at which a cell stops, relative as ``{"dx": 0.01}`` or ``"1 %"``,
            or absolute as ``"2 mm"``; a single value is that of Δx. The samples of a cell double until all are reached.
        at_most: Greatest number of samples of a cell with ``until``, by default 1024.
        sampler: ``"random"`` (the default), ``"sobol"``, ``"latin_hypercube"`` or ``"saltelli"``.
        randomisations: Number of independent randomisations of such a design, from which standard errors of means are
            estimated; default 8.
        preset: Set of physical parameters, as in :func:`walk`.
        scene: Fields of :class:`Scene` that differ from their defaults.
        parameters: Fields of :class:`Parameters` that differ from the preset.
        options: Fields of :class:`Options` that differ from their defaults.
        distributions: Quantity → its distribution: ``"fixed"``, ``"table"`` (Table 1), ``{"uniform": [lower, upper]}``
            or ``{"gaussian": {"mean":, "sigma":}}``; ``"all"`` stands for every other quantity, by default ``"table"``.
        same_samples_along: Axes along which the same samples are used.
        independent: Sampled quantities whose values differ between cells even along such axes.
        record: Which motions are recorded, e.g. ``{"series": True, "frames": {"samples": [0]}}``.
        name: Name of the sweep; default: the name of the folder.
        seed: Seed of all random numbers, default 0; with a source it replaces the seed of the source.
        part: ``"k/N"``: run only the k-th of N parts, in its own folder; ``warpchain merge`` joins the parts.
        device: ``"cpu"``, ``"cuda"`` or ``"cuda:N"`` instead of the device of the sweep. ``standard`` then means
            the default of that device; a folder keeps the method with which it was begun.
        executor: Object that computes the shards by ``submit``, such as the executors of ``concurrent.futures`` and
            ``mpi4py.futures``, or a Dask client; its workers must see ``out``. Default: threads of this process.
        workers: Number of tasks at a time. Default: the CPU cores of this machine; with a Dask client the threads of
            its workers. With an executor, set at least the number of its workers. Without one, a GPU has one task.
        fresh: Delete the results of another sweep in the folder.
        progress: Show a bar in a terminal or a notebook, elsewhere a line a minute on standard error, unless
            ``on_progress`` is given.
        on_progress: Function that is called before kernels are compiled, if any are, when the walks begin, and about
            every second.

    Raises:
        InputError: The sweep or the folder is refused; one line with the remedy for each value. It is a ``ValueError``.
        OSError: The folder cannot be read or written.
        LostWorkersError: Worker processes have ended, or the scheduler of a Dask client was closed.
    """
    if executor is not None and not hasattr(executor, "submit"):
        wanted = "one with submit, such as concurrent.futures.ProcessPoolExecutor(), or a Dask client"
        raise InputError(f"executor: expected {wanted}, got {shown(executor)}")
    planned, folder, own, count = _checked_call(source, out, settings, settings.pop("device", None), workers, part)
    if hasattr(executor, "get_executor"):
        count = count or sum(executor.nthreads().values())
        executor = executor.get_executor(pure=False)  # pure: a task that failed would fail again, unrun
    with progress_bar.changing_line(every=progress_bar.LINE_EVERY if progress else math.inf) as show:
        report = on_progress or (
            lambda seen: show(progress_bar.progress_text(seen), seen.compiling) if progress else None
        )
        _run_in_folder(planned, folder, executor, count, fresh, own, report)
    return load(folder)


def _checked_call(
    source: Source | None, out: AnyPath | None, given: Values, device: str | None, workers: int | None, part: str | None
) -> tuple[Sweep, Path, Part, int | None]:
    """The sweep on its device, its folder, its part, and the number of workers; an `InputError` for all refused."""

    def plan() -> Sweep:
        planned = load_sweep(source, **replaced) if source is not None else sweep_of_keywords(settings, out)
        return on_device(planned, device)

    problems, found = list[str](), list[Any]()
    unsaid = {name for name in (*FILE_KEYS, *MAY_BE_NONE) if given.get(name) is None}
    settings = {name: value for name, value in given.items() if name not in unsaid}
    replaced = {name: plain(settings[name], name) for name in REPLACED if name in settings}
    if source is not None and (others := [name for name in settings if name not in replaced]):
        names = ", ".join(others)
        problems.append(f"{names}: not possible with a source; remove one, or write it into the source")
    at_least_one = Annotated[Whole, Field(ge=1)] | None
    checks = plan, partial(checked_path, out, "out"), partial(checked_part, part)
    for check in (*checks, partial(checked, workers, "workers", at_least_one)):
        try:
            found.append(check())
        except InputError as error:
            problems += error.args
    if problems:
        raise InputError(*problems)
    return found[0], found[1], found[2], found[3]


def sweep_of_keywords(given: Values, out: AnyPath | None) -> Sweep:
    """The sweep that keyword arguments describe; an `InputError` with a line for each value that is refused.

    They are `FILE_KEYS`, and fields of a walk by name or symbol; a list or a range is an axis of the grid, behind those
    given. Left out, the name is that of the folder, the seed 0, and the preset that of a walk, unless it is an axis.
    """
    name = Path(out).absolute().name if isinstance(out, str | os.PathLike) else ""
    usual = {"name": name or "sweep", "seed": 0, "version": VERSION}
    values = plain(given, "sweep")
    content: dict[str, Any] = usual | {key: values.pop(key) for key in FILE_KEYS if key in values}
    by_section(values, [*FILE_KEYS, *(sweep.__kwdefaults__ or ())])  # refuses unknown names
    if isinstance(content.get("preset"), list):
        values = {"preset": content.pop("preset"), **values}
    for name, value in by_name(values).items():
        key = "grid" if is_axis(name, value) else SECTION_OF[name]
        others = content.setdefault(key, {})
        if isinstance(others, dict):  # the check of the content refuses anything else
            if name in by_name(others):
                raise InputError(f"{name}: given twice, also in {key}; remove one")
            content[key] = {**others, name: value}
    grid = content.get("grid")
    if not (isinstance(grid, Mapping) and "preset" in grid):
        content.setdefault("preset", DEFAULT_PRESET)
    return load_sweep(content)


def checked_part(given: object) -> Part:
    """Number of a part and number of parts of "k/N", 1/1 of None, or an `InputError`."""
    if given is None:
        return 1, 1
    found = re.fullmatch(r"([1-9]\d{0,5})/([1-9]\d{0,5})", given) if isinstance(given, str) else None
    if found is None or int(found[1]) > int(found[2]):
        raise InputError(f"part: expected k/N with 1 ≤ k ≤ N < 10⁶, got {shown(given)}; use e.g. 3/8")
    return int(found[1]), int(found[2])


def _run_in_folder(
    planned: Sweep, folder: Path, executor: Any, workers: int | None, fresh: bool, part: Part, report: OnProgress
) -> None:
    """Run what is missing in a folder."""
    kinds = kinds_of_kernels(planned)
    pulse, at_once, on_devices = None, workers or processors(), set[str]()
    if executor is None:
        devices = on_devices = {setup.options.device for setup in kinds}
        if has_gpu_turn() and any(map(on_gpu, devices)):
            raise InputError("device: this thread is running a walk on a GPU; start the sweep after it has ended")
        for device in devices:
            start_device(device)  # refuses one that is not there before anything is written
        if all(map(on_gpu, devices)):
            at_once = 1  # the others would wait for it
    needed = BYTES_OF_WALK * planned.walk_count
    if needed > (free := free_memory()):
        problem = f"{planned.walk_count:,} walks take {needed / 1e9:.2g} GB of memory, and {free / 1e9:.2g} GB are free"
        key = "at_most" if planned.has_rounds else "samples"
        raise InputError(f"{key}: {problem}; use fewer samples or cells, or a machine with more memory")
    size = shard_size(planned)
    with SweepFolder.open(folder, planned, fresh=fresh, shard_size=size, part=part) as store, ExitStack() as held:
        missing = store.missing()
        before = store.walks - store.left
        progress = SweepProgress(walks=store.walks, done=before, before=before)
        store.log(f"{len(missing)} shards to do, {before} of {store.walks} walks done")
        if missing and executor is None:
            compile_kernels(kinds, store.left, lambda: report(replace(progress, compiling=True)))
            executor, pulse = held.enter_context(pulsing_threads(at_once))
        machines = [] if pulse is None else [machine_text(sorted(on_devices))]
        crated = partial(write_crate, store.directory, store.manifest, own_command(), machines)

        def note(machine: str) -> None:
            if pulse is None and machine not in machines:
                machines.append(machine)
                crated()

        if missing:
            crated(is_new=True)
        where = str(store.directory), stamp(store.directory)
        for number in range(1, int(store.manifest.turns.max()) + 2):  # rounds of `until`; else there is one
            if not missing:
                break
            progress.walks, progress.round = store.walks, number if planned.has_rounds else None
            tasks = _tasks(planned, missing, at_once if pulse is None else 1)  # threads take turns on a GPU
            submitted = ((executor.submit(run_shards, planned, *where, tuple(task), pulse), task) for task in tasks)
            _follow(submitted, 2 * at_once, pulse or Pulse(), store, missing, progress, report, note)
            if not (missing := store.missing()):
                crated(is_over=True)
        counts = counts_text(progress) or "nothing to do"
        store.log(f"complete after {progress.seconds:.1f} s: {counts}")


def shard_size(planned: Sweep) -> int:
    """Most walks of a shard; it depends on the sweep only, so that equal sweeps leave equal files."""
    return max(1, min(SHARD_WALKS, planned.walk_count // SHARDS))


def kinds_of_kernels(planned: Sweep) -> list[Setup]:
    """A setup of each cell along the axes by which kernels may differ."""
    axes = (*Options.model_fields, "links", "start", "plane")
    return [setup for block in planned.blocks for setup in block.fixed_in(block.cells_along(axes))]


def compile_sweep(source: Source, device: str | None = None, on_compile: Callable[[], None] = lambda: None) -> Sweep:
    """Put the kernels of a sweep's walks into the cache, for a device or that of the sweep; errors as of `sweep`.

    If any is missing there `on_compile` is called before, perhaps several times.
    """
    planned = on_device(load_sweep(source), device)
    kinds = kinds_of_kernels(planned)
    for name in {setup.options.device for setup in kinds}:
        start_device(name)
    compile_kernels(kinds, planned.walk_count, on_compile)
    return planned


def on_device(planned: Sweep, device: str | None) -> Sweep:
    """The same sweep on another device, if one is given; a method that was named by need is what this means there.

    The canonical form, in which a folder keeps its sweep, names the method itself, so that the sweep is run again with
    the same method on any device. An `InputError` says that the sweep's grid goes over devices.
    """
    if device is None:
        return planned
    if any("device" in block.varied for block in planned.blocks):
        raise InputError(f"device: {device} is not possible with device as an axis of the grid; remove one")
    validated(Options, {"device": device}, "options")
    blocks = []
    for block in planned.blocks:
        options = {**block.sections["options"], "device": device}
        blocks.append(replace(block, sections={**block.sections, "options": options}))
    moved = replace(planned, blocks=tuple(blocks))
    moved.check()
    return moved


def run_shards(planned: Sweep, directory: str, seal: str, shards: Sequence[Shard], pulse: Pulse | None = None) -> str:
    """Run the walks of some shards and write each shard as soon as its walks are over; what a worker does.

    It returns what names its machine. The seal is the `stamp` that the folder has to have. The pulse counts the walks
    that are over, and stops the work: unfinished shards are not written.
    """
    check_numerics(directory)  # of a worker with another version of warpchain
    stop = None if pulse is None else pulse.stop
    walks = list(planned.undrawn(index for shard in shards for index in shard.walks.tolist()))
    setups, keeps = [walk.setup for walk in walks], [planned.keep(walk) for walk in walks]
    of_walk = np.repeat(np.arange(len(shards)), [len(shard) for shard in shards])
    firsts = np.flatnonzero(np.diff(of_walk, prepend=-1))
    rows = missing_rows(shards[0].kind, np.concatenate([shard.keys for shard in shards]))
    motions: dict[int, dict[int, dict[str, Any]]] = defaultdict(dict)
    missing = np.bincount(of_walk)

    def draw(places: Sequence[int]) -> list[Setup]:
        drawn = planned.with_draws([walks[place] for place in places])
        fill_drawn(rows, places, [walk.draws for walk in drawn])
        return [walk.setup for walk in drawn]

    with gpu_turn((setup.options.device for setup in setups), stop):
        compile_kernels(setups)  # all at once: a walk that needs one would wait for it alone
        waited = (lambda seconds: None) if pulse is None else pulse.wait
        ended: dict[int, WalkRun] = {}
        worlds: list[World] = []
        for over in run_setups(setups, draw=draw, keeps=keeps, stop=stop, waited=waited):
            places = [place for place, _ in over]
            ended.update(over)
            worlds.append(taken([run for _, run in over]))
            if pulse is not None:
                pulse.beat(len(over))
            for place, run in over:
                if keeps[place].series_every is not None:
                    motions[of_walk[place]][place - firsts[of_walk[place]]] = run.motion()
            np.subtract.at(missing, of_walk[places], 1)
            numbers = [number for number in set(of_walk[places].tolist()) if missing[number] == 0]
            if numbers or len(ended) >= SHARD_WALKS:
                fill_outcomes(rows, [*ended], outcomes([*ended.values()], worlds))
                ended, worlds = {}, []
            for number in numbers:
                shard, first = shards[number], firsts[number]
                write_shard(directory, seal, shard, rows[first : first + len(shard)], motions.pop(number, {}))
    return machine_text(sorted({setup.options.device for setup in setups}))


def _follow(
    tasks: Tasks,
    at_once: int,
    pulse: Pulse,
    store: SweepFolder,
    missing: Sequence[Shard],
    progress: SweepProgress,
    report: OnProgress,
    note: Callable[[str], None],
) -> None:
    """Ask for so many tasks at once, so that memory does not grow with the sweep, and count the shards they write.

    `note` is told the machine of each task.

    A task whose shards are written is done, whatever becomes of it: Dask fails one that a killed worker had finished.
    """
    report(progress)
    began, written, blocks = time.perf_counter() - progress.seconds, 0, store.manifest.sweep.blocks
    done, beats = progress.done, pulse.over
    folder, left = store.directory / "shards", {shard.name: shard for shard in missing}
    lengths = {name: np.concatenate([block.parameter(name).ravel() for block in blocks]) for name in LENGTHS}
    pending: dict[Future[str], list[Shard]] = {}
    try:
        while True:
            with losses_named():
                pending.update(itertools.islice(tasks, at_once - len(pending)))
                if not pending:
                    break
                finished, _ = wait(pending, 1.0, FIRST_COMPLETED)  # looks for shards every second
                there = set(os.listdir(folder))
                for future in finished:
                    has_failed = future.cancelled() or future.exception() is not None
                    if not (has_failed and there.issuperset(shard.name for shard in pending[future])):
                        note(future.result())
                    del pending[future]
            for name in left.keys() & there:
                shard = left.pop(name)
                with opened_shard(store.directory, name, shard.digest, store.manifest.numerics_version) as file:
                    rows = rows_of(file, shard.kind)
                columns = {name: rows[name] for name in rows.dtype.names or ()}
                own = {name: values[shard.walks % blocks[0].stride] for name, values in lengths.items()}
                found = faults_of_columns(columns | derived_columns(columns), own)
                progress.statuses.update(Status(int(code)).label for code in rows["status"])
                progress.inaccurate += int(np.any([*found.values()], axis=0).sum())
                written += len(shard)
            progress.done = done + max(written, pulse.over - beats)
            progress.seconds, progress.waited = time.perf_counter() - began, pulse.waited
            report(progress)
    finally:
        for future in pending:
            future.cancel()


def _tasks(planned: Sweep, missing: Sequence[Shard], gpus: int) -> Iterator[list[Shard]]:
    """The shards of each task: one on a CPU; on a GPU enough to fill it, if there are enough.

    Neighbouring shards are alike. So on a GPU, which has few tasks, each takes every n-th shard, and all take equally
    long; on a CPU every `PASSES`-th shard comes first, and the rate is soon that of the whole sweep.
    """
    for_gpus: list[Shard] = []
    spread = [shard for number in range(PASSES) for shard in missing[number::PASSES]]
    firsts = planned.undrawn(int(shard.walks[0]) for shard in spread)
    for shard, first in zip(spread, firsts, strict=True):
        if on_gpu(first.setup.options.device):
            for_gpus.append(shard)
        else:
            yield [shard]
    count = gpus * -(-sum(map(len, for_gpus)) // (gpus * GPU_TASK_WALKS))
    for number in range(min(count, len(for_gpus))):
        yield for_gpus[number::count]
