"""Multiplied loads on the sprocket: the loop is the same under them."""

import numpy as np

from tests.support.driven_loops import hold, released_loop
from warpchain import preset

SOFT = preset("soft")


def test_a_stationary_loop_stays_as_it_is_under_load() -> None:
    """Under loads that are 15 times as great, drag and all, it keeps height, width and curvature."""
    loop = released_loop(links=60, frequency=20.0, start="spinning")
    own, loaded = (hold(loop, SOFT, 0.5, load_factor=factor) for factor in (1.0, 15.0))
    height, width, curvature = own[[0, 1, 4]]
    change = np.abs(loaded - own) / [height, width, width, height, curvature]
    assert np.all(change < [0.002, 0.005, 0.003, 0.002, 0.01]), change
