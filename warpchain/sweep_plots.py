"""Figures of sweeps: the paper's Figure 6, maps over the grid, tolerances compared, sensitivity, how walks ended.

Figures show the walks that came to rest. Those that failed, or have not been run yet, are counted on the figure.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass
