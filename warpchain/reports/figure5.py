"""The paper's Figure 5 for a sweep: height and speed of the centre of mass, of walks whose series were kept."""

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure

from warpchain.pictures.walk_figures import LINE_COLORS, figure5
from warpchain.reports.statistics import NothingToShow, cell_text

if TYPE_CHECKING:
    from warpchain.store.sweep_result import SweepResult
    from warpchain.store.walk_motion import WalkMotion

MOST_CELLS: Final = len(LINE_COLORS) - 1
"""Most cells shown: one colour each."""
MOST_SAMPLES: Final = 3
"""Most walks shown of each."""


def sweep_figure5(result: "SweepResult") -> tuple[Figure, str]:
    """Figure 5 with a colour for each cell, and what stands below it.

    Of many cells those are shown that are spread evenly over all, in the order of their walks; of each its first
    samples.

    Raises:
        NothingToShow: there is no series of any walk that was released.
    """
    cells = [
        (block, place, np.flatnonzero(block.kept[place]))
        for block in result.blocks.values()
        for place in np.ndindex(*block.shape[:-1])
        if block.kept[place].any()
    ]
    shown = (
        [cells[i] for i in np.unique(np.linspace(0, len(cells) - 1, MOST_CELLS).round().astype(int))] if cells else []
    )
    walks: list[WalkMotion] = []
    labels: list[str] = []
    for block, place, samples in shown:
        released = (walk for sample in samples if len((walk := block.walk_motion((*place, int(sample)))).time))
        found = [walk for walk, _ in zip(released, range(MOST_SAMPLES), strict=False)]
        at = {name: values[i] for (name, values), i in zip(block.axes.items(), place, strict=True)}
        name = ", ".join(filter(None, [block.name if len(result.blocks) > 1 else "", cell_text(at)]))
        walks += found
        labels += [name or result.name] * len(found)
    if not walks:
        raise NothingToShow("Figure 5 takes walks whose series were kept (record: {series: true})")
    text = "Height and speed of the centre of mass against time since the release, as in the paper's Figure 5: "
    text += f"{len(walks)} walks in {len(set(labels))} of {len(cells)} cells whose series were kept."
    return figure5(walks, labels=labels), text
