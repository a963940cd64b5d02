"""The page without a server: some 40 walks, ready, in one file that works from a folder and from any web server."""

import base64
import gzip
import itertools
import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

import numpy as np

from warpchain.engine.processors import processors
from warpchain.files import FileKind, checked_output, make_folder, write_whole
from warpchain.live_page.asked_walks import Walker
from warpchain.live_page.messages import recipes, summary
from warpchain.live_page.page import FIRST, STAIRS, live_page
from warpchain.pictures.player import player_data

AXES: Final[dict[str, list[Any]]] = {
    "links": [40, 60, 80, 120],
    "frequency": [10, 15, 20],
    "floor": ["flat", "slope", "stairs"],
}
"""What the page lets choose; `slope` falls by 6° the way the chain walks."""
_FLOORS: Final[dict[str, dict[str, Any]]] = {"flat": {}, "slope": {"slope": 6}, "stairs": {"floor": STAIRS}}
_INTERVAL: Final = 5e-3
"""Time [s] between two frames."""
_MARK: Final = b"<!-- warpchain live -->"
PAGES: Final = FileKind("page that warpchain live has written", lambda path: _MARK in path.read_bytes())
"""All that an export replaces."""


def export_page(folder: Path) -> Path:
    """Run the walks and write the page, whole or not at all; its path. An `OSError` if it cannot be written."""
    make_folder(folder)
    path = checked_output(folder / "index.html", PAGES)
    with ThreadPoolExecutor(processors()) as threads:
        places = [*itertools.product(*(range(len(values)) for values in AXES.values()))]
        names, texts = ["-".join(map(str, place)) for place in places], threads.map(_packed, places)
        data = json.dumps(dict(zip(names, texts, strict=True)), indent=0)
    element = f'{_MARK.decode()}\n<script type="application/json" id="walks">{data}</script>'
    page = live_page(walks=AXES, data=element).replace(' nonce="{{nonce}}"', "")
    write_whole(path, page, PAGES)
    return path


def _packed(place: tuple[int, ...]) -> str:
    """A walk at places along the axes, for the page: frames as changes from one to the next, compressed, in Base64."""
    links, frequency, floor = (values[k] for values, k in zip(AXES.values(), place, strict=True))
    asked = {**FIRST, "links": links, "frequency": frequency, **_FLOORS[floor]}
    record = {"frame_interval": _INTERVAL, "record_before": 0.0}
    walk = Walker().walk(asked, lambda progress: None, record)
    whole = player_data(walk)
    joints = np.array(whole["joints"])
    whole["joints"] = [whole["joints"][0], *np.diff(joints, axis=0).tolist()]
    end = summary(walk) | recipes(asked, walk, Path()) | {"wall_time": None}  # equal walks give equal bytes
    content = json.dumps({"end": end, "whole": whole}, separators=(",", ":"), allow_nan=False)
    return base64.b64encode(gzip.compress(content.encode(), 9, mtime=0)).decode()
