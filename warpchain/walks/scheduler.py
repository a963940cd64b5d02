"""Many walks on the worlds of a batch: finished ones make room for waiting ones."""

import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from warpchain.engine.batch import Batch
from warpchain.engine.devices import gpu_turn, start_device
from warpchain.engine.kernel_choice import block_threads, features_of, load_kernels
from warpchain.engine.memory import most_worlds
from warpchain.inputs.options import Options, on_gpu
from warpchain.inputs.scene import face_count, floor_body
from warpchain.inputs.setup import Setup
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.status import Status
from warpchain.walks.motion import NOTHING, Keep
from warpchain.walks.walk_phases import WalkRun

ATTEMPTS = {"cpu": 5_000, "cuda": 200_000}
"""Most attempts of each chain per launch, by kind of device; what a walk gives does not depend on it.

On a CPU 5000 take 6 to 110 ms, which is the grain of progress and of Ctrl-C. On a GPU a launch is cut by its time:
attempts in a pile take three times as long as in flight, and with equal numbers of attempts every chain would wait for
the slowest of its batch.
"""
BATCHES_PER_GPU = 4
"""While the host handles one of them, the others go on and fill the device."""
NAP = 5e-4
"""Pause [s] before asking again whether a batch is done."""

Begin = Callable[[int, Batch, int], WalkRun]
"""Begins a walk. Called with (place, batch, world); place: index in ``setups``."""
Watch = Callable[[WalkRun, bool], None]
"""Called with (run, is_loading): False after each launch of the run, True before a kernel that it needs is loaded."""


def run_setups(
    setups: Sequence[Setup],
    *,
    draw: Callable[[int], Setup] | None = None,
    keeps: Sequence[Keep] | None = None,
    slots: int | None = None,
    threads: int | None = None,
    stop: threading.Event | None = None,
    watch: Watch | None = None,
) -> Iterator[tuple[int, WalkRun]]:
    """Run walks and yield each when it is over, as (place, run); place: index in ``setups``.

    A run must be read before the next one is asked for: its world is used again. No bit of a walk depends on the others
    or on the number of slots.

    Args:
        setups: The walks, samples drawn; with ``draw``, options and links suffice.
        draw: Called with the place of a walk when it begins; returns its setup, with options and links of ``setups``.
        keeps: What is kept of the motion of each, for ``run.recorder``; None: nothing. Walks of equal options keep
            frames equally often.
        slots: Number of chains that run at the same time. Default: on a GPU as many as fill it; on a CPU, where one
            core does a launch, one, which stays in the cache.
        threads: Of every block on a GPU, see `warpchain.engine.kernel_choice.shared_threads`; no bit depends on it.
        stop: When set, the walks are abandoned after the launch that is under way.
        watch: For progress. With it, each kernel is loaded when it is first needed, and ``watch`` is called before.
    """
    alike: dict[tuple[Options, int, int], list[int]] = defaultdict(list)
    for place, setup in enumerate(setups):
        links = setup.scene.links
        size = (threads or block_threads(links)) if on_gpu(setup.options.device) else 1
        alike[setup.options, layout.padded_width(links), size].append(place)

    def begin(place: int, batch: Batch, world: int) -> WalkRun:
        setup = setups[place] if draw is None else draw(place)
        return WalkRun(batch, world, setup, NOTHING if keeps is None else keeps[place])

    def group(places: list[int]) -> Group:
        places.sort(key=lambda place: -setups[place].scene.links)
        links = [setups[place].scene.links for place in places]
        wanted = [] if keeps is None else [keeps[place] for place in places]
        tilts = any(setups[place].scene.plane == "tilting" for place in places)
        faces = max(face_count(setups[place].scene) for place in places)
        waiting = deque(places)
        batches, capacity = _batches(setups[places[0]].options, links, wanted, slots, threads, tilts, faces)
        return Group(waiting, [BatchRun(batch, waiting, begin, watch) for batch in batches], capacity)

    # long chains take longest: they begin first, so that the run does not wait for them in the end
    longest_first = sorted(alike.items(), key=lambda item: item[0][1:], reverse=True)
    yield from _run_groups((group(places) for _, places in longest_first), stop)


def _batches(
    options: Options,
    links: Sequence[int],
    keeps: Sequence[Keep],
    slots: int | None,
    threads: int | None,
    tilts: bool,
    faces: int,
) -> tuple[list[Batch], int]:
    """Batches for walks, and how many chains would fill the device.

    On a CPU it is one batch, on a GPU several, with as many worlds in all as are of use and fit.
    """
    longest, blocks = max(links), on_gpu(options.device)
    # Every batch keeps what any walk wants, although most may want nothing: separate batches would each wait for their
    # own slowest walk.
    samples, loads = any(keep.series_every for keep in keeps), any(keep.before > 0 or keep.loads for keep in keeps)
    frame_every = next((keep.frame_every for keep in keeps if keep.frame_every), None)
    kept: dict[str, Any] = {"keeps_samples": samples, "keeps_loads": loads, "tilts": tilts, "faces": faces}
    kept["threads"] = threads
    if slots is None and blocks:
        slots = most_worlds(longest, options, keeps_frames=frame_every is not None, **kept)
    capacity = slots = slots or 1
    if blocks:
        slots = min(slots, len(links))
    worlds = -(-slots // BATCHES_PER_GPU) if blocks else slots
    intervals = {keep.frame_interval for keep in keeps if keep.frame_interval > 0}
    if len(intervals) > 1:
        raise ValueError(f"keeps: frame intervals {sorted(intervals)} s; walks that run together have one")
    kept |= {"frame_every": frame_every, "frame_interval": max(intervals, default=0.0)}
    batches = [Batch(min(worlds, slots - first), longest, options, **kept) for first in range(0, slots, worlds)]
    return batches, capacity


def compile_kernels(setups: Iterable[Setup], threads: int | None = None) -> None:
    """Compile every kernel that these walks need, before several threads or processes ask for it at once.

    Args:
        setups: The walks.
        threads: As for :func:`run_setups`.
    """
    wanted: set[tuple[str, Features, int]] = set()
    for setup in setups:
        columns = layout.padded_width(setup.scene.links)
        floor = floor_body(setup.scene)
        for fixed_body in [floor] + ["sprocket"] * setup.has_drive:
            tilts = fixed_body == floor and setup.scene.plane == "tilting"
            features = features_of(setup.options, columns, fixed_body=fixed_body, tilts=tilts)
            size = (threads or block_threads(setup.scene.links)) if on_gpu(setup.options.device) else 1
            wanted.add((setup.options.device, features, size))
            if setup.has_drive and setup.scene.release is not None and fixed_body == floor:
                wanted.add((setup.options.device, replace(features, moving_sprocket=True), size))
    with gpu_turn(device for device, _, _ in wanted):
        load_kernels((start_device(device), features, size) for device, features, size in wanted)


class BatchRun:
    """A batch and the walks on its worlds."""

    def __init__(self, batch: Batch, waiting: deque[int], begin: Begin, watch: Watch | None) -> None:
        """Prepare to run waiting walks, given by their places; those that have begun are taken away."""
        self.batch = batch
        self._waiting, self._begin, self._watch = waiting, begin, watch
        self._loaded: set[Features] = set()
        self._free = list(reversed(range(len(batch.links))))
        self._running: dict[int, tuple[int, WalkRun]] = {}
        self._features: dict[int, Features] = {}

    @property
    def running(self) -> int:
        """Number of walks under way."""
        return len(self._running)

    def start(self) -> bool:
        """Give waiting walks the free worlds and begin a launch; False if there is nothing to carry on."""
        while self._free and self._waiting:
            place, world = self._waiting.popleft(), self._free.pop()
            run = self._begin(place, self.batch, world)
            self._running[world] = place, run
            self._features[world] = run.features
        together: dict[Features, list[int]] = defaultdict(list)
        for world, features in self._features.items():
            together[features].append(world)
        if self._watch is not None:
            for features in together.keys() - self._loaded:
                for world in together[features]:
                    self._watch(self._running[world][1], True)
                began = time.perf_counter()
                self.batch.compile(features, [self.batch.links[world] for world in together[features]])
                for _, run in self._running.values():
                    run.compile_time += time.perf_counter() - began
                self._loaded.add(features)
        self.batch.start(together, ATTEMPTS["cuda" if on_gpu(self.batch.options.device) else "cpu"])
        return bool(together)

    def finish(self) -> Iterator[tuple[int, WalkRun]]:
        """Wait for the launch, and yield every walk that is over as its world becomes free."""
        self.batch.finish()
        running = self.batch.statuses() == Status.RUNNING
        for world, (place, run) in list(self._running.items()):
            run.drain()
            if self._watch is not None:
                self._watch(run, False)
            if running[world]:
                continue
            if run.next_phase():
                self._features[world] = run.features
                continue
            yield place, run
            del self._running[world], self._features[world]
            self._free.append(world)


@dataclass(frozen=True)
class Group:
    """Walks that run on the same kernels.

    Attributes:
        waiting: Places of the walks that have not begun.
        runs: What runs them.
        capacity: Number of such walks that would fill the device.
    """

    waiting: deque[int]
    runs: list[BatchRun]
    capacity: int

    @property
    def load(self) -> float:
        """Share of the device that its walks fill."""
        return sum(run.running for run in self.runs) / self.capacity


def _run_groups(groups: Iterator[Group], stop: threading.Event | None) -> Iterator[tuple[int, WalkRun]]:
    """Run groups one after the other; when the last walks of a group no longer fill the device, the next joins in."""
    begun: list[Group] = []
    under_way: list[BatchRun] = []
    try:
        while not (stop is not None and stop.is_set()):
            begun = [group for group in begun if group.waiting or group.load > 0]
            while not (begun and begun[-1].waiting) and sum(group.load for group in begun) < 1:
                group = next(groups, None)
                if group is None:
                    break
                begun.append(group)
                for run in group.runs:
                    if run.start():
                        under_way.append(run)
            if not under_way:
                return
            ready = next((run for run in under_way if run.batch.is_done()), None)
            if ready is None:
                time.sleep(NAP)
                continue
            yield from ready.finish()
            under_way.remove(ready)
            if ready.start():
                under_way.append(ready)
    finally:
        for run in under_way:
            run.batch.finish()
