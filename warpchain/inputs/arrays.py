"""Types of arrays in annotations, and the check of arrays that users pass."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.validation import MASKED, InputError, is_masked

Array = NDArray[np.float64]
AnyArray = NDArray[Any]


def checked_array(given: object, path: str, *shape: int | str) -> Array:
    """Finite real numbers of any kind as a float64 array of a shape, letters for any size; else an `InputError`."""
    wanted = f"({', '.join(map(str, shape))}{',' * (len(shape) == 1)})"
    if is_masked(given):  # NumPy would take what lies under the mask
        raise InputError(f"{path}: {MASKED}")
    try:
        if np.array(given).dtype.kind in "cSU":  # complex numbers and text would be converted without a word
            raise TypeError
        array = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{path}: expected an array of numbers; use one of shape {wanted}") from None
    sizes = zip(array.shape, shape, strict=False)
    if array.ndim != len(shape) or any(size != each for size, each in sizes if isinstance(each, int)):
        raise InputError(f"{path}: expected shape {wanted}, got {array.shape}; reshape it")
    if not np.isfinite(array).all():
        raise InputError(f"{path}: expected finite numbers, got NaN or infinity; correct or remove them")
    return array
