"""``warpchain bench sweep``: how much faster a sweep is on several cores, a GPU or several GPUs than on one core.

Every place runs the sweep as the command ``warpchain sweep`` does, into a folder of its own. The clock starts when
every worker has loaded its kernels and stops when the last walk is on disk: in between, walks are planned, computed and
written. The time to load kernels, compilation included, is reported beside it.
"""

import itertools
import json
import os
import statistics
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import warp as wp

from warpchain.bench.gpu_steps import gpu_machine
from warpchain.bench.places import Place
from warpchain.bench.record import machine, plain
from warpchain.engine.processors import processors
from warpchain.engine.tallies import CONTACTS
from warpchain.files import checked_output, make_folder, write_whole
from warpchain.inputs.validation import InputError
from warpchain.run.gpu_workers import GpuWorkers, gpu_workers
from warpchain.run.progress_bar import SweepProgress
from warpchain.run.sweep_run import one_of_each_kind, prepare
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
        rows: Results of the walks.
    """

    seconds: float
    processor_seconds: float
    loading_seconds: float
    rows: Rows


_Measured = tuple[Place, Sweep, list[Run]]


@dataclass(frozen=True)
class PlaceCost:
    """What the sweep cost on a place; times are medians over the rounds.

    Attributes:
        name: Of the place.
        methods: Integrators and their tolerances; ``standard`` means another one on a GPU.
        walks: Number of walks.
        statuses: Number of walks by status.
        all_seconds: Wall time [s] of each round, loading of kernels apart.
        seconds: Wall time [s].
        processor_seconds: Processor time [s] of the host.
        loading_seconds: Wall time [s] that loading the kernels took in the first round, compilation included.
        walks_per_second: Walks per wall time [1/s].
        simulated_per_second: Simulated time of all walks, that on the sprocket included, per wall time.
        ratio: Walks per second over those of the first place.
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

    @property
    def not_at_rest(self) -> int:
        """Walks that did not come to rest."""
        return self.walks - self.statuses.get(Status.AT_REST.label, 0)


@dataclass(frozen=True)
class Comparison:
    """Two runs of the same samples.

    Attributes:
        first: Name of a place.
        second: Name of another one, or of the same if two rounds of it differed.
        walks: Number of walks.
        different: Number of walks that differ in a bit of :data:`COMPARED`.
    """

    first: str
    second: str
    walks: int
    different: int

    def __str__(self) -> str:
        """One line that says how many are equal."""
        places = f"{self.first} and {self.second}" if self.first != self.second else f"two rounds of {self.first}"
        if self.different:
            return f"{places}: {self.different:,} of {self.walks:,} walks differ"
        return f"{places}: all {self.walks:,} walks equal, bit by bit"


@dataclass(frozen=True)
class Scaling:
    """All that was measured.

    Attributes:
        machine: Processor, GPU, versions.
        sweep: Name of the sweep.
        rounds: Number of runs on each place.
        costs: Of each place, in order.
        comparisons: Of all pairs of places that ran the same samples.
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
    """Run a sweep on every place in turn, several times over; `FILE` is written anew after each run.

    Args:
        source: A sweep file (YAML), its content, or a sweep.
        out: Folder with a folder for each place.
        places: Where the sweep runs.
        rounds: Measurements on each place; each computes all walks anew.
        fresh: Discard what another measurement left in the folders.
        report: Called with a line when something takes a while.

    Raises:
        InputError: The sweep or a folder is refused.
        OSError: A folder cannot be read or written.
    """
    given = load_sweep(source)
    measured: list[_Measured] = [(place, place.planned(given), []) for place in places]
    for place in places:
        if not fresh and (out / place.folder).exists():
            raise InputError(f"{out / place.folder}: is there already; give another folder, or --fresh to discard it")
    about = machine() | {"processors": str(processors())}
    if gpus := [place.device for place in places if place.device != "cpu"]:
        about |= gpu_machine(gpus[0]) | {"GPUs": str(wp.get_cuda_device_count())}
    make_folder(out)
    checked_output(out / FILE)
    changed: list[Comparison] = []
    for turn in range(rounds):
        for place, sweep, runs in measured:

            def say(text: str, begun: str = f"{place.name}, round {turn + 1} of {rounds}") -> None:
                report(f"{begun}: {text}")

            run = measure_once(place, sweep, out / place.folder, say)
            runs.append(run)
            if differing := different_walks(runs[0].rows, run.rows):
                changed.append(Comparison(place.name, place.name, len(run.rows), differing))
            done = [one for one in measured if one[2]]
            scaling = Scaling(about, given.name, rounds, _costs(done), [*changed, *_comparisons(done)])
            write_whole(out / FILE, json.dumps(plain(scaling), indent=2, allow_nan=False) + "\n")
    return scaling


def measure_once(place: Place, sweep: Sweep, folder: Path, report: Callable[[str], None]) -> Run:
    """Run a sweep, see :func:`Place.planned`, anew in a folder."""
    report("loading kernels")
    began = time.perf_counter()
    prepare(sweep)  # also before workers start: one of them would compile what another one does
    with gpu_workers(place.processes) if place.processes else nullcontext() as workers:
        if workers is not None:
            workers.in_each(prepare, sweep)
        loading = time.perf_counter() - began
        clock = _Clock(report)
        before = _processor_seconds(workers)
        at_once = place.processes or place.threads
        run_sweep(sweep, folder, executor=workers, workers=at_once, fresh=True, on_progress=clock)
        elsewhere = _processor_seconds(workers) - before
    rows = read_rows(folder, read_manifest(folder))
    return Run(clock.seconds, clock.processor_seconds + elsewhere, loading, rows)


class _Clock:
    """Measures wall time and processor time of this process since the walks began."""

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


def _processor_seconds(workers: GpuWorkers | None) -> float:
    """Processor time of all worker processes so far [s]."""
    return sum(workers.in_each(time.process_time)) if workers is not None else 0.0


def different_walks(first: Rows, second: Rows) -> int:
    """Number of walks that differ in a bit of :data:`COMPARED`; NaN equals NaN."""
    differs = np.zeros(len(first), dtype=bool)
    for name in COMPARED:
        ours, theirs = (np.ascontiguousarray(rows[name]).view(np.uint8) for rows in (first, second))
        differs |= (ours != theirs).reshape(len(first), -1).any(axis=1)
    return int(differs.sum())


def _costs(done: Sequence[_Measured]) -> list[PlaceCost]:
    """Cost of each place."""
    costs: list[PlaceCost] = []
    for place, sweep, runs in done:
        rows = runs[0].rows
        seconds = statistics.median(run.seconds for run in runs)
        rate = len(rows) / seconds
        options = {setup.options for setup in one_of_each_kind(sweep)}
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


def _comparisons(done: Sequence[_Measured]) -> list[Comparison]:
    """All pairs of places with the same samples."""
    found = []
    for (one, here, ours), (other, there, theirs) in itertools.combinations(done, 2):
        if [block.samples for block in here.blocks] == [block.samples for block in there.blocks]:
            different = different_walks(ours[0].rows, theirs[0].rows)
            found.append(Comparison(one.name, other.name, len(ours[0].rows), different))
    return found
