"""The paper's Figure 5 for a sweep: height and speed of the centre of mass of walks with recorded series."""

from itertools import islice
from typing import Final

import numpy as np

from warpchain.pictures.labels import cell_text, cell_values
from warpchain.pictures.style import LINE_COLORS, NothingToShow, Picture
from warpchain.pictures.walk_figures import figure5
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.walk_result import WalkResult

MOST_CELLS: Final = len(LINE_COLORS) - 1
"""Greatest number of cells that are shown, each in its own colour."""
MOST_SAMPLES: Final = 3
"""Greatest number of walks shown of each cell."""


def sweep_figure5(result: SweepResult) -> Picture:
    """Figure 5 with a colour for each cell.

    If there are many cells, those shown are spread evenly over all, in the order of their walks. Of each cell the first
    samples are shown.

    Raises:
        NothingToShow: there is no series of any walk that was released.
    """
    cells = [
        (block, place)
        for block in result.blocks.values()
        for place in np.ndindex(*block.shape[:-1])
        if block.kept[place].any()
    ]
    walks: list[WalkResult] = []
    labels: list[str] = []
    for number in dict.fromkeys(np.linspace(0, len(cells) - 1, MOST_CELLS).round().astype(int)) if cells else ():
        block, place = cells[number]
        motions = (block.walk_motion((*place, int(sample))) for sample in np.flatnonzero(block.kept[place]))
        found = list(islice((walk for walk in motions if len(walk.time)), MOST_SAMPLES))
        names = [block.name] * (len(result.blocks) > 1) + [cell_text(cell_values(block.axes, place))] * bool(place)
        walks += found
        labels += [", ".join(names) or result.name] * len(found)
    if not walks:
        raise NothingToShow("Figure 5 takes walks whose series were kept (record: {series: true})")
    caption = "Height and speed of the centre of mass against time since the release, as in the paper's Figure 5: "
    caption += f"{len(walks)} walks in {len(set(labels))} of {len(cells)} cells whose series were kept."
    return Picture("figure5", caption, figure5(walks, labels=labels))
