"""A stiff loop that stands on the floor and tips sideways: against closed forms of rigid bodies.

Links of great inertia whose joints turn as in honey make an octagon that keeps its shape for the time of a test.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations, tilting_plane
from tests.oracle_model.circular_loop import circular_loop
from tests.oracle_model.tilting_plane import tilted_plane
from tests.support.blocks_under_test import run_recorded
from tests.support.tilting_under_test import end_of, tilting_batch
from warpchain.chain.keep import Keep
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.kernels import layout
from warpchain.status import Status

LINKS = 8
STIFF = preset("soft").with_values(
    {
        "inner_inertia": 1e-5,
        "outer_inertia": 1e-5,
        "viscous_friction": 1.0,
        "coulomb_friction": 0.0,
        "floor_friction": 1.0,
        "floor_restitution": 0.0,
        "tangential_restitution": 0.0,
    }
)


def standing(parameters, tilt):
    """The octagon at rest on one of its sides, tilted; with the height of its centre over the floor if upright."""
    position, velocity = circular_loop(LINKS, parameters, 0.0)
    position = np.column_stack([position[:, 1], -position[:, 0], position[:, 2] - np.pi / 2])
    position[:, 1] += parameters.circle_radius - position[:, 1].min()
    plane = tilted_plane(tilt)
    gap = tilting_plane.floor_gap(position, plane, parameters, half_width=parameters.half_width)
    mass = motion_equations.link_masses(LINKS, parameters)
    start = position, velocity, replace(plane, origin=np.array([0.0, -gap, 0.0]))
    return start, mass @ position[:, 1] / mass.sum()


def let_go(start, parameters, duration, longest_step=None):
    """Times [s] and tilts [rad] of samples until the end, the loop's shape still being what it was."""
    options = Options(method="dp5", tolerance=1e-6, rest_time=100.0)
    batch = tilting_batch(
        [start], [parameters], options, duration, longest_step=longest_step, keep=Keep(series_every=1)
    )
    pieces = run_recorded(batch, batch.features(fixed_body="floor", tilts=True))
    assert batch.worlds[0].status == Status.FINISHED
    position, _, plane = end_of(batch)
    assert_allclose(position[:, 2], start[0][:, 2], atol=0.02)
    assert abs(plane.turn[1]) < 0.02
    samples = np.concatenate([piece.samples for piece in pieces])
    return samples[:, layout.TIME], np.arcsin(samples[:, layout.PLANE_COLUMN + layout.UP + 2])


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("half_width", [2e-3, 4e-3])
def test_loop_falls_over_if_its_centre_is_beyond_its_rim(half_width, side):
    """Let go on one rim, it comes back from 0.95 of the tilt with its centre above the rim, and falls from 1.05."""
    parameters = STIFF.with_values({"half_width": half_width})
    _, height = standing(parameters, 0.0)
    limit = np.arctan(half_width / height)
    for share in (0.95, 1.05):
        start, _ = standing(parameters, side * share * limit)
        _, tilt = let_go(start, parameters, 0.15)
        steps = np.diff(side * tilt)
        assert np.all(steps < 0) if share < 1 else np.all(steps > 0)
        assert abs(tilt[-1] / tilt[0] - 1) > 0.04


def test_rocking_loses_what_a_rigid_block_loses():
    """As it passes from one rim to the other, (I − m h²)/(I + m h²) of the rate stays: Housner's rocking block.

    I: about e1 in the middle between the rims. The octagon gives way a little as the floor stops it, and loses more:
    0.066, 0.043 and 0.036 of the energy for joints that are 0.3, 3 and 10 N m s thick, where a rigid one loses 0.032.

    Source: G. W. Housner, "The behavior of inverted pendulum structures during earthquakes", Bulletin of the
    Seismological Society of America 53 (1963) 403-417.
    """
    parameters = STIFF.with_values({"viscous_friction": 10.0})
    start, height = standing(parameters, 0.1)
    half_width = parameters.half_width
    matrix = tilting_plane.plane_mass_matrix(start[0], parameters, half_width=half_width)
    inertia = matrix[1, 1] / matrix[0, 0]  # by the mass, about e1 through the plane's origin
    kept = ((inertia - half_width**2) / (inertia + half_width**2)) ** 2

    def lifted(tilt):
        return height * (np.cos(tilt) - 1) + half_width * abs(np.sin(tilt))

    _, tilt = let_go(start, parameters, 0.3, longest_step=2.5e-6)
    beyond = np.flatnonzero(tilt < 0)
    assert np.all(np.diff(tilt[: beyond[0]]) < 0)
    rebound = tilt.min()
    assert tilt[-1] > rebound  # it has come to a stop on the other rim
    assert lifted(rebound) / lifted(0.1) == pytest.approx(kept, abs=0.006)
