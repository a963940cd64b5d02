"""Identical chains that are carried on by a given number of attempts at a time, and timed."""

import math
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from warpchain.bench.starts import State
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.status import Status
from warpchain.walks.moving_plane import UPRIGHT
from warpchain.walks.scheduler import BATCHES_PER_GPU

FAR: Final = 1e9
"""A stop time [s] that no measurement reaches."""
LONGEST_STRETCH: Final = 0.5
"""Simulated time [s] after which measured chains begin anew: on rigid joints they fly so far that they would land."""
SETTLING_ATTEMPTS: Final = 200
"""Attempts of a settling run, which passes the small steps after the start."""


@dataclass(frozen=True)
class Stretch:
    """What identical chains did while they were timed.

    Attributes:
        seconds: Wall time of one attempt of all chains [s].
        simulated: Simulated time of a chain [s].
        accepted: Accepted attempts of a chain.
        rejected: Rejected attempts of a chain.
        floor: Impulses of the floor on a chain.
    """

    seconds: float
    simulated: float
    accepted: float
    rejected: int
    floor: int

    @property
    def attempts(self) -> float:
        """Attempts of a chain."""
        return self.accepted + self.rejected


class ChainTimer:
    """Chains in the same state, in as many batches as a sweep uses, with floor and self-contacts.

    Attributes:
        links: n.
        chains: Number of chains.
        batches: Batches of these chains.
        features: What their kernel is compiled for.
        settled: The last settling run.
    """

    def __init__(
        self,
        parameters: Parameters,
        options: Options,
        start: State,
        chains: int = 1,
        *,
        watch: str = "none",
        launches: int = 1,
        settling_runs: int = 1,
        tilts: bool = False,
    ) -> None:
        """Put the chains into their start and carry them past the first steps.

        Args:
            parameters: Of every chain.
            options: How steps are computed.
            start: State that all chains begin in.
            chains: Number of chains.
            watch: ``"none"``, or ``"rest"`` as in a walk; a chain at rest is carried on all the same.
            launches: Launches of each batch that are queued together.
            settling_runs: Runs of :data:`SETTLING_ATTEMPTS` after each start.
            tilts: Whether the plane of the chains may move; it is upright and at rest.
        """
        self.links, self.chains = len(start[0]), chains
        self._start, self._launches, self._settling_runs, self._tilts = start, launches, settling_runs, tilts
        worlds = -(-chains // BATCHES_PER_GPU)
        self.batches = [Batch(min(worlds, chains - first), self.links, options) for first in range(0, chains, worlds)]
        for batch in self.batches:
            batch.control.rest_speed = 0.0  # a pile is at rest, and goes on
            batch.control.launch_time = math.inf  # only the number of attempts ends a launch: it is divided by
            for world in range(len(batch.links)):
                batch.set_chain(world, parameters, self.links)
        self.features = self.batches[0].features(fixed_body="floor", watch=watch, tilts=tilts)
        self.batches[0].compile(self.features, [self.links])
        self.settled = self._begin()

    def measure(self, attempts: int) -> Stretch:
        """Carry the chains on by so many attempts, or fewer that end within :data:`LONGEST_STRETCH`.

        Raises:
            RuntimeError: A chain stopped.
        """
        advance = self.settled.simulated / self.settled.attempts
        within = round(LONGEST_STRETCH / advance) - self._settling_runs * SETTLING_ATTEMPTS
        attempts = max(self._launches, min(attempts, within))
        if self.batches[0].time(0) + attempts * advance > LONGEST_STRETCH:
            self._begin()
        return self._run(attempts)

    def _begin(self) -> Stretch:
        """Put all chains back to their start and carry them past the first steps; the last settling run."""
        for batch in self.batches:
            for world in range(len(batch.links)):
                batch.load(world, *self._start, stop_time=FAR, stop_status=Status.FINISHED)
                if self._tilts:
                    batch.set_plane(world, UPRIGHT)
        return [self._run(SETTLING_ATTEMPTS) for _ in range(self._settling_runs)][-1]

    def _run(self, attempts: int) -> Stretch:
        """Carry all chains on by so many attempts, shared out among the launches and rounded up."""
        first = self.batches[0]
        time_before, before = first.time(0), first.counts(0)
        share = -(-attempts // self._launches)
        began = time.perf_counter()
        for _ in range(self._launches):
            for batch in self.batches:
                batch.start({self.features: range(len(batch.links))}, share)
        for batch in self.batches:
            batch.finish()
        seconds = time.perf_counter() - began
        for batch in self.batches:
            if (batch.statuses() != Status.RUNNING).any():
                raise RuntimeError(f"a measured chain stopped: {batch.status(0).sentence}")
        counts = {name: first.counts(0)[name] - before[name] for name in ("accepted", "rejected", "floor")}
        return Stretch(seconds / (share * self._launches), first.time(0) - time_before, **counts)


def together(scene: str, stretches: Sequence[Stretch]) -> Stretch:
    """Several stretches as one: the median of their wall times and the sums of the rest.

    Raises:
        RuntimeError: The scene is ``"flight"``, and a chain came down.
    """
    whole = Stretch(
        seconds=statistics.median(stretch.seconds for stretch in stretches),
        simulated=sum(stretch.simulated for stretch in stretches),
        accepted=sum(stretch.accepted for stretch in stretches),
        rejected=sum(stretch.rejected for stretch in stretches),
        floor=sum(stretch.floor for stretch in stretches),
    )
    if scene == "flight" and whole.floor:
        raise RuntimeError("a chain that was to fly came down")
    return whole
