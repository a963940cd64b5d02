"""Flights of chains whose plane tilts: against SciPy on the model that isn't split, order, invariants."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations, tilting_plane
from tests.oracle_model.tilting_plane import axes
from tests.support.mild_parameters import MILD, SILENT
from tests.support.tilted_chains import tumbling_loop
from tests.support.tilting_under_test import end_of, fly, row_of
from warpchain.kernels import layout

WIDE = {"half_width": 0.02}
"""A half width [m] with which S is as large as the links' moments of inertia."""
TUMBLING = 4e-3
"""Duration of a flight [s], in which the plane turns by 5 to 9 degrees and joints ring."""


@pytest.fixture(scope="module")
def truth():
    """Parameters, start and end of a dissipative flight, by DOP853 at 1e-12 on the model that isn't split."""
    parameters = MILD.with_values(WIDE)
    start = tumbling_loop(20, parameters, 7)
    end = tilting_plane.solve_tilting_flight(*start, TUMBLING, parameters, **WIDE, rtol=1e-12, atol=1e-13)
    return parameters, start, end


def greatest_errors(end, expected):
    """Greatest errors of positions, of velocities and of the plane's twelve values, absolute (SI units)."""
    return [
        np.abs(one - other).max()
        for one, other in zip((*end[:2], row_of(end[2])), (*expected[:2], row_of(expected[2])), strict=True)
    ]


# --- against SciPy ---


# At tolerance 1e-9 alone dp5 steps by 13 µs, and what is left in plane and velocities is the splitting's: 3e-6 rad/s of
# 27 rad/s with 20 links. It falls as h²: 1e-6 at 8 µs, 2e-8 at 1 µs. os32 is of third order, and needs 1e-11 for
# velocities to 1e-8.
@pytest.mark.parametrize(
    ("method", "tolerance"), [("dp5", 1e-9), pytest.param("os32", 1e-11, marks=pytest.mark.thorough)]
)
def test_flight_equals_scipy(truth, method, tolerance):
    """In steps of 0.5 µs positions, velocities and the plane agree with DOP853 to 1e-8."""
    parameters, start, expected = truth
    flight = fly(start, parameters, TUMBLING, method=method, tolerance=tolerance, longest_step=5e-7)
    assert flight.worlds[0].counts["accepted"] >= TUMBLING / 5e-7 - 1
    assert np.abs(row_of(expected[2]) - row_of(start[2])).max() > 0.1
    assert max(greatest_errors(end_of(flight), expected)) < 1e-8


def test_error_of_the_splitting_falls_with_the_square_of_the_step(truth):
    """Half the step leaves a quarter of the error in positions, velocities and the plane."""
    parameters, start, expected = truth
    errors = []
    for step in (8e-6, 4e-6, 2e-6, 1e-6):
        flight = fly(start, parameters, TUMBLING, tolerance=0.1, longest_step=step)
        assert flight.worlds[0].counts["accepted"] == pytest.approx(TUMBLING / step, abs=2)
        errors.append(greatest_errors(end_of(flight), expected))
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert_allclose(slopes, 2.0, atol=0.05)


# --- invariants ---


@pytest.mark.parametrize("gravity", [0.0, MILD.gravity])
def test_flight_keeps_energy_and_momenta_in_the_room(gravity):
    """Energy, momentum and all of angular momentum are kept to 1e-9, but for what the weight adds to momenta."""
    parameters = SILENT.with_values({**WIDE, "gravity": gravity})
    start = tumbling_loop(20, parameters, 5)
    duration = 0.02
    flight = fly(start, parameters, duration, tolerance=1e-11, longest_step=2e-6)
    end = end_of(flight)
    assert np.abs(axes(end[2]) - axes(start[2])).max() > 0.1
    assert_allclose(axes(end[2]) @ axes(end[2]).T, np.eye(3), atol=1e-15)

    def energy(state):
        return tilting_plane.tilting_energy(*state, parameters, **WIDE)

    def turning(state):
        return tilting_plane.room_angular_momentum(*state, parameters, **WIDE)

    mass = motion_equations.link_masses(20, parameters)
    weight = np.array([0.0, -gravity * mass.sum(), 0.0])
    momentum = tilting_plane.room_momentum(*start, parameters)
    centre = mass @ tilting_plane.room_position(start[0], start[2]) / mass.sum()
    path = centre * duration + momentum / mass.sum() * duration**2 / 2  # its part along the weight has no moment
    assert energy(end) == pytest.approx(energy(start), rel=1e-9)
    expected = momentum + weight * duration
    assert_allclose(
        tilting_plane.room_momentum(*end, parameters), expected, atol=1e-9 * np.linalg.norm(momentum), rtol=0
    )
    expected = turning(start) + np.cross(path, weight)
    assert_allclose(turning(end), expected, atol=1e-9 * np.linalg.norm(expected), rtol=0)
    # what the kernel's own sample says
    sample = flight.worlds[0].state("last_sample")
    assert sample[[layout.KINETIC, layout.GRAVITATIONAL, layout.SPRING]].sum() == pytest.approx(energy(end), rel=1e-13)
    room = mass @ tilting_plane.room_position(end[0], end[2]) / mass.sum()
    assert_allclose(sample[[layout.CENTER_X, layout.CENTER_Y, layout.CENTER_Z]], room, atol=1e-15)
    speed = tilting_plane.room_momentum(*end, parameters) / mass.sum()
    assert_allclose(sample[[layout.CENTER_U, layout.CENTER_V, layout.CENTER_W]], speed, atol=1e-14)


# --- closed forms ---
