"""Sweeps: many walks from one file, each planned by its index when it is asked for.

A sweep is a list of blocks, a block a grid of cells, a cell a number of samples. Walks are numbered through the cells
of all blocks, sample by sample: index = sample × number of cells + cell. So an index means the same walk when samples
are added; where blocks have different numbers of samples, some indices have no walk. Walk `index` depends on the sweep
and the index only: no table of walks exists, and a walk is the same whoever asks for it, in any order.

`warpchain.sweeps.sweep_file` defines the keys of a file, `warpchain.sweeps.designs` the designed samples.
"""

import bisect
import hashlib
import itertools
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import compress
from typing import Any, Final

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from warpchain.chain.keep import Keep
from warpchain.chain.setup import Setup
from warpchain.files import AnyPath
from warpchain.inputs.arrays import Array
from warpchain.inputs.distributions import DRAW_LIMIT, Distribution, draw, first_draws, random_generator
from warpchain.inputs.fields import SECTIONS
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS
from warpchain.inputs.scene import Scene
from warpchain.inputs.unit_slips import check_units
from warpchain.inputs.validation import InputError
from warpchain.sweeps.block import Block
from warpchain.sweeps.designs import SAMPLERS, design_points
from warpchain.sweeps.recording import Recording
from warpchain.sweeps.sweep_file import VERSION, read_sweep

Point = dict[str, float]
"""Drawn values by name."""
Cell = tuple[int, ...]
"""Place of a cell along every axis of its block."""

LEAST_SHARE: Final = 0.05
"""Least share of a distribution that must be physical; where less is, redrawing would take too long."""


@dataclass(frozen=True)
class PlannedWalk:
    """One walk of a sweep: its number, that of its block, its cell along every axis of that, its number in the cell.

    The setup is everything that says what it is, `laws` what is drawn for it; what was drawn stands in the order of
    drawing, too.
    """

    index: int
    block: int
    cell: Cell
    sample: int
    setup: Setup
    laws: Mapping[str, Distribution]
    draws: Point


@dataclass(frozen=True)
class Sweep:
    """A checked sweep; see `load_sweep`.

    Attributes:
        name: its name.
        seed: seed of all random numbers.
        same_samples_along: axes along which the same samples are used, sorted.
        blocks: its blocks.
        recording: what is kept of the motion of its walks.
    """

    name: str
    seed: int
    same_samples_along: tuple[str, ...]
    blocks: tuple[Block, ...]
    recording: Recording

    @cached_property
    def walk_count(self) -> int:
        """Number of walks."""
        return sum(block.walk_count for block in self.blocks)

    @property
    def has_rounds(self) -> bool:
        """Whether walks decide how many samples some cells have, see `warpchain.sweeps.rounds`."""
        return any(block.until for block in self.blocks)

    @property
    def indices(self) -> NDArray[np.int64]:
        """Numbers of all walks, block by block."""
        return np.concatenate([block.indices.ravel() for block in self.blocks])

    def walk(self, index: int) -> PlannedWalk:
        """The walk with a number, one of `indices`; an `IndexError` if there is none; errors as of `with_draws`."""
        (walk,) = self.with_draws([*self.undrawn([index])])
        return walk

    def with_draws(self, walks: Sequence[PlannedWalk]) -> list[PlannedWalk]:
        """Walks of `undrawn` with what is drawn for them.

        A sample may make no possible walk: with the drawn lengths, say, the chain does not reach round its sprocket.
        Then the whole sample is redrawn from its own random stream, which a designed sample does not use before. In
        `saltelli` the d + 2 walks of a sample are redrawn together. An `InputError` says that no draw was possible.
        """
        firsts: dict[int, Point] = {}
        for number, block in enumerate(self.blocks):
            own = {place: walk for place, walk in enumerate(walks) if walk.block == number}
            is_random = block.distributions and SAMPLERS[block.sampler].engine is None
            if len(own) > 1 and is_random and not block.independent:
                streams = {cell: self._stream(block, cell) for cell in {walk.cell for walk in own.values()}}
                rngs = (random_generator(self.seed, streams[walk.cell], walk.sample) for walk in own.values())
                points, is_within = first_draws([walk.laws for walk in own.values()], rngs)
                for place, point in compress(zip(own, points.tolist(), strict=True), is_within.tolist()):
                    firsts[place] = dict(zip(block.distributions, point, strict=True))
        return [self._with_draws(walk, firsts.get(place)) for place, walk in enumerate(walks)]

    def _with_draws(self, walk: PlannedWalk, first: Point | None) -> PlannedWalk:
        """A walk with its draws; `first` is the first that is random, if it is known and within bounds."""
        block, fixed = self.blocks[walk.block], walk.setup
        if not block.distributions:
            return walk
        if first is not None:
            with suppress(InputError):  # if this draw is impossible, the next ones are tried below
                setup = fixed.with_drawn(first)
                return PlannedWalk(walk.index, walk.block, walk.cell, walk.sample, setup, walk.laws, first)
        sampler = SAMPLERS[block.sampler]
        row, member = divmod(walk.sample, sampler.walks(len(block.distributions)))
        is_designed = sampler.engine is not None
        points, setups = self._first_possible(block, walk.cell, fixed, walk.laws, row, is_designed)
        return PlannedWalk(walk.index, walk.block, walk.cell, walk.sample, setups[member], walk.laws, points[member])

    def undrawn(self, indices: Iterable[int]) -> Iterator[PlannedWalk]:
        """Walks without their draws, which take most of the time; options and number of links never depend on them."""

        @lru_cache(2**12)
        def of_cell(place: int) -> tuple[int, Cell, Setup, Mapping[str, Distribution]]:
            """What all samples of a cell have in common, and their block."""
            number = bisect.bisect_right(self.blocks, place, key=lambda block: block.first_cell) - 1
            block = self.blocks[number]
            cell = tuple(map(int, np.unravel_index(place - block.first_cell, block.shape[:-1])))
            setup = block.fixed(cell)
            return number, cell, setup, setup.placed(block.distributions)

        stride = self.blocks[0].stride
        for index in map(int, indices):
            sample, place = divmod(index, stride)
            number, cell, setup, laws = of_cell(place)
            if not 0 <= sample < self.blocks[number].samples:
                raise IndexError(f"walk {index} of a sweep of {self.walk_count} walks")
            yield PlannedWalk(index, number, cell, sample, setup, laws, {})

    def keep(self, walk: PlannedWalk) -> Keep:
        """What is kept of the motion of a walk."""
        return self.recording.keep(walk.sample, walk.setup.options)

    def check(self) -> None:
        """Check every cell: its fixed values, its distributions, and that a random sample makes a possible walk."""
        most = max(block.samples for block in self.blocks)
        for name, choice in self.recording.choices.items():
            if choice.samples != "all" and (last := choice.samples[-1]) >= most:
                raise InputError(
                    f"sweep.record.{name}.samples: expected 0 to {most - 1}, got {last}; use samples of a block"
                )
        for block in self.blocks:
            first = before = None
            checked: dict[str, Distribution] = {}
            cells = list(np.ndindex(block.shape[:-1]))
            for cell, fixed in zip(cells, block.fixed_in(cells), strict=True):
                first = first or fixed.options
                if fixed.options is not before:
                    before = fixed.options
                    self._check_options(block, first, before)
                distributions = fixed.placed(block.distributions)
                for name, distribution in distributions.items():
                    if distribution != checked.get(name) and distribution.share() < LEAST_SHARE:
                        path, law = f"{block.path}.distributions.{name}", distribution.canonical()
                        raise InputError(f"{path}: less than {LEAST_SHARE:.0%} of {law} is physical; use uniform")
                    if distribution != checked.get(name) and not fixed.options.unusual_values:
                        check_units({name: distribution.quantile(0.5)}, f"{block.path}.distributions")
                checked = distributions
                self._first_possible(block, cell, fixed, distributions, 0, is_designed=False)

    def _check_options(self, block: Block, first: Options, options: Options) -> None:
        """Check the options of a cell beside those of the block's first cell; else an `InputError`."""
        for name in Options.model_fields:
            here, there = getattr(first, name), getattr(options, name)
            follows = name == "precision" and not {"tolerance", "soft_tolerance"}.isdisjoint(block.varied)
            if here != there and name not in block.varied and not follows:
                both = f"{here!r} in one cell, {there!r} in another"
                raise InputError(f"{block.path}.grid: {name} is {both}; use a separate block for each")
        for name, choice in self.recording.choices.items():
            choice.steps(options, f"sweep.record.{name}")

    def _first_possible(
        self, block: Block, cell: Cell, fixed: Setup, laws: Mapping[str, Distribution], row: int, is_designed: bool
    ) -> tuple[list[Point], list[Setup]]:
        """Points for the walks of sample `row` of a cell, the first that make possible walks only, and their setups.

        The designed ones are tried first, then random ones; if all are impossible, an `InputError` says so. What is
        independent of the other cells is always random, from a generator of the cell's own.
        """
        stream, rng, of_cell = self._generators(block, cell, row)
        own, problem = {name: laws[name] for name in block.independent}, ""
        makers: Iterable[Callable[[], Point]] = itertools.repeat(lambda: draw(laws, rng), DRAW_LIMIT)
        if is_designed:
            given = block.samples_given, len(laws), block.randomisations
            matrix = design_points(block.sampler, self.seed, stream, *given)
            fractions = iter(matrix[row].tolist())
            designed_point = lambda: {name: each.quantile(next(fractions)) for name, each in laws.items()}  # noqa: E731
            makers = itertools.chain([designed_point], makers)
        for point in makers:
            points = [point() | draw(own, of_cell)]
            if SAMPLERS[block.sampler].crosses:  # rows of A and B, and A with one value of B, of each quantity in turn
                first, second = points[0], point() | draw(own, of_cell)
                points = [first, second, *({**first, name: second[name]} for name in first)]
            try:
                return points, [fixed.with_drawn(point) for point in points]
            except InputError as error:
                problem = str(error)
        raise InputError(
            f"{block.path}.distributions: none of {DRAW_LIMIT} samples makes a possible walk; the last: {problem}"
        )

    def _generators(self, block: Block, cell: Cell, row: int) -> tuple[int, Generator, Generator]:
        """Stream of the samples of a cell; generators of a sample, and of what it draws apart from other cells."""
        stream = self._stream(block, cell)
        rng = random_generator(self.seed, stream, row)
        return stream, rng, random_generator(self.seed, stream, row, 1, *cell) if block.independent else rng

    def _stream(self, block: Block, cell: Cell) -> int:
        """Number of the stream of random numbers of a cell."""
        number = 0  # among those of the block
        for (name, values), place in zip(block.axes.items(), cell, strict=True):
            if name not in self.same_samples_along:
                number = number * len(values) + place
        return block.first_stream + number

    def expected(self, block: Block, cell: Cell, there: NDArray[np.bool_], drawn: Array) -> Array:
        """What random samples of a cell draw on average, in the order of drawing.

        Given are which samples are there, and what they drew, (samples, quantities). An `InputError` says that one was
        drawn again because the first draw made no possible walk: then the means of what is drawn are not known.
        """
        laws = block.fixed(cell).placed(block.distributions)
        for row in np.flatnonzero(there).tolist():
            _, rng, of_cell = self._generators(block, cell, row)
            first = draw(laws, rng) | draw({name: laws[name] for name in block.independent}, of_cell)
            if [*first.values()] != drawn[row].tolist():
                problem = f"sample {row} of a cell of block {block.name} was drawn twice, as it made no possible walk"
                raise InputError(f"control: {problem}; remove it, or use narrower distributions")
        return np.array([law.expected() for law in laws.values()])

    def canonical(self) -> dict[str, Any]:
        """The sweep as JSON-able content of a file, with every default and range written out."""
        return {
            "version": VERSION,
            "name": self.name,
            "seed": self.seed,
            "same_samples_along": list(self.same_samples_along),
            "record": self.recording.canonical(),
            "blocks": [block.canonical() for block in self.blocks],
        }

    def digest(self, samples: Sequence[int] | None = None) -> str:
        """SHA-256 of all that decides the numbers and their order, with other numbers of samples if these are given.

        That is the canonical form without names and without defaults, so that a field that a later version adds changes
        no digest; `NUMERICS_VERSION` tells of defaults and presets that changed.
        """
        content = {name: value for name, value in self.canonical().items() if name != "name"}
        for number, block in enumerate(content["blocks"]):
            del block["name"]
            if samples is not None:
                block["samples"] = samples[number]
                for key in ("until", "at_most"):  # which decide how many samples there are, too
                    block.pop(key, None)
            usual = {name: field.default for model in (Scene, Options) for name, field in model.model_fields.items()}
            usual |= vars(PRESETS[block["preset"]]) if "preset" in block else {}
            if str(block["options"].get("device")).startswith("cuda"):  # any GPU may go on with what another began
                block["options"] = block["options"] | {"device": "cuda"}
            for section in SECTIONS:
                block[section] = {n: value for n, value in block[section].items() if value != usual.get(n, ...)}
        text = json.dumps(content, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()


Source = AnyPath | Mapping[str, object] | Sweep
"""What says what a sweep is: a file, its content, or a sweep."""


def load_sweep(source: Source, **replaced: object) -> Sweep:
    """Load and check a sweep.

    Every cell is checked, see `Sweep.check`.

    Args:
        source: path of a YAML file, the content of one, or a sweep.
        replaced: `seed` and `samples` instead of those at the top of the file.

    Raises:
        InputError: the file cannot be read, or something in it is refused; one line that begins with the path of
            the offending value.
    """
    if isinstance(source, Sweep) and not replaced:
        return source
    sweep = Sweep(*read_sweep(source.canonical() if isinstance(source, Sweep) else source, **replaced))
    sweep.check()
    return sweep
