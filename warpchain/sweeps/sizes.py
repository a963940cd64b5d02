"""How large a sweep may be: its sizes are checked as they are declared, before anything is made of them."""

import math
from collections.abc import Mapping
from typing import Any, Final

from warpchain.inputs.validation import InputError

AXIS_LIMIT: Final = 10_000
"""Most values of one axis."""

CELL_LIMIT: Final = 100_000
"""Most cells of a sweep, because each is checked when the sweep is loaded."""

WALK_LIMIT: Final = 2**24
"""Most walks of a sweep, 17 million: results are read as a whole, some 700 bytes a walk, and have to fit into memory.

A power of two, because numbers of designed samples are.
"""

DESIGN_LIMIT: Final = 2**24
"""Most numbers of the design of a cell, 128 MiB: it is made as a whole, and those of four cells are kept."""


def check_declared(top: Mapping[str, Any]) -> None:
    """Check the number of cells and walks that a sweep file declares, whatever its values are.

    What is not declared as it should be counts as one; it is refused when it is read.

    Args:
        top: content of the file.

    Raises:
        InputError: there are too many cells or walks.
    """
    blocks: dict[str, Any] = {"sweep": top}
    if isinstance(inner := top.get("blocks"), list):
        blocks = {f"sweep.blocks[{number}]": block for number, block in enumerate(inner)}
    cells = walks = 0
    for path, block in blocks.items():
        if not isinstance(block, Mapping):
            continue
        grid = block.get("grid")
        sizes = [_declared_size(values) for values in grid.values()] if isinstance(grid, Mapping) else []
        samples = block.get("samples", top.get("samples"))
        cells += math.prod(sizes)
        walks += math.prod(sizes) * (samples if isinstance(samples, int) and samples > 0 else 1)
        check_count(cells, walks, path)


def check_count(cells: int, walks: int, path: str) -> None:
    """Check the number of cells and walks up to the block at `path`.

    Raises:
        InputError: there are too many.
    """
    if cells > CELL_LIMIT:
        raise InputError(f"{path}.grid: {_many(cells)} cells, at most {CELL_LIMIT} are possible; give fewer values")
    if walks > WALK_LIMIT:
        raise InputError(f"{path}.samples: {_many(walks)} walks, at most {WALK_LIMIT} are possible; give fewer samples")


def check_design_size(samples: int, columns: int, path: str) -> None:
    """Check the size of the design of a cell.

    Args:
        samples: samples per cell, as the sweep states them.
        columns: numbers of one sample.
        path: of the block.

    Raises:
        InputError: the design is too large.
    """
    if samples * columns > DESIGN_LIMIT:
        raise InputError(
            f"{path}.samples: {samples} designed samples of {columns} numbers each are too many; "
            f"give at most {1 << (DESIGN_LIMIT // columns).bit_length() - 1}, or sampler: random"
        )


def _declared_size(values: object) -> int:
    """Number of values of an axis, as far as its list or range tells, and not more than an axis may have."""
    if isinstance(values, list):
        return min(max(len(values), 1), AXIS_LIMIT)
    if not isinstance(values, Mapping):
        return 1
    first, last, step, count = (
        number if isinstance(number := values.get(key), int | float) else math.nan
        for key in ("from", "to", "step", "count")
    )
    if count > 1:
        return int(min(count, AXIS_LIMIT))
    try:
        steps = (last - first) / step
    except (ArithmeticError, ValueError):
        return 1
    return int(min(steps + 1.5, AXIS_LIMIT)) if steps >= 1 else 1


def _many(count: int) -> str:
    """A number, as a power of ten if it is long."""
    return str(count) if count < 10**12 else f"{count:.0e}" if count < 10**300 else "endless"
