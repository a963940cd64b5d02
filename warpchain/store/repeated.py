"""Any walk of a sweep, run again with series and frames."""

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.setup import Setup
from warpchain.inputs.validation import InputError, InputWarning, plain, shown
from warpchain.walks.rows import MISSING
from warpchain.walks.walk_result import WalkResult


def place_of_index(numbers: Sequence[NDArray[np.int64]], index: object) -> tuple[int, tuple[int, ...]]:
    """Number of its block, and place along the axes and samples of it, of a walk.

    Args:
        numbers: column `index` of each block.
        index: number of the walk.

    Raises:
        InputError: there is none, or there are several.
    """
    number = plain(index, "index")
    if isinstance(number, bool) or not isinstance(number, int):
        raise InputError(f"index: {shown(number)} is not the number of a walk; give a whole number")
    found = [(block, place) for block, own in enumerate(numbers) for place in np.argwhere(own == number).tolist()]
    if not found:
        largest = max(int(own.max()) for own in numbers)
        raise InputError(f"index: the sweep has no walk {number}; give one of its column index, at most {largest}")
    if len(found) > 1:
        samples = ", ".join(str(place[-1]) for _, place in found)
        raise InputError(
            f"index: {len(found)} merged sweeps have a walk {number}; give the values of its axes, and sample={samples}"
        )
    block, place = found[0]
    return block, tuple(place)


def repeat(setup: Setup, seed: int, row: Mapping[str, Any], **recording: Any) -> WalkResult:
    """Run a walk of a sweep again, given its row; see `BlockResult.walk`."""
    from warpchain.walks.one_walk import run_walk

    walk = run_walk(setup, seed=seed, **recording)
    status, dx = row["status"], row["dx"]
    is_same = status == walk.status and (dx == walk.dx or (math.isnan(dx) and math.isnan(walk.dx)))
    if status != MISSING and not is_same:
        warnings.warn(
            f"walk {row['index']}: Δx is {walk.dx:g} m, and {dx:g} m in the sweep; it is repeated to the bit by the "
            "version that ran it, on the same kind of processor",
            InputWarning,
            stacklevel=4,
        )
    return walk
