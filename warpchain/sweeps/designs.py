"""Quasi-random designs, whose points fill the space of the sampled quantities more evenly than random ones.

A design is a matrix of points in the unit cube, one row for each sample of a cell and one column for each drawn
quantity; a sample's values are the quantiles of the distributions at its row. `saltelli` rows have twice as many
columns and give several walks each, which Sobol indices are estimated from.

The points of one design depend on one another, so their spread does not tell the error of their mean. A cell therefore
has several designs of fewer points, randomised independently of one another, and the spread of the means of these
groups tells the error. The samples of a cell belong to the groups in turn, so that more samples move none.

Sources: I. M. Sobol', USSR Comput. Math. Math. Phys. 7 (1967) 86; A. B. Owen, J. Complexity 14 (1998) 466
(scrambling, independent replicates); M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239 (latin
hypercubes); A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259 (A, B and AB).
"""

import functools
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError


class Sampler(NamedTuple):
    """How the samples of a cell are chosen.

    Attributes:
        meaning: for the reference of sweep files.
        engine: class in `scipy.stats.qmc` that makes the points of a randomisation; None: samples are independent.
        grows: whether samples stay the same when more follow.
        is_balanced: whether samples and randomisations are powers of two.
        crosses: whether a row becomes two points, and the first with each value of the second in turn.
    """

    meaning: str
    engine: str | None = None
    grows: bool = True
    is_balanced: bool = False
    crosses: bool = False

    def walks(self, dimensions: int) -> int:
        """Walks that one sample of a cell takes, given the number of drawn quantities."""
        return dimensions + 2 if self.crosses else 1

    def columns(self, dimensions: int) -> int:
        """Length of a row, given the number of drawn quantities."""
        return 2 * dimensions if self.crosses else dimensions


_SALTELLI: Final = "points for Sobol indices: each sample of d sampled quantities takes d + 2 walks; "
SAMPLERS: Final[Mapping[str, Sampler]] = {
    "random": Sampler("independent samples"),
    "sobol": Sampler("scrambled Sobol' sequences; a power of two of samples", "Sobol", is_balanced=True),
    "latin_hypercube": Sampler("latin hypercubes", "LatinHypercube", grows=False),
    "saltelli": Sampler(f"{_SALTELLI}a power of two of samples", "Sobol", is_balanced=True, crosses=True),
}
"""All samplers; sweep files, checks, figures and the reference read these."""

RANDOMISATIONS: Final = 8
"""Independent randomisations of a design unless a sweep says otherwise: seven degrees of freedom for its error."""

DESIGN_LIMIT: Final = 2**24
"""Most numbers of the design of a cell, 128 MiB: it is made as a whole, and those of four cells are kept."""

_END: Final = 2.0**-53
"""Distance that designed points keep from the ends 0 and 1, where a Gaussian has no quantile."""


def independent_groups(sampler: str, walks: int, dimensions: int, randomisations: int) -> NDArray[np.int64]:
    """Number of the group of each walk of a cell; walks of different groups are independent of one another.

    Every random sample is a group of its own. Designed ones belong to the randomisations in turn, with all their walks.
    """
    own = SAMPLERS[sampler]
    samples = np.arange(walks) // own.walks(dimensions)
    return samples if own.engine is None else samples % randomisations


def check_design(
    sampler: str, samples: int, dimensions: int, randomisations: int, path: str, key: str = "samples"
) -> None:
    """Check that a sampler can make a number of samples of so many sampled quantities, in so many randomisations.

    An `InputError`, which begins with `path` and the `key` of the samples, says that these would be equal, too many, or
    no balanced sequence.
    """
    own = SAMPLERS[sampler]
    if dimensions == 0:
        if own.crosses:
            raise InputError(f"{path}.sampler: {sampler} needs sampled quantities; set distributions")
        if samples > 1:
            raise InputError(
                f"{path}.{key}: nothing is sampled, so all samples would be equal; use 1, or set distributions"
            )
        return
    if own.engine is None:
        return
    columns = own.columns(dimensions)
    if samples * columns > DESIGN_LIMIT:
        most = 1 << (DESIGN_LIMIT // columns).bit_length() - 1
        raise InputError(f"{path}.{key}: expected at most {most}, got {samples}; use fewer, or sampler: random")
    if own.is_balanced and randomisations & (randomisations - 1):
        problem = f"expected a power of 2 for {sampler}, got {randomisations}"
        raise InputError(f"{path}.randomisations: {problem}; use {1 << randomisations.bit_length() - 1}")
    if own.is_balanced and samples & (samples - 1):
        lower = 1 << (samples.bit_length() - 1)
        raise InputError(
            f"{path}.{key}: expected a power of 2 for {sampler}, got {samples}; use {lower} or {2 * lower}"
        )


@functools.lru_cache(maxsize=4)
def design_points(
    sampler: str, seed: int, cell: int, samples: int, dimensions: int, randomisations: int = RANDOMISATIONS
) -> Array:
    """Points inside (0, 1) of N samples of d quantities in a cell, given its stream: (N, d), for `saltelli` (N, 2d).

    Row i is of the randomisation i modulo their number. The points are read-only, the same for every caller; the last
    few cells are kept.
    """
    from scipy.stats import qmc  # takes longer to import than all else

    # A spawn key of one number names no sample, so a design shares its stream with none.
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(cell,)))
    columns, engine = SAMPLERS[sampler].columns(dimensions), getattr(qmc, str(SAMPLERS[sampler].engine))
    points: Array = np.empty((samples, columns))
    for group in range(min(randomisations, samples)):
        own = points[group::randomisations]
        # A scrambled sequence takes equally many random numbers for any number of points, so that groups can grow.
        own[:] = np.clip(engine(columns, scramble=True, seed=rng).random(len(own)), _END, 1 - _END)
    points.flags.writeable = False
    return points


def sobol_indices(samples: Array) -> tuple[Array, Array]:
    """First-order and total Sobol' indices, (d,) each, by estimators of Saltelli et al. (2010), table 2 (b) and (f).

    Given are finite results of the d + 2 walks of each `saltelli` sample, in their order, (N, d + 2); NaN where all are
    equal or there is none. The same numbers as `scipy.stats.sobol_indices`, which takes powers of two of samples only.
    """
    first, second, crossed = samples[:, 0], samples[:, 1], samples[:, 2:].T
    pooled = np.concatenate([first, second])
    variance = pooled.var() if len(pooled) else 0.0
    if not variance > 0:
        return np.full(len(crossed), np.nan), np.full(len(crossed), np.nan)
    # Without the mean the products lose fewer digits (Sobol' and Levitan, 1999).
    main = np.mean((second - pooled.mean()) * (crossed - first), axis=1) / variance
    total = 0.5 * np.mean((first - crossed) ** 2, axis=1) / variance
    return main, total
