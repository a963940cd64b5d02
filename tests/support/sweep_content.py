"""What sweeps of the tests are made of."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from warpchain.inputs.parameters import Parameters
from warpchain.sweeps.plan import Sweep

TABLE_1 = [name for name, quantity in Parameters.quantities().items() if quantity.sigma > 0]
UNIFORM = {"uniform": [0.2, 0.4]}


def content(**changes: Any) -> dict[str, Any]:
    """A small sweep of one block with some keys replaced; None takes a key out."""
    whole: dict[str, Any] = {
        "version": 1,
        "name": "small",
        "seed": 7,
        "preset": "soft",
        "samples": 3,
        "grid": {"links": [60, 90], "frequency": [5, 10]},
    }
    whole |= changes
    return {key: value for key, value in whole.items() if value is not None}


def blocks(*given: Mapping[str, Any], **changes: Any) -> dict[str, Any]:
    """A sweep of several blocks, each with a name and whatever is given."""
    named = [{"name": f"b{number}", **block} for number, block in enumerate(given)]
    return content(grid=None, blocks=named, **changes)


def drawn(sweep: Sweep, walks: int) -> np.ndarray:
    """What the first walks drew, cell by cell, shape (walks, drawn quantities)."""
    return np.array([list(sweep.walk(index).draws.values()) for index in sweep.indices[:walks].tolist()])
