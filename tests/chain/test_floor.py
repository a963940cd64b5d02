"""Floors: how far a chain is raised above them."""

import numpy as np
import pytest

from warpchain.chain.floor import Floor, slope_points

CIRCLES = 0.1 * np.array([[-1, 0], [0, -1], [1, 0], [0, -1], [1, 0], [0, 1]])
RADIUS = np.full(6, 0.004)


@pytest.mark.parametrize("width", [1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("clearance", [0.01, 1e3])
def test_a_chain_is_at_its_clearance_beside_steep_faces(width: float, clearance: float) -> None:
    """The clearance is met, although each step towards it is tiny there."""
    floor = Floor([[-1, 0], [0.05, 0], [0.05 + width, 1]], [[0.05, 0.27]] * 2)
    raised = floor.raised_by(CIRCLES, RADIUS, clearance)
    room = floor.distances(CIRCLES + np.array([0, raised])).min() - clearance - RADIUS[0]
    assert abs(room) < 1e-9 + 1e-15 * raised


@pytest.mark.parametrize("degrees", [-80.0, -3.0, 45.0, 80.0])
@pytest.mark.parametrize("clearance", [0.0, 0.01, 1e6])
def test_a_chain_is_at_its_clearance_from_a_slope(degrees: float, clearance: float) -> None:
    """By trigonometry; far up, too, where rounding is more than the error that else ends the search."""
    angle = np.radians(degrees)
    along = CIRCLES @ [np.sin(angle), np.cos(angle)]
    expected = (clearance + RADIUS[0] - along.min()) / np.cos(angle)
    assert Floor(slope_points(degrees), [[0.05, 0.27]]).raised_by(CIRCLES, RADIUS, clearance) == pytest.approx(expected)
