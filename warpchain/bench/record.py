"""What every benchmark writes: the machine, units and meanings of columns, JSON without NaN."""

import math
import platform
from collections.abc import Mapping
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple, get_type_hints

from warpchain.engine.devices import versions


class Column(NamedTuple):
    """Unit and meaning of a column; annotates fields of dataclasses that are rows of a table.

    Attributes:
        unit: SI unit, ``"1"`` for pure numbers and texts.
        meaning: What the values are.
    """

    unit: str
    meaning: str


def columns_of(row: type) -> dict[str, Column]:
    """Columns of a table whose rows are of this dataclass."""
    hints = get_type_hints(row, include_extras=True)
    return {name: column for name, hint in hints.items() for column in getattr(hint, "__metadata__", ())}


def machine() -> dict[str, str]:
    """Processor, operating system and versions."""
    model = platform.processor() or platform.machine()
    listing = Path("/proc/cpuinfo")
    if listing.exists():
        names = [line for line in listing.read_text().splitlines() if line.startswith("model name")]
        model = names[0].split(":", 1)[1].strip() if names else model
    return {"processor": model, "system": platform.system()} | versions()


def plain(value: Any) -> Any:
    """The same value as JSON has it: dataclasses are objects, numbers that are not finite null."""
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
