"""Another load on links than weight acts in every stage and stands in the energies."""

import functools

import numpy as np
import pytest
import warp as wp
from numpy.testing import assert_allclose

from tests.oracle_model import motion_equations
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.engine.batch import Batch
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.kernels import layout
from warpchain.kernels.physics.geometry import Link
from warpchain.kernels.physics.load import LOADS, Load
from warpchain.kernels.types import Chain
from warpchain.status import Status

LINKS, DURATION = 12, 5e-3
SOFT = preset("soft").with_values({"viscous_friction": 1e-5})
POINT, STIFFNESS, DRAG = (0.05, 0.12), 60.0, 0.4
AT_X, AT_Y, KAPPA, GAMMA = (wp.constant(wp.float64(value)) for value in (*POINT, STIFFNESS, DRAG))


@wp.func
def tied(chain: Chain, i: int, link: Link, inverse_mass: wp.float64, inverse_inertia: wp.float64):
    """The spring, the drag and the weight."""
    is_tied = wp.where(i == 1, KAPPA, wp.float64(0.0))
    drag = wp.where(i == 4, GAMMA, wp.float64(0.0))
    fx = is_tied * (AT_X - link.x - link.arm_x)
    fy = is_tied * (AT_Y - link.y - link.arm_y)
    torque = link.arm_x * fy - link.arm_y * fx - wp.float64(1e-4) * drag * link.omega
    ax = (fx - drag * link.u) * inverse_mass
    ay = (fy - drag * link.v) * inverse_mass
    return ax, ay - chain.gravity, torque * inverse_inertia


@wp.func
def stretched(_chain: Chain, i: int, link: Link):
    """Energy of the spring."""
    x = AT_X - link.x - link.arm_x
    y = AT_Y - link.y - link.arm_y
    return wp.where(i == 1, wp.float64(0.5) * KAPPA * (x * x + y * y), wp.float64(0.0))


def pull(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Accelerations by the spring on link 1 and the drag on link 4, (n, 3)."""
    force = np.zeros_like(position)
    arm = SOFT.link_length / 2 * motion_equations.direction(position[1, 2])
    force[1, :2] = STIFFNESS * (POINT - position[1, :2] - arm)
    force[1, 2] = motion_equations.cross(arm, force[1, :2])
    force[4] = -DRAG * velocity[4] * [1, 1, 1e-4]
    mass, inertia = motion_equations.link_masses(LINKS, SOFT), motion_equations.link_inertias(LINKS, SOFT)
    return force / np.column_stack([mass, mass, inertia])


def at_start() -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity (n, 3) of a loop in flight."""
    return lay_chain(ellipse(1.5), LINKS, SOFT.link_length, 2.0, 0.1)


@functools.cache
def exact_flight() -> np.ndarray:
    """Position and velocity (2, n, 3) at the end, by SciPy's DOP853 at 1e-12."""

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        x, v = state.reshape(2, LINKS, 3)
        return np.concatenate([v, motion_equations.acceleration(x, v, SOFT) + pull(x, v)]).ravel()

    end = motion_equations.integrated(rates, np.stack(at_start()).ravel(), DURATION, 1e-12, 1e-12)
    return end.reshape(2, LINKS, 3)


@functools.cache
def free_flight() -> np.ndarray:
    """Position (n, 3) at the end of a flight that neither spring nor drag changes, to 1e-6."""
    return motion_equations.solve_flight(*at_start(), DURATION, SOFT, rtol=1e-6, atol=1e-6)[0]


@pytest.mark.parametrize(
    ("method", "device", "tolerance", "within"),
    [
        ("os32", "cpu", 1e-10, 2e-8),
        pytest.param("dp5", "cpu", 1e-10, 2e-8, marks=pytest.mark.thorough),
        pytest.param("dp5", "cpu", 1e-5, 1e-5, marks=pytest.mark.thorough),
        pytest.param("os32", "fibers", 1e-10, 2e-8, marks=pytest.mark.thorough),
        ("os32", "fibers", 1e-5, 1e-5),
        pytest.param("hybrid", "cpu", 1e-10, 2e-8, marks=pytest.mark.thorough),
    ],
)
def test_a_load_of_a_script_acts_in_every_stage(
    method: str, device: str, tolerance: float, within: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A chain tied to a point, one link of which is slowed, is where DOP853 at 1e-12 has it, and has that energy.

    At 1e-5 steps are in mixed precision; the load reads places and velocities in double precision all the same.
    """
    monkeypatch.setitem(LOADS, "tied", Load(tied, stretched))
    start = at_start()
    batch = Batch(1, LINKS, Options(method=method, device=device, tolerance=tolerance, self_contact=False))
    batch.worlds[0].set_chain(SOFT, LINKS)
    batch.worlds[0].load(*start, stop_time=DURATION, stop_status=Status.FINISHED)
    batch.run([0], batch.features(fixed_body="none", load="tied"))
    position, velocity = batch.worlds[0].position, batch.worlds[0].velocity
    energy = batch.state.last_sample.numpy()[0, layout.GRAVITATIONAL]
    places, speeds = exact_flight()
    assert_allclose(position, places, atol=within * np.abs(places).max())
    assert_allclose(velocity, speeds, atol=within * np.abs(speeds).max())
    arm = SOFT.link_length / 2 * motion_equations.direction(position[1, 2])
    stretch = POINT - position[1, :2] - arm
    expected = motion_equations.gravitational_energy(position, SOFT) + STIFFNESS / 2 * (stretch @ stretch)
    assert energy == pytest.approx(expected, rel=1e-13)
    assert np.abs(places - free_flight()).max() > 1e-4
