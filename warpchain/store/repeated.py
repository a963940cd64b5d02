"""Any walk of a sweep, run again with series and frames."""

import math
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from warpchain.inputs.validation import InputError, InputWarning, plain, shown
from warpchain.walks.rows import MISSING
from warpchain.walks.walk_result import WalkResult

if TYPE_CHECKING:
    from warpchain.store.block_result import BlockResult

Place = tuple[int, ...]


def place_of_index(blocks: "Sequence[BlockResult]", index: object) -> "tuple[BlockResult, Place]":
    """Block, and place along its axes and samples, of the walk with a number.

    Raises:
        InputError: there is none, or there are several.
    """
    number = plain(index, "index")
    if isinstance(number, bool) or not isinstance(number, int):
        raise InputError(f"index: {shown(number)} is not the number of a walk; give a whole number")
    found = [(block, place) for block in blocks for place in np.argwhere(block.columns["index"] == number).tolist()]
    if not found:
        largest = max(int(block.columns["index"].max()) for block in blocks)
        raise InputError(f"index: the sweep has no walk {number}; give one of its column index, at most {largest}")
    if len(found) > 1:
        samples = ", ".join(str(place[-1]) for _, place in found)
        raise InputError(
            f"index: {len(found)} merged sweeps have a walk {number}; give the values of its axes, and sample={samples}"
        )
    (block, place), *_ = found
    return block, tuple(place)


def repeat(block: "BlockResult", place: Place, **recording: Any) -> WalkResult:
    """Run the walk at a place of a block; see `BlockResult.walk`."""
    from warpchain.walks.one_walk import run_walk

    walk = run_walk(block.setup_at(place), seed=block.sweep_at(place).seed, **recording)
    row = {name: block.columns[name][place].item() for name in ("index", "status", "dx")}
    is_same = row["status"] == walk.status and (row["dx"] == walk.dx or (math.isnan(row["dx"]) and math.isnan(walk.dx)))
    if row["status"] != MISSING and not is_same:
        warnings.warn(
            f"walk {row['index']}: Δx is {walk.dx:g} m, and {row['dx']:g} m in the sweep; it is repeated to the bit by "
            "the version that ran it, on the same kind of processor",
            InputWarning,
            stacklevel=3,
        )
    return walk
