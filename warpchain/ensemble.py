"""Many walks on the worlds of a batch: finished ones make room for waiting ones."""

import threading
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence

from warpchain.course import Course
from warpchain.engine import Batch
from warpchain.kernels import layout
from warpchain.kernels.driver import Features
from warpchain.options import Options, Setup
from warpchain.recording import NOTHING, Keep
from warpchain.status import Status

TRIES = {"cpu": 20_000, "cuda": 10_000}
"""Tries of each chain per launch, by kind of device; what a walk gives does not depend on it."""
MOST_SLOTS = 4096
"""Most chains in one launch on a GPU: enough to fill it."""


def run_setups(
    setups: Sequence[Setup],
    *,
    keeps: Sequence[Keep] | None = None,
    slots: int | None = None,
    stop: threading.Event | None = None,
) -> Iterator[tuple[int, Course]]:
    """Run walks and yield each when it is over, as (place in ``setups``, course).

    A course must be read before the next one is asked for: its world is used again. What a walk gives does not depend,
    to the bit, on the others or on the number of slots.

    Args:
        setups: The walks, samples drawn.
        keeps: What is kept of the motion of each, for ``course.motion``; None: nothing. Walks of equal options keep
            frames equally often.
        slots: Chains that are carried on together in one launch. Default: on a GPU as many as fill it, on a CPU, where
            a launch is one core's work, one at a time, which stays in the cache.
        stop: When set, the walks are abandoned after the launch that is under way.
    """
    buckets: dict[tuple[Options, int], list[int]] = defaultdict(list)
    for place, setup in enumerate(setups):
        buckets[setup.options, layout.padded_width(setup.scene.links)].append(place)
    for (options, _), places in buckets.items():
        longest = max(setups[place].scene.links for place in places)
        worlds = slots or (MOST_SLOTS if options.device.startswith("cuda") else 1)
        wanted = {place: keeps[place] if keeps is not None else NOTHING for place in places}
        # One batch for all, although most may keep nothing: two batches would wait for two slowest walks.
        batch = Batch(
            min(worlds, len(places)),
            longest,
            options,
            keeps_samples=any(keep.series_every for keep in wanted.values()),
            frame_every=next((keep.frame_every for keep in wanted.values() if keep.frame_every), None),
        )
        yield from _run_bucket(setups, wanted, batch, stop)


def compile_kernels(setups: Iterable[Setup]) -> None:
    """Make sure that every kernel these walks need is ready, before threads or processes ask for it at once."""
    ready: set[tuple[Features, int]] = set()
    for setup in setups:
        batch = Batch(1, setup.scene.links, setup.options)
        bodies = [("floor", "rest")] + [("sprocket", "steady")] * (setup.scene.start != "ellipse")
        for fixed_body, watch in bodies:
            features = batch.features(fixed_body=fixed_body, watch=watch)
            if (features, setup.scene.links) not in ready:
                batch.compile(features, [setup.scene.links])
                ready.add((features, setup.scene.links))


def _run_bucket(
    setups: Sequence[Setup], wanted: Mapping[int, Keep], batch: Batch, stop: threading.Event | None
) -> Iterator[tuple[int, Course]]:
    """Run walks, by place, that share options and the width of their arrays."""
    tries = TRIES["cuda" if batch.device.is_cuda else "cpu"]
    waiting = iter(wanted)
    running: dict[int, tuple[int, Course]] = {}
    for world, place in zip(range(len(batch.links)), waiting, strict=False):
        running[world] = place, Course(batch, world, setups[place], wanted[place])
    while running and not (stop is not None and stop.is_set()):
        together: dict[Features, list[int]] = defaultdict(list)
        for world, (_, course) in running.items():
            together[course.features].append(world)
        batch.launch_together(together, tries)
        for world, (place, course) in list(running.items()):
            course.drain()
            if batch.status(world) == Status.RUNNING or course.next_phase():
                continue
            yield place, course
            del running[world]
            following = next(waiting, None)
            if following is not None:
                running[world] = following, Course(batch, world, setups[following], wanted[following])
