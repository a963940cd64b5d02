"""``warpchain bench sweep``: the same sweep on one core, on several, on a GPU, on several; how much faster each is.

Every place runs the sweep as the command ``warpchain sweep`` does, into a folder of its own. The clock starts when
every worker has the kernels loaded and stops when the last walk is on disk: walks are planned, spun up, followed to
rest and written meanwhile. What loading took, compilation included, is reported beside it.
"""

import itertools
import json
import os
import statistics
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import warp as wp

from warpchain.bench.cpu_steps import machine
from warpchain.bench.gpu_steps import gpu_machine
from warpchain.bench.places import Place
from warpchain.engine.processors import processors
from warpchain.engine.tallies import CONTACTS
from warpchain.files import replacing
from warpchain.inputs.validation import InputError
from warpchain.run.gpu_workers import GpuWorkers, gpu_workers
from warpchain.run.sweep_run import SweepProgress, one_of_each_cell, prepare
from warpchain.run.sweep_run import sweep as run_sweep
from warpchain.status import Status
from warpchain.store.folder import read_rows
from warpchain.store.manifest import read_manifest
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.walks.rows import Rows

FILE: Final = "scaling.json"
COMPARED: Final = ("status", "dx", "steps_accepted", "steps_rejected", *(f"impulses_{kind}" for kind in CONTACTS))
"""Columns in which walks must agree to the bit to be called equal."""


@dataclass(frozen=True)
class Run:
    """One sweep on one place.

    Attributes:
        seconds: Wall time [s] from when all workers had their kernels until the last walk was on disk.
        processor_seconds: Processor time [s] of this process and its workers meanwhile.
        loading_seconds: Wall time [s] before that: starting workers, compiling and loading kernels.
        rows: What the walks gave.
    """

    seconds: float
    processor_seconds: float
    loading_seconds: float
    rows: Rows


@dataclass(frozen=True)
class PlaceCost:
    """What the sweep cost on a place; times are medians over the rounds.

    Attributes:
        name: Of the place.
        methods: Integrators and their tolerances; a method named by need is another one on a GPU.
        walks: Number of walks.
        statuses: How many ended how.
        all_seconds: Wall time [s] of each round, loading of kernels apart.
        seconds: Wall time [s].
        processor_seconds: Processor time [s] of the host.
        loading_seconds: Wall time [s] that loading the kernels took in the first round, compilation included.
        walks_per_second: Walks per wall time [1/s].
        simulated_per_second: Simulated time of all walks, that on the sprocket included, per wall time.
        ratio: Walks per second, of those of the first place.
    """

    name: str
    methods: str
    walks: int
    statuses: dict[str, int]
    all_seconds: list[float]
    seconds: float
    processor_seconds: float
    loading_seconds: float
    walks_per_second: float
    simulated_per_second: float
    ratio: float


@dataclass(frozen=True)
class Comparison:
    """Walks of two runs of the same samples.

    Attributes:
        first: Name of a place.
        second: Of another one, or the same if two rounds of it differed.
        walks: Number of walks.
        different: How many differ in a bit of :data:`COMPARED`.
    """

    first: str
    second: str
    walks: int
    different: int


@dataclass(frozen=True)
class Scaling:
    """All that was measured.

    Attributes:
        machine: Processor, GPU, versions.
        sweep: Name of the sweep.
        rounds: Times that each place runs it.
        costs: Of each place, in their order.
        comparisons: Every two places that ran the same number of samples.
    """

    machine: dict[str, str]
    sweep: str
    rounds: int
    costs: list[PlaceCost]
    comparisons: list[Comparison]


def measure(
    source: str | os.PathLike[str] | Mapping[str, Any] | Sweep,
    out: Path,
    places: Sequence[Place],
    *,
    rounds: int = 1,
    fresh: bool = False,
    report: Callable[[str], None],
) -> Scaling:
    """Run a sweep on every place, in turn, as many times over; what is known is kept in `FILE` after each run.

    Args:
        source: A sweep file (YAML), its content, or a sweep.
        out: Folder of the folders of all places.
        places: Where.
        rounds: Measurements on each place; each computes all walks anew.
        fresh: Discard what another measurement left in the folders.
        report: Called with a line when something takes a while.

    Raises:
        InputError: The sweep or a folder is refused.
        OSError: A folder cannot be read or written.
    """
    given = load_sweep(source)
    planned = [place.planned(given) for place in places]
    for place in places:
        if not fresh and (out / place.folder).exists():
            raise InputError(f"{out / place.folder}: is there already; give another folder, or --fresh to discard it")
    about = machine() | {"processors": str(processors())}
    if gpus := [place.device for place in places if place.device != "cpu"]:
        about |= gpu_machine(gpus[0]) | {"GPUs": str(wp.get_cuda_device_count())}
    runs: list[list[Run]] = [[] for _ in places]
    changed: list[Comparison] = []
    for turn in range(rounds):
        for place, sweep, own in zip(places, planned, runs, strict=True):

            def say(text: str, begun: str = f"{place.name}, round {turn + 1} of {rounds}") -> None:
                report(f"{begun}: {text}")

            run = measure_once(place, sweep, out / place.folder, say)
            own.append(run)
            if differing := different_walks(own[0].rows, run.rows):
                changed.append(Comparison(place.name, place.name, len(run.rows), differing))
            done = [(place, sweep, own) for place, sweep, own in zip(places, planned, runs, strict=True) if own]
            scaling = Scaling(about, given.name, rounds, _costs(done), [*changed, *_comparisons(done)])
            with replacing(out / FILE) as part:
                part.write_text(json.dumps(as_json(scaling), indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return scaling


def measure_once(place: Place, sweep: Sweep, folder: Path, report: Callable[[str], None]) -> Run:
    """Run a sweep, see :func:`Place.planned`, anew in a folder."""
    report("loading kernels")
    began = time.perf_counter()
    prepare(sweep)  # also before workers start: one of them would compile what another one does
    with _workers(place) as workers:
        if workers is not None:
            workers.in_each(prepare, sweep)
        loading = time.perf_counter() - began
        clock = _Clock(report)
        before = _processor_seconds(workers)
        run_sweep(
            sweep,
            folder,
            executor=workers,
            workers=place.processes or place.threads,
            fresh=True,
            on_progress=clock,
        )
        elsewhere = _processor_seconds(workers) - before
    rows = read_rows(folder, read_manifest(folder))
    return Run(clock.seconds, clock.processor_seconds + elsewhere, loading, rows)


class _Clock:
    """Follows a run: wall time, and processor time of this process, since the walks began."""

    def __init__(self, report: Callable[[str], None]) -> None:
        self.seconds = self.processor_seconds = 0.0
        self._report = report
        self._began: float | None = None

    def __call__(self, progress: SweepProgress) -> None:
        now = time.process_time()
        if progress.compiling:
            return
        if self._began is None:
            self._began = now
        self.seconds, self.processor_seconds = progress.seconds, now - self._began
        self._report(f"{progress.done:,} of {progress.walks:,} walks, {progress.rate:.2f} a second")


@contextmanager
def _workers(place: Place) -> Iterator[GpuWorkers | None]:
    """The processes of a place, if it has any."""
    if not place.processes:
        yield None
        return
    with gpu_workers(place.processes) as workers:
        yield workers


def _processor_seconds(workers: GpuWorkers | None) -> float:
    """Processor time of all worker processes so far [s]."""
    return sum(workers.in_each(time.process_time)) if workers is not None else 0.0


def different_walks(first: Rows, second: Rows) -> int:
    """How many of the same walks differ in a bit of :data:`COMPARED`; NaN equals NaN."""
    differs = np.zeros(len(first), dtype=bool)
    for name in COMPARED:
        ours, theirs = (np.ascontiguousarray(rows[name]).view(np.uint8) for rows in (first, second))
        differs |= (ours != theirs).reshape(len(first), -1).any(axis=1)
    return int(differs.sum())


def _costs(done: Sequence[tuple[Place, Sweep, Sequence[Run]]]) -> list[PlaceCost]:
    """What each place cost."""
    costs: list[PlaceCost] = []
    for place, sweep, runs in done:
        rows = runs[0].rows
        seconds = statistics.median(run.seconds for run in runs)
        rate = len(rows) / seconds
        options = {setup.options for setup in one_of_each_cell(sweep)}
        costs.append(
            PlaceCost(
                name=place.name,
                methods=", ".join(sorted({f"{one.method} {one.tolerance:g}" for one in options})),
                walks=len(rows),
                statuses=dict(Counter(Status(int(code)).label for code in rows["status"])),
                all_seconds=[run.seconds for run in runs],
                seconds=seconds,
                processor_seconds=statistics.median(run.processor_seconds for run in runs),
                loading_seconds=runs[0].loading_seconds,
                walks_per_second=rate,
                simulated_per_second=float(np.nansum(rows["simulated_time"])) / seconds,
                ratio=rate / (costs[0].walks_per_second if costs else rate),
            )
        )
    return costs


def _comparisons(done: Sequence[tuple[Place, Sweep, Sequence[Run]]]) -> list[Comparison]:
    """Every two places with the same samples."""
    found = []
    for (one, here, ours), (other, there, theirs) in itertools.combinations(done, 2):
        if [block.samples for block in here.blocks] == [block.samples for block in there.blocks]:
            different = different_walks(ours[0].rows, theirs[0].rows)
            found.append(Comparison(one.name, other.name, len(ours[0].rows), different))
    return found


def as_json(scaling: Scaling) -> dict[str, Any]:
    """Everything measured, as JSON has it; units are in the docstring of :class:`PlaceCost`."""
    return asdict(scaling)
