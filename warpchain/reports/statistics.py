"""Numbers about a sweep beyond the means of its cells: tolerances compared, and what the distance is sensitive to.

Only walks that came to rest count; what is left out for another end is said beside every number.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.distributions import random_generator
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import DIMENSIONLESS
from warpchain.status import Status
from warpchain.sweeps.designs import saltelli_outputs, sobol_indices, walks_per_sample
from warpchain.walks.rows import field_column

if TYPE_CHECKING:
    from warpchain.store.sweep_result import BlockResult, SweepResult

Array = NDArray[np.float64]

CONFIDENCE: Final = 0.95
"""Of bootstrap intervals."""

_RESAMPLES: Final = 1000


class NothingToShow(ValueError):  # noqa: N818 - no error of the program: the sweep was made for something else
    """A sweep has not the blocks, or not yet the walks, that a figure or a number is about."""


@dataclass(frozen=True)
class PairedCell:
    """A cell at two tolerances.

    Attributes:
        cell: what the cell is, such as ``n = 60, ν = 15 Hz``.
        distances: Δx [m] of the same walks at the loose and at the tight tolerance, shape (2, pairs).
        lost: number of pairs left out, because one of the two failed or has not been run yet.
    """

    cell: str
    distances: Array
    lost: int

    @property
    def differences(self) -> Array:
        """Differences of the walks, loose less tight, relative to tight, shape (pairs,)."""
        relative: Array = self.distances[0] / self.distances[1] - 1
        return relative

    @property
    def means(self) -> Array:
        """Mean distance [m] at the loose and at the tight tolerance, shape (2,)."""
        means: Array = self.distances.mean(axis=1)
        return means

    @property
    def difference(self) -> float:
        """Difference of the means, loose less tight, relative to tight."""
        loose, tight = self.means
        return float(loose / tight - 1)

    @property
    def standard_error(self) -> float:
        """Standard error of `difference`, from the scatter of the pairs; NaN with one pair."""
        loose, tight = self.distances
        if len(loose) < 2:
            return float("nan")
        return float((loose - tight).std(ddof=1) / len(loose) ** 0.5 / tight.mean())


@dataclass(frozen=True)
class ToleranceAgreement:
    """How well the distances of the same walks agree at two tolerances.

    Attributes:
        loose: greatest tolerance of the sweep.
        tight: least one.
        cells: the cells that have pairs.
        lost: number of pairs left out, see `PairedCell`.
    """

    loose: float
    tight: float
    cells: tuple[PairedCell, ...]
    lost: int

    @property
    def differences(self) -> Array:
        """Differences of all walks, see `PairedCell`, shape (pairs,)."""
        return np.concatenate([cell.differences for cell in self.cells])

    @property
    def greatest(self) -> float:
        """Greatest difference of a walk, without its sign."""
        return float(np.abs(self.differences).max())

    @property
    def median(self) -> float:
        """Median difference of a walk, without its sign."""
        return float(np.median(np.abs(self.differences)))

    @property
    def worst_cell(self) -> PairedCell:
        """The cell whose means differ most."""
        return max(self.cells, key=lambda cell: abs(cell.difference))

    def __str__(self) -> str:
        """The numbers in a sentence or two."""
        worst, loose, tight = self.worst_cell, number_text(self.loose), number_text(self.tight)
        text = (
            f"The same {len(self.differences)} walks at tolerances {loose} and {tight}: distances of single walks "
            f"differ by at most {self.greatest:.2%} (median {self.median:.2%}), means of a cell by at most "
            f"{abs(worst.difference):.2%} ({worst.cell}, {worst.distances.shape[1]} walks, "
            f"standard error {worst.standard_error:.2%})."
        )
        return text + (f" {self.lost} more pairs are not complete." if self.lost else "")


@dataclass(frozen=True)
class Sensitivity:
    """Sobol' indices of the distance in one cell, for d drawn quantities, the greatest total index first.

    Attributes:
        cell: what the cell is.
        names: names of the quantities.
        first_order: share of the variance that a quantity causes by itself, shape (d,).
        total_order: share that it takes part in, shape (d,).
        first_order_interval: bootstrap interval of `first_order`, shape (d, 2).
        total_order_interval: that of `total_order`, shape (d, 2).
        samples: number of samples, of d + 2 walks each.
        lost: number of samples left out, because one of their walks failed or has not been run yet.
    """

    cell: str
    names: tuple[str, ...]
    first_order: Array
    total_order: Array
    first_order_interval: Array
    total_order_interval: Array
    samples: int
    lost: int


def tolerance_agreement(result: "SweepResult") -> ToleranceAgreement:
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


def _paired_cells(block: "BlockResult", *, several: bool) -> Iterator[PairedCell]:
    """The cells of one of several blocks, or of the only one, that has tolerances as an axis.

    Raises:
        NothingToShow: the samples of the two tolerances are not the same.
    """
    others = list(block.axes)
    axis = others.index("tolerance")
    others.remove("tolerance")
    values = block.axes["tolerance"]
    ends = int(np.argmax(values)), int(np.argmin(values))
    rested = np.all([block.columns["status"].take(end, axis) == Status.AT_REST for end in ends], axis=0)
    for name in block.drawn:
        loose, tight = (block.columns[name].take(end, axis)[rested] for end in ends)
        if not np.array_equal(loose, tight):
            raise NothingToShow(f"the samples of block {block.name} differ; give same_samples_along: [tolerance]")
    distances = np.stack([block.columns["dx"].take(end, axis) for end in ends])
    for place in np.ndindex(*rested.shape[:-1]):
        kept = rested[place]
        text = cell_text({name: block.axes[name][i] for name, i in zip(others, place, strict=True)})
        yield PairedCell(_named(block, text, several), distances[(slice(None), *place)][:, kept], int((~kept).sum()))


def sensitivities(result: "SweepResult") -> tuple[Sensitivity, ...]:
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


def _sensitivities(block: "BlockResult", *, several: bool) -> Iterator[Sensitivity]:
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
        # A resample of one sample again and again has no variance.
        intervals = np.nanpercentile(resampled, tails, axis=0).transpose(1, 2, 0)
        order = np.argsort(-total, kind="stable")
        text = cell_text({name: values[i] for (name, values), i in zip(block.axes.items(), place, strict=True)})
        yield Sensitivity(
            cell=_named(block, text, several),
            names=tuple(block.drawn[number] for number in order),
            first_order=first[order],
            total_order=total[order],
            first_order_interval=intervals[0, order],
            total_order_interval=intervals[1, order],
            samples=samples,
            lost=block.shape[-1] // per_sample - samples,
        )


def _named(block: "BlockResult", cell: str, several: bool) -> str:
    """What a cell is, with the name of its block if there are several or nothing else to say."""
    return ": ".join([block.name] * (several or not cell) + [cell] * bool(cell))


def cell_text(values: Mapping[str, Any]) -> str:
    """What a cell is, such as ``n = 60, ν = 15 Hz``.

    Args:
        values: name of an axis → value.
    """
    parts = []
    for name, value in values.items():
        unit = field_column(name).unit
        number = str(value) if isinstance(value, str | bool | np.bool_) else number_text(value)
        parts.append(f"{axis_symbol(name)} = {number}" + ("" if unit == DIMENSIONLESS else f" {unit}"))
    return ", ".join(parts)


def number_text(value: float) -> str:
    """A number as people write it: 1e-6 and 1e7, not 1e-06 and 1e+07."""
    return re.sub(r"e\+?(-?)0*(?=\d)", r"e\1", f"{value:g}")


def axis_symbol(name: str) -> str:
    """Symbol of a field of `Parameters`, n and ν, and of other fields the name."""
    if name in Parameters.model_fields:
        return Parameters.quantities()[name].symbol
    return {"links": "n", "frequency": "ν"}.get(name, name.replace("_", " "))
