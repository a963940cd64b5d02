"""Steps in single precision over a state in double precision: the algebra, flights, and tolerances that allow them."""

import functools
from typing import Any

import numpy as np
import pytest
import warp as wp

import warpchain
from tests.oracle_model import motion_equations
from tests.support.arrays import Array
from tests.support.kernels_under_test import DEVICE, model_of
from tests.support.presets import PAPER
from warpchain import Status, preset
from warpchain.chain.start_shapes import ellipse, lay_chain
from warpchain.inputs.options import Options
from warpchain.inputs.validation import InputError
from warpchain.kernels.layout import COSINE, OMEGA, SINE
from warpchain.kernels.physics.increments import increments
from warpchain.kernels.types import Chain

LINKS = 24
STEP, NODE = 4e-6, 0.5
ROUNDING = {wp.float32: 2.0**-24, wp.float64: 2.0**-53}


@functools.cache
def stage_kernel(real: Any) -> wp.Kernel:
    """Kernel that finds forces and torques of all joints of a chain in one stage, one after the other."""
    algebra = increments(real)

    @wp.func
    def displaced(
        rows: wp.array2d(dtype=wp.float64), sums: wp.array2d(dtype=real), stage: algebra.Stage, a: wp.float64, i: int
    ):
        arm_x = real(a * rows[COSINE, i])
        arm_y = real(a * rows[SINE, i])
        omega = real(rows[OMEGA, i])
        return algebra.displace(
            stage, arm_x, arm_y, omega, sums[i, 0], sums[i, 1], sums[i, 2], sums[i, 3], sums[i, 4], sums[i, 5]
        )

    @wp.kernel(module="unique", enable_backward=False)
    def stage_of_chain(
        rows: wp.array2d(dtype=wp.float64),
        chain: Chain,
        sums: wp.array2d(dtype=real),
        h: real,
        even: real,
        found: wp.array2d(dtype=wp.float64),
    ):
        n = chain.link_count
        stage = algebra.stage_at(chain, h, even)
        a = chain.half_length
        for i in range(n):
            j = (i + 1) % n
            joint = algebra.begin_joint(rows, a, i, j)
            own = displaced(rows, sums, stage, a, i)
            after = displaced(rows, sums, stage, a, j)
            start_x = algebra.start_force(stage, joint.x, joint.u)
            start_y = algebra.start_force(stage, joint.y, joint.v)
            found[i, 0] = wp.float64(algebra.force(stage, start_x, joint.u, after.left_x, own.right_x))
            found[i, 1] = wp.float64(algebra.force(stage, start_y, joint.v, after.left_y, own.right_y))
            found[i, 2] = wp.float64(joint.spin + (own.spin - after.spin))

    return stage_of_chain


def open_chain() -> tuple[Array, Array, Array]:
    """Places and velocities of a loop whose joints are open by some 1e-8 m, and sums over accelerations, (n, 6)."""
    random = np.random.default_rng(5)
    position, velocity = lay_chain(ellipse(1.5), LINKS, PAPER.link_length, 5.0, 0.3)
    position = position + 1e-8 * random.normal(size=position.shape) + [0.7, 0.4, 3.0]
    velocity = velocity + 0.1 * random.normal(size=velocity.shape)
    return position, velocity, random.normal(size=(LINKS, 6)) * np.tile([1e4, 1e4, 1e6], 2)


@pytest.mark.parametrize("real", [wp.float32, wp.float64], ids=["mixed", "double"])
def test_openings_in_a_stage_are_known_to_1e_15_metres(real: Any) -> None:
    """Forces k C + b Ċ of a displaced chain, and spins, are those of the NumPy model in extended precision.

    In single precision, too, the opening is known to 1e-15 m, though places are 1 m and the way in a stage is 1e-5 m.
    """
    position, velocity, sums = open_chain()
    rounded = sums.astype(np.float32).astype(float)
    h, even = float(np.float32(STEP)), float(np.float32(NODE * STEP))
    rows = np.zeros((8, LINKS))
    rows[:6] = np.hstack([position, velocity]).T
    rows[6:] = np.cos(rows[2]), np.sin(rows[2])
    chain = model_of([(LINKS, PAPER)]).chains.numpy()[0]
    found = wp.zeros((LINKS, 3), dtype=wp.float64, device=DEVICE)
    inputs = [wp.array(rows, device=DEVICE), Chain(), wp.array(rounded, dtype=real, device=DEVICE), real(h), real(even)]
    for name in chain.dtype.names:
        setattr(inputs[1], name, chain[name].item())
    wp.launch(stage_kernel(real), dim=1, inputs=[*inputs, found], device=DEVICE)

    exact = np.longdouble
    place, rate = position.astype(exact), velocity.astype(exact)
    gain, way = rounded[:, :3].astype(exact), rounded[:, 3:].astype(exact)
    there = place + exact(even) * rate + exact(h) ** 2 * way
    speed = rate + exact(h) * gain
    opening, opening_rate = (
        motion_equations.joint_opening(there, PAPER),
        motion_equations.joint_opening_rate(there, speed, PAPER),
    )
    force = PAPER.joint_stiffness * opening + PAPER.joint_damping * opening_rate
    spin = speed[:, 2] - np.roll(speed[:, 2], -1)
    assert np.abs(opening).max() > 1e-9
    # angles of 3 rad and more are rounded by 4e-16 in the kernel's cosines, arms by that times 5 mm
    error = np.abs(found.numpy()[:, :2] - force).max() / PAPER.joint_stiffness
    assert error < 1e-15 + 8 * ROUNDING[real] * np.abs(force).max() / PAPER.joint_stiffness
    assert np.abs(found.numpy()[:, 2] - spin).max() < 8 * ROUNDING[real] * np.abs(speed[:, 2]).max()


DURATION = 5e-4


@functools.cache
def exact_flight() -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """A loop in flight: start, and end by SciPy's DOP853 at 1e-12."""
    start = lay_chain(ellipse(1.5), 12, PAPER.link_length, 2.0, 0.1)
    start[0][:, 1] += 0.05
    return start, motion_equations.solve_flight(*start, DURATION, PAPER)


@pytest.mark.parametrize(
    ("method", "precision", "tolerance", "within"),
    [("os32", "mixed", 1e-6, 1e-6), ("dp5", "double", 1e-6, 1e-6), ("dp5", "double", 1e-10, 2e-10)],
)
def test_flight_agrees_with_scipy_to_its_tolerance(
    method: str, precision: str, tolerance: float, within: float
) -> None:
    """Places after a flight with friction and damping: to 1e-6 with steps of either precision, to 2e-10 in double."""
    start, (position, _) = exact_flight()
    flight = warpchain.simulate(
        preset("paper"), *start, DURATION, times=[DURATION], method=method, tolerance=tolerance, precision=precision
    )
    assert flight.status == Status.FINISHED
    assert np.abs(flight.position[-1] - position).max() < within * np.abs(position).max()


def test_momentum_stays_to_the_last_bits_in_mixed_precision() -> None:
    """The impulse of a joint is the same number on both of its links."""
    start, _ = exact_flight()
    flight = warpchain.simulate("paper", *start, DURATION, gravity=False, method="os32", tolerance=1e-5)
    momentum = np.array([motion_equations.linear_momentum(v, PAPER) for v in flight.velocity])
    scale = motion_equations.link_masses(12, PAPER) @ np.linalg.norm(start[1][:, :2], axis=1)
    assert np.abs(momentum - momentum[0]).max() < 1e-14 * scale


@pytest.mark.parametrize(
    ("options", "precision"),
    [
        ({}, "mixed"),
        ({"method": "explicit"}, "mixed"),
        ({"method": "hybrid"}, "mixed"),
        ({"method": "reference"}, "double"),
        ({"method": "dp5"}, "double"),
        ({"method": "dp5", "tolerance": 1e-5}, "mixed"),
        ({"tolerance": 1e-6}, "double"),
        ({"soft_tolerance": 1e-7}, "double"),
        ({"precision": "double"}, "double"),
        ({"method": "dp5", "tolerance": 1e-6, "precision": "mixed"}, "mixed"),
    ],
)
def test_the_default_precision_follows_the_tolerance(options: dict[str, Any], precision: str) -> None:
    """Steps are in mixed precision if all tolerances on springs are at least 1e-5, unless something else is asked."""
    assert Options(**options).precision == precision


def test_mixed_precision_is_refused_where_it_does_not_follow_the_tolerance() -> None:
    """One line says what to give instead."""
    line = r"^options\.precision: mixed cannot meet a tolerance of 1e-08; use double, or .* at least 1e-06$"
    with pytest.raises(InputError, match=line):
        warpchain.walk(method="dp5", tolerance=1e-8, precision="mixed")
