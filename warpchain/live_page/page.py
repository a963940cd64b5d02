"""The HTML of the live page, and of the exported page that needs neither a server nor Python."""

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from warpchain.inputs.fields import FIELDS
from warpchain.inputs.parameters import preset
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import json_value
from warpchain.pictures.labels import unit_text
from warpchain.pictures.player import PLAYER

if TYPE_CHECKING:
    from warpchain.results.sweep_result import SweepResult

FIRST: Final = {"links": 60, "frequency": 15, "start": "spinning"}
"""The first set-up on the page."""
_EDGES: Final = [[[step / 5, 0.04 * (1 - step)], [step / 5, -0.04 * step]] for step in range(1, 9)]
STAIRS: Final = [[-1.0, 0.0], *([x, round(y, 2)] for edge in _EDGES for x, y in edge), [2.0, -0.32]]
"""A floor that falls in eight steps; beyond the last it is level."""
MOST_CELLS: Final = 2000
"""Most cells of a block of a sweep on the page."""
_HERE: Final = Path(__file__).parent


def live_page(sweep: "SweepResult | None" = None, walks: dict[str, Any] | None = None, data: str = "") -> str:
    """The page, with `{{nonce}}` for what permits its script; without a server it has `walks`, the axes, and `data`."""
    defaults = {name: field.default for name, field in Scene.model_fields.items()} | vars(preset("paper"))
    fields = {
        name: {"unit": unit_text(name), "text": FIELDS[name].description, "default": default}
        for name, default in defaults.items()
    }
    about = {"fields": fields, "first": FIRST, "stairs": STAIRS, "walks": walks}
    about |= {"sweep": None if sweep is None else sweep_points(sweep)}
    files = {"css": _HERE / "live.css", "js": _HERE / "live.js", "figures": _HERE / "live_figures.js", "player": PLAYER}
    parts = {name: path.read_text(encoding="utf-8") for name, path in files.items()}
    parts["about"] = json.dumps(json_value(about), allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")
    parts["data"] = data
    template = (_HERE / "live.html").read_text(encoding="utf-8")
    return re.sub(r"{{(\w+)}}", lambda found: parts.get(found[1], found[0]), template)


def sweep_points(sweep: "SweepResult") -> list[dict[str, Any]]:
    """Of each block the axes, and of each cell their values, mean Δx with its standard error, numbers of its walks."""
    blocks = []
    for name, found in sweep.cell_statistics().items():
        cells = [
            {
                "at": [values[k] for values, k in zip(found.axes.values(), place, strict=True)],
                "mean": found.mean[place],
                "error": found.standard_error[place],
                "walks": sweep.blocks[name].columns["index"][place].tolist()[:100],
            }
            for place in list(zip(*np.nonzero(found.count), strict=True))[:MOST_CELLS]
        ]
        if cells and found.axes:
            units = [*map(unit_text, found.axes)]
            blocks.append({"name": name, "axes": [*found.axes], "units": units, "cells": cells})
    return blocks
