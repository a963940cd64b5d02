"""Designed samples: points that fill the space of the drawn quantities more evenly than random ones.

A design is a matrix of points in the unit cube, one row for each sample of a cell and one column for each drawn
quantity; a sample's values are the quantiles of the distributions at its row. `saltelli` rows have twice as many
columns and give several walks each, which Sobol indices are estimated from.

Sources: I. M. Sobol', USSR Comput. Math. Math. Phys. 7 (1967) 86; A. B. Owen, J. Complexity 14 (1998) 466
(scrambling); M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239 (latin hypercubes);
A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259 (A, B and AB).
"""

import functools
from typing import Final

import numpy as np

from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import InputError

SAMPLERS: Final = ("random", "sobol", "latin_hypercube", "saltelli")
"""Independent samples; a scrambled Sobol' sequence; a latin hypercube; a Sobol' sequence of twice the dimension, each
row of which becomes two points and their crossings."""

EXTENSIBLE: Final = ("random", "sobol", "saltelli")
"""Samplers whose samples stay the same when more follow; a latin hypercube of another size has other points."""

DESIGN_LIMIT: Final = 2**24
"""Most numbers of the design of a cell, 128 MiB: it is made as a whole, and those of four cells are kept."""

_END: Final = 2.0**-53
"""Distance that designed points keep from the ends 0 and 1, where a Gaussian has no quantile."""


def walks_per_sample(sampler: str, dimensions: int) -> int:
    """Walks that one sample of a cell takes: d + 2 for `saltelli` with d drawn quantities, else 1."""
    return dimensions + 2 if sampler == "saltelli" else 1


def check_design(sampler: str, samples: int, dimensions: int, path: str) -> None:
    """Check that a sampler can make a number of samples of so many drawn quantities.

    An `InputError`, which begins with `path`, says that samples would be equal, too many, or no balanced sequence.
    """
    if dimensions == 0:
        if sampler == "saltelli":
            raise InputError(f"{path}.sampler: saltelli has nothing to draw; give distributions")
        if samples > 1:
            raise InputError(f"{path}.samples: nothing is drawn, so all would be the same; give 1, or distributions")
        return
    if sampler == "random":
        return
    columns = dimensions * (2 if sampler == "saltelli" else 1)
    if samples * columns > DESIGN_LIMIT:
        most = 1 << (DESIGN_LIMIT // columns).bit_length() - 1
        raise InputError(f"{path}.samples: {samples} are too many; give at most {most}, or sampler: random")
    if sampler in ("sobol", "saltelli") and samples & (samples - 1):
        lower = 1 << (samples.bit_length() - 1)
        raise InputError(f"{path}.samples: {samples} is no power of 2, as {sampler} needs; give {lower} or {2 * lower}")


@functools.lru_cache(maxsize=4)
def design_points(sampler: str, seed: int, cell: int, samples: int, dimensions: int) -> Array:
    """Points inside (0, 1) of N samples of d quantities in a cell, given its stream: (N, d), for `saltelli` (N, 2d).

    They are read-only, the same for every caller; the last few cells are kept.
    """
    from scipy.stats import qmc  # takes longer to import than all else

    # A spawn key of one number names no sample, so a design shares its stream with none.
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(cell,)))
    if sampler == "latin_hypercube":
        engine = qmc.LatinHypercube(dimensions, seed=rng)
    else:
        engine = qmc.Sobol(dimensions * (2 if sampler == "saltelli" else 1), scramble=True, seed=rng)
    points: Array = np.clip(engine.random(samples), _END, 1 - _END)
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
