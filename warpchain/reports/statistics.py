"""Tolerances compared, and the sensitivity of the distance to what is drawn.

Only walks that came to rest are used; the number of the others is given with every result.
"""

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.distributions import random_generator
from warpchain.inputs.validation import short
from warpchain.pictures.labels import cell_text, cell_values
from warpchain.pictures.style import NothingToShow
from warpchain.status import Status
from warpchain.store.block_result import BlockResult
from warpchain.store.sweep_result import SweepResult
from warpchain.sweeps.designs import saltelli_outputs, sobol_indices, walks_per_sample
from warpchain.walks.rows import drawn_column

Array = NDArray[np.float64]

CONFIDENCE: Final = 0.95
"""Confidence level of bootstrap intervals."""

_RESAMPLES: Final = 1000


class PairedCell(NamedTuple):
    """A cell at two tolerances.

    `distances` are Δx [m] of the same walks at the loose and at the tight one, shape (2, pairs); `lost` is the number
    of pairs left out, because one of the two walks failed or has not been run yet.
    """

    cell: str
    distances: Array
    lost: int

    @property
    def differences(self) -> Array:
        """Relative differences of the walks, (loose − tight) / tight, shape (pairs,)."""
        relative: Array = self.distances[0] / self.distances[1] - 1
        return relative

    @property
    def difference(self) -> float:
        """Relative difference of the means, (loose − tight) / tight."""
        loose, tight = self.distances.mean(axis=1)
        return float(loose / tight - 1)

    @property
    def standard_error(self) -> float:
        """Standard error of `difference`, from the scatter of the pairs; NaN with one pair."""
        loose, tight = self.distances
        if len(loose) < 2:
            return float("nan")
        return float((loose - tight).std(ddof=1) / len(loose) ** 0.5 / tight.mean())


class ToleranceAgreement(NamedTuple):
    """The distances of the same walks at the greatest and the least tolerance of a sweep, in cells that have pairs."""

    loose: float
    tight: float
    cells: tuple[PairedCell, ...]
    lost: int

    @property
    def differences(self) -> Array:
        """Differences of all walks, see `PairedCell`, shape (pairs,)."""
        return np.concatenate([cell.differences for cell in self.cells])

    def __str__(self) -> str:
        """The numbers in one or two sentences."""
        worst, sizes = max(self.cells, key=lambda cell: abs(cell.difference)), np.abs(self.differences)
        text = (
            f"The same {len(sizes)} walks at tolerances {short(self.loose)} and {short(self.tight)}: "
            f"distances of single walks differ by at most {sizes.max():.2%} (median {np.median(sizes):.2%}), means of "
            f"a cell by at most {abs(worst.difference):.2%} ({worst.cell}, {worst.distances.shape[1]} walks, standard "
            f"error {worst.standard_error:.2%})."
        )
        return text + (f" {self.lost} more pairs are not complete." if self.lost else "")


class Sensitivity(NamedTuple):
    """Sobol' indices of the distance in one cell, for d drawn quantities, the greatest total index first.

    The share of the variance that a quantity causes by itself, shape (d,), and together with others, each with its
    bootstrap interval, shape (d, 2). There are so many samples, of d + 2 walks each; `lost` are those left out, because
    one of their walks failed or has not been run yet.
    """

    cell: str
    names: tuple[str, ...]
    first_order: Array
    total_order: Array
    first_order_interval: Array
    total_order_interval: Array
    samples: int
    lost: int


def tolerance_agreement(result: SweepResult) -> ToleranceAgreement:
    """Compare the loosest with the tightest tolerance of a sweep, walk by walk and cell by cell.

    Raises:
        NothingToShow: no block has several tolerances with the same samples, blocks have different ones, or no pair
            of walks has come to rest yet.
    """
    blocks = [block for block in result.blocks.values() if len(block.axes.get("tolerance", ())) > 1]
    if not blocks:
        raise NothingToShow("no block has several tolerances; give tolerance in its grid")
    ends = {(float(max(block.axes["tolerance"])), float(min(block.axes["tolerance"]))) for block in blocks}
    if len(ends) > 1:
        raise NothingToShow("the blocks have different tolerances; give the same to all")
    cells = [cell for block in blocks for cell in _paired_cells(block, several=len(blocks) > 1)]
    kept = tuple(cell for cell in cells if cell.distances.size)
    if not kept:
        raise NothingToShow("no pair of walks has come to rest yet; let the sweep go on")
    return ToleranceAgreement(*ends.pop(), kept, sum(cell.lost for cell in cells))


def _paired_cells(block: BlockResult, *, several: bool) -> Iterator[PairedCell]:
    """The cells of a block with tolerances as an axis; `several`: whether there is another such block.

    Raises:
        NothingToShow: the samples of the two tolerances are not the same.
    """
    axis, values = list(block.axes).index("tolerance"), block.axes["tolerance"]

    def at_ends(name: str) -> Array:
        return np.stack([block.columns[name].take(end(values), axis) for end in (np.argmax, np.argmin)])

    rested = np.all(at_ends("status") == Status.AT_REST, axis=0)
    for name in block.drawn:
        if not np.array_equal(*at_ends(drawn_column(name))[:, rested]):
            raise NothingToShow(f"the samples of block {block.name} differ; give same_samples_along: [tolerance]")
    distances = at_ends("dx")
    for place in np.ndindex(*rested.shape[:-1]):
        kept = rested[place]
        cell = cell_values(block.axes, (*place[:axis], 0, *place[axis:]))
        del cell["tolerance"]
        text = _named(block, cell_text(cell), several)
        yield PairedCell(text, distances[(slice(None), *place)][:, kept], int((~kept).sum()))


def sensitivities(result: SweepResult) -> tuple[Sensitivity, ...]:
    """Sobol' indices of the distance in each cell that was sampled by ``saltelli``.

    The intervals are percentiles of 1000 bootstrap resamples of the samples, from a fixed stream of random numbers.

    Raises:
        NothingToShow: no block is sampled by ``saltelli``, or none has a cell with two complete samples yet.
    """
    named = [given["name"] for given in result.sweep["blocks"] if given["sampler"] == "saltelli"]
    if not named:
        raise NothingToShow("no block is sampled for Sobol indices; give sampler: saltelli")
    found = tuple(cell for name in named for cell in _sensitivities(result.blocks[name], several=len(named) > 1))
    if not found:
        raise NothingToShow("no cell has two complete samples for Sobol indices yet; let the sweep go on")
    return found


def _sensitivities(block: BlockResult, *, several: bool) -> Iterator[Sensitivity]:
    """The cells of a block sampled by ``saltelli`` that have two complete samples of different distances."""
    per_sample = walks_per_sample("saltelli", len(block.drawn))
    for place in np.ndindex(*block.shape[:-1]):
        rested = block.columns["status"][place] == Status.AT_REST
        outputs = saltelli_outputs(np.where(rested, block.columns["dx"][place], np.nan), len(block.drawn))
        samples = outputs["f_A"].shape[1]
        first, total = sobol_indices(outputs)
        if samples < 2 or not np.isfinite(total).all():
            continue
        rng = random_generator(0)
        draws = (rng.integers(0, samples, samples) for _ in range(_RESAMPLES))
        resampled = [sobol_indices({name: values[..., draw] for name, values in outputs.items()}) for draw in draws]
        tails = 50 * (1 - CONFIDENCE), 50 * (1 + CONFIDENCE)
        # The indices are NaN for a resample without variance, which repeats a single sample.
        intervals = np.nanpercentile(resampled, tails, axis=0).transpose(1, 2, 0)
        order = np.argsort(-total, kind="stable")
        yield Sensitivity(
            cell=_named(block, cell_text(cell_values(block.axes, place)), several),
            names=tuple(block.drawn[number] for number in order),
            first_order=first[order],
            total_order=total[order],
            first_order_interval=intervals[0, order],
            total_order_interval=intervals[1, order],
            samples=samples,
            lost=block.shape[-1] // per_sample - samples,
        )


def _named(block: BlockResult, cell: str, several: bool) -> str:
    """Description of a cell, with the name of its block if there are several blocks or the block has one cell."""
    return ": ".join([block.name] * (several or not cell) + [cell] * bool(cell))
