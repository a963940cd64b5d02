"""Cells that run in rounds until the errors of their means are reached: which walks that takes.

A cell has its samples in rounds, from the first to `at_most`, each of which doubles them. After a round the statistics
of all its samples decide whether the cell has another one. Only finished rounds decide, and the samples of a round are
always the same: so what a sweep runs does not depend on workers, on interruptions, nor on the order of its walks.

Every look at the data is a chance to stop at an error that is too small by accident. The measures against that are the
few looks, since samples double, and `warpchain.sweeps.until.LEAST_GROUPS`; what remains is on the page about sweeps.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.sweeps.block import Block
from warpchain.sweeps.until import LEAST_GROUPS
from warpchain.walks.cell_statistics import CellStatistics
from warpchain.walks.rows import MISSING, Rows, derived_columns

MOST_IN_VAIN: Final = 32
"""Walks after which a cell stops in which none has the quantity, such as one in which nothing comes to rest."""


@dataclass(frozen=True, eq=False)
class Asked:
    """Which walks of a block there are to be, (cells, walks of a cell), and which cells have their errors, (cells,).

    `over` says which cells have no more rounds, whatever comes; `forecast` is the number of walks that each will have
    if it goes on to scatter as it does.
    """

    walks: NDArray[np.bool_]
    reached: NDArray[np.bool_]
    over: NDArray[np.bool_]
    forecast: NDArray[np.int64]

    @classmethod
    def of(cls, block: Block, columns: Mapping[str, Any] | Rows) -> "Asked":
        """What follows from the walks of a block that are there; of columns it takes `status` and the quantities."""
        status = np.reshape(columns["status"], (-1, block.samples))
        derived = derived_columns(columns) if block.until else {}
        walks, forecast = np.zeros(status.shape, bool), np.full(len(status), block.rounds[0])
        reached, over, going = np.zeros((3, len(status)), bool)
        going[:] = True
        for size in block.rounds:
            walks[going, :size] = True
            going &= (status[:, :size] != MISSING).all(axis=1)
            at = np.flatnonzero(going)
            if not (block.until and len(at)):
                break
            enough, vain, more = np.ones(len(at), bool), np.zeros(len(at), bool), np.ones(len(at))
            for name, target in block.until.items():
                column = derived[name] if name in derived else columns[name]
                column = np.reshape(column, status.shape)[at, :size]
                cells = CellStatistics.of({}, "", column, status[at, :size], block.groups[:size])
                most = target.most(cells.mean)
                enough &= (cells.independent >= LEAST_GROUPS) & (cells.standard_error <= most)
                with np.errstate(divide="ignore", invalid="ignore"):
                    more = np.maximum(more, (cells.standard_error / most) ** 2)  # NaN stays
                vain |= (cells.count == 0) & (size >= MOST_IN_VAIN)
            reached[at], over[at] = enough, enough | vain
            going[at] = ~over[at]
            needed = np.where(going[at], np.maximum(size * np.where(np.isnan(more), math.inf, more), size + 1), size)
            forecast[at] = np.take(block.rounds, np.searchsorted(block.rounds[:-1], needed))
        return cls(walks, reached, over, forecast)
