"""How good the means are of cells that stop at their errors: coverage, bias and walks, on synthetic distances.

``python -m tests.support.stopping_rule`` prints the numbers of the page about sweeps. Distances are drawn here, with a
known mean of 1 and a known standard deviation.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import t as student

from tests.support.sweep_content import content
from warpchain.status import Status
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.rounds import Asked
from warpchain.walks.cell_statistics import CellStatistics

Draw = Callable[[np.random.Generator, tuple[int, int]], np.ndarray]


def gaussian(sd: float) -> Draw:
    """Distances that scatter alike to both sides."""
    return lambda rng, shape: rng.normal(1.0, sd, shape)


def skewed(sd: float) -> Draw:
    """Distances of which few are much longer than most: lognormal."""
    width = np.sqrt(np.log1p(sd**2))
    return lambda rng, shape: rng.lognormal(-(width**2) / 2, width, shape)


def stopped(
    draw: Draw, until: Any, *, seeds: int = 200, samples: int = 8, at_most: int = 4096, **keys: Any
) -> tuple[CellStatistics, Asked]:
    """What cells find that stop at an error, one for each seed; all walks come to rest."""
    grid = {"floor_friction": np.linspace(0.2, 0.3, seeds).tolist()}
    given = {"samples": samples, "at_most": at_most, "until": until, "grid": grid, **keys}
    (block,) = load_sweep(content(**given)).blocks
    dx = np.stack([draw(np.random.default_rng(seed), (1, block.samples))[0] for seed in range(seeds)])
    status = np.full(dx.shape, int(Status.AT_REST))
    energies = dict.fromkeys(("energy_kinetic_at_release", "energy_potential_at_release", "energy_residual"), dx)
    found = Asked.of(block, {"status": status, "dx": dx, **energies})
    status[~found.walks] = -1
    dx[~found.walks] = np.nan
    return CellStatistics.of({}, "m", dx, status, block.groups), found


def coverage(cells: CellStatistics, truth: float = 1.0) -> float:
    """Share of the cells whose 95 % interval has the truth in it."""
    factor = student.ppf(0.975, cells.independent - 1)
    return float((abs(cells.mean - truth) <= factor * cells.standard_error).mean())


def main() -> None:
    """Print the table."""
    print("scatter | until | sampler | walks | coverage | bias / error asked for | rms error / asked for | reached")
    for name, draw in (
        ("gaussian 5 %", gaussian(0.05)),
        ("gaussian 20 %", gaussian(0.2)),
        ("skewed 50 %", skewed(0.5)),
    ):
        for until in (0.02, 0.01, 0.005):
            for sampler in ("random", "sobol"):
                cells, found = stopped(draw, until, seeds=1000, sampler=sampler, at_most=16384)
                walks, bias = found.walks.sum(axis=1).mean(), (cells.mean - 1).mean() / until
                ratio = np.sqrt(((cells.mean - 1) ** 2).mean()) / until
                row = name, until, sampler, f"{walks:.0f}", f"{coverage(cells):.3f}", f"{bias:+.3f}", f"{ratio:.2f}"
                print(*row, f"{found.reached.mean():.3f}", sep=" | ")


if __name__ == "__main__":
    main()
