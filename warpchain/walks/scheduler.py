"""Many walks on the worlds of a batch: finished ones make room for waiting ones."""

import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from warpchain.chain.keep import NOTHING, Keep
from warpchain.chain.setup import Setup
from warpchain.chain.starts import Motion, first_motions
from warpchain.engine.batch import Batch
from warpchain.engine.devices import Gpu, gpu_turn, start_device
from warpchain.engine.kernel_choice import block_threads, load_kernels, resident_blocks
from warpchain.inputs.options import Options, on_gpu
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.status import Status
from warpchain.walks.walk_phases import WalkRun, go_on, phase_features

WORLDS_OF_BLOCK = 2
"""Chains under way for each block that a GPU holds: while some are with the host, the others fill it.

With more, every walk takes longer, and so does the end of a run, when the GPU empties.
"""
SHARED_THREADS = 192
"""Most threads of a block that chains of several lengths share."""
SHARED_WALKS = 2000
"""Most walks that share such blocks; of more, each has a block of its own size.

On an H200 the 504 walks of Figure 6 took 3.7 s in blocks of five sizes, each with a kernel of its own, and 2.4 s in
blocks of 192 threads, some of them idle. 2016 walks took as long in both.
"""
DRAWN_TOGETHER = 64
"""Walks that are drawn and laid together, ahead of the worlds that they will have.

To lay w chains takes about F + c w, with F as much as 30 chains: Python's part, beside that of the numbers. For 64 it
is a third of the whole. To take more would gain little, and let a launch that is over wait longer.
"""
BATCHES_PER_GPU = 4
"""While the host handles one of them, the others go on and fill the device."""
NAP = 5e-4
"""Pause [s] before asking again whether a batch is done."""


def run_setups(
    setups: Sequence[Setup],
    *,
    draw: Callable[[Sequence[int]], list[Setup]] | None = None,
    keeps: Sequence[Keep] | None = None,
    slots: int | None = None,
    stop: threading.Event | None = None,
    watch: Callable[[WalkRun], None] | None = None,
    waited: Callable[[float], None] = lambda seconds: None,
) -> Iterator[list[tuple[int, WalkRun]]]:
    """Run walks and yield those that end with the same launch, as (place, run); place: index in ``setups``.

    Runs must be read before the next ones are asked for: their worlds are used again. No bit of a walk depends on the
    others or on the number of slots.

    Args:
        setups: The walks, samples drawn; with ``draw``, options and links suffice.
        draw: Called with the places of walks that are next; returns their setups, with options and links of ``setups``.
        keeps: What is kept of the motion of each; None: nothing. Walks of equal options keep frames equally often.
        slots: Number of chains that run at the same time. Default: on a GPU as many as fill it; on a CPU, where one
            core does a launch, one, which stays in the cache.
        stop: When set, the walks are abandoned after the launch that is under way.
        watch: Called after each launch of each walk.
        waited: Called with the seconds of each pause in which the host waited for a GPU.
    """

    def prepare(places: Sequence[int]) -> Iterator[Prepared]:
        drawn = [setups[place] for place in places] if draw is None else draw(places)
        kept = [NOTHING if keeps is None else keeps[place] for place in places]
        return zip(places, drawn, kept, first_motions(drawn), strict=True)

    def group(places: list[int]) -> list[BatchRun]:
        kept = [] if keeps is None else [keeps[place] for place in places]
        batches, capacity = _batches([setups[place] for place in places], kept, slots)
        waiting = Waiting(places, prepare)
        return [BatchRun(batch, waiting, capacity, watch) for batch in batches]

    yield from _run_groups(map(group, _groups(setups, len(setups))), stop, waited)


def _groups(setups: Sequence[Setup], walks: int) -> list[list[int]]:
    """Places of setups whose walks run on the same kernels, for so many walks in all.

    What takes longest begins first, so that the run does not wait for it in the end: groups of long chains, and in a
    group walks that are spun fast (60 links from rest: 82,000 attempts at 5 Hz, 350,000 at 30; 180: 164,000, 135,000).
    """
    alike: dict[tuple[int, int, Options], list[int]] = defaultdict(list)
    ranks: dict[int, tuple[float, int, str]] = {}  # by the identities of setups, which walks of a cell share
    group_of: dict[int, list[int]] = {}
    for place, setup in enumerate(setups):
        if id(setup) not in ranks:
            links, size = setup.scene.links, block_threads(setup.scene.links)
            shares = not on_gpu(setup.options.device) or (walks <= SHARED_WALKS and size <= SHARED_THREADS)
            group_of[id(setup)] = alike[layout.padded_width(links), 0 if shares else size, setup.options]
            ranks[id(setup)] = -setup.scene.frequency, -links, setup.scene.start
        group_of[id(setup)].append(place)
    for places in alike.values():
        places.sort(key=lambda place: ranks[id(setups[place])])
    return sorted(alike.values(), key=lambda places: -max(setups[place].scene.links for place in places))


def _batches(setups: Sequence[Setup], keeps: Sequence[Keep], slots: int | None) -> tuple[list[Batch], int]:
    """Batches for walks of equal options, on a CPU one, on a GPU several; and how many chains would fill the device."""
    options, scenes = setups[0].options, [setup.scene for setup in setups]
    # Every batch keeps what any walk wants, although most may want nothing: separate batches would each wait for their
    # own slowest walk.
    batch_of = partial(
        Batch,
        longest=max(scene.links for scene in scenes),
        options=options,
        keep=Keep.union(keeps),
        tilts=any(scene.plane == "tilting" for scene in scenes),
        faces=max(len(setup.floor.laws) for setup in setups),
    )
    if not on_gpu(options.device):
        return [batch_of(slots or 1)], slots or 1
    capacity = slots or most_worlds(batch_of(1))
    count = min(capacity, len(setups))
    worlds = -(-count // BATCHES_PER_GPU)
    return [batch_of(min(worlds, count - first)) for first in range(0, count, worlds)], capacity


def most_worlds(one: Batch) -> int:
    """Chains like that of a batch which a GPU should carry on together: enough to fill it, in half of the free memory.

    The other half is left to others, such as batches of other threads.
    """
    assert isinstance(one.device, Gpu)
    filling = WORLDS_OF_BLOCK * resident_blocks(one.threads) * one.device.multiprocessors
    return max(1, min(filling, one.device.free_memory // 2 // one.bytes))


def compile_kernels(
    setups: Sequence[Setup], walks: int | None = None, on_compile: Callable[[], None] = lambda: None
) -> None:
    """Load the kernels of all walks, or of one of each kind and their number; what is missing is compiled at once.

    Before that `on_compile` is called, by any thread and perhaps several times; not if nothing is missing.
    """
    wanted: set[tuple[str, Features, int]] = set()
    for places in _groups(setups, len(setups) if walks is None else walks):
        device, links = setups[places[0]].options.device, max(setups[place].scene.links for place in places)
        features = {each for place in places for each in phase_features(setups[place]).values()}
        wanted |= {(device, each, block_threads(links) if on_gpu(device) else 1) for each in features}
    with gpu_turn(device for device, _, _ in wanted):
        load_kernels(((start_device(device), features, size) for device, features, size in wanted), on_compile)


Prepared = tuple[int, Setup, Keep, Motion | None]
"""Place of a walk, what it is, what is kept of it, and how its chain lies at first."""


class Waiting:
    """Walks of a group that have not begun."""

    def __init__(self, places: Sequence[int], prepare: Callable[[Sequence[int]], Iterable[Prepared]]) -> None:
        """Let walks wait, in the order of their places; `prepare` draws and lays several."""
        self._places, self._prepare, self._ready = deque(places), prepare, deque[Prepared]()

    def __len__(self) -> int:
        """Number of walks that wait."""
        return len(self._places) + len(self._ready)

    def prepare(self) -> bool:
        """Draw and lay the next walks, unless as many are ready, or none is left; whether that was done."""
        if not self._places or len(self._ready) >= DRAWN_TOGETHER:
            return False
        count = min(DRAWN_TOGETHER, len(self._places))
        self._ready.extend(self._prepare([self._places.popleft() for _ in range(count)]))
        return True

    def take(self, most: int) -> list[Prepared]:
        """The next walks, which wait no longer, so many at most."""
        taken: list[Prepared] = []
        while len(taken) < most and (self._ready or self.prepare()):
            taken.append(self._ready.popleft())
        return taken


class BatchRun:
    """A batch and the walks on its worlds; `waiting` are the walks of its group that have not begun."""

    def __init__(self, batch: Batch, waiting: Waiting, capacity: int, watch: Callable[[WalkRun], None] | None) -> None:
        """Prepare to run waiting walks, of which `capacity` would fill the device; those that begin are taken away."""
        self.batch, self.waiting = batch, waiting
        self._capacity, self._watch = capacity, watch
        self._running: dict[int, tuple[int, WalkRun]] = {}
        self._kernels = list[Features]()
        self._kernel = np.full(len(batch.worlds), -1)  # that each world needs, by its number; −1: it is free
        self._is_driven = np.zeros(len(batch.worlds), dtype=bool)  # whether its chain hangs on a driven sprocket

    @property
    def filled_share(self) -> float:
        """Share of the device that its walks fill."""
        return len(self._running) / self._capacity

    def start(self) -> bool:
        """Give waiting walks all free worlds and begin a launch; False if there is nothing to carry on."""
        free = np.flatnonzero(self._kernel < 0).tolist()
        begun = {
            world: (place, WalkRun(self.batch.worlds[world], setup, keep, motion))
            for world, (place, setup, keep, motion) in zip(free, self.waiting.take(len(free)), strict=False)
        }
        self._running |= begun
        self._go_on(begun)
        together = {features: np.flatnonzero(self._kernel == kernel) for kernel, features in enumerate(self._kernels)}
        together = {features: worlds for features, worlds in together.items() if len(worlds)}
        if together:
            self.batch.start(together, driven=self._is_driven)
        return bool(together)

    def finish(self) -> list[tuple[int, WalkRun]]:
        """Wait for the launch; the walks that are over, whose worlds are free."""
        self.batch.finish()
        if self._watch is not None or self.batch.worlds[0].records:
            for _, run in self._running.values():
                run.drain()
                if self._watch is not None:
                    self._watch(run)
        has_stopped = (self._kernel >= 0) & (self.batch.statuses() != int(Status.RUNNING))
        stopped = {world: self._running[world] for world in np.flatnonzero(has_stopped).tolist()}
        self._go_on(stopped)
        return [self._running.pop(world) for world, (_, run) in stopped.items() if run.features is None]

    def _go_on(self, walks: Mapping[int, tuple[int, WalkRun]]) -> None:
        """Begin the next phase of walks on worlds, and note what kernels these need."""
        if not walks:
            return
        go_on([run for _, run in walks.values()])
        wanted = [run.features for _, run in walks.values()]
        different = {id(features): features for features in wanted}  # which are compared slowly
        self._kernels += (each for each in different.values() if each is not None and each not in self._kernels)
        numbers = {key: -1 if each is None else self._kernels.index(each) for key, each in different.items()}
        self._is_driven[[*walks]] = [run.is_driven for _, run in walks.values()]
        self._kernel[[*walks]] = [numbers[id(features)] for features in wanted]


def _run_groups(
    groups: Iterator[list[BatchRun]], stop: threading.Event | None, waited: Callable[[float], None]
) -> Iterator[list[tuple[int, WalkRun]]]:
    """Run groups one after the other; when the last walks of a group no longer fill the device, the next joins in."""
    under_way: list[BatchRun] = []
    try:
        while not (stop is not None and stop.is_set()):
            while not any(run.waiting for run in under_way) and sum(run.filled_share for run in under_way) < 1:
                group = next(groups, None)
                if group is None:
                    break
                under_way += [run for run in group if run.start()]
            if not under_way:
                return
            ready = next((run for run in under_way if run.batch.is_done()), None)
            if ready is None:
                if any(run.waiting.prepare() for run in under_way):
                    continue
                began = time.perf_counter()
                time.sleep(NAP)
                waited(time.perf_counter() - began)
                continue
            if over := ready.finish():
                yield over
            under_way.remove(ready)
            if ready.start():
                under_way.append(ready)
    finally:
        for run in under_way:
            run.batch.finish()
