"""A chain with another force on its links, run where `warpchain.kernels.physics.load` says what it is.

    python -m tests.support.tied_chain METHOD DEVICE

Link 1 is tied to a point by a spring at its right end, and link 4 is slowed by drag. It prints positions and velocities
at the end and the energy of weight and spring there, as JSON.
"""

import importlib
import json
import sys

import numpy as np
import warp as wp
from numpy.typing import NDArray

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.kernels import layout
from warpchain.kernels.physics import load
from warpchain.kernels.physics.geometry import Link
from warpchain.kernels.types import Chain
from warpchain.status import Status

Array = NDArray[np.float64]

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


def start() -> tuple[Array, Array]:
    """Positions and velocities (n, 3)."""
    return lay_chain(ellipse(1.5), LINKS, SOFT.link_length, 2.0, 0.1)


def main(method: str, device: str) -> None:
    """Let the chain fly, with kernels that take the force as they find it."""
    load.link_load, load.link_energy, load.IS_UNIFORM = tied, stretched, False
    batch_module = importlib.import_module("warpchain.engine.batch")
    options = Options(method=method, device=device, tolerance=1e-10, self_contact=False)
    batch = batch_module.Batch(1, LINKS, options)
    batch.set_chain(0, SOFT, LINKS)
    batch.load(0, *start(), stop_time=DURATION, stop_status=Status.FINISHED)
    batch.run([0], batch.features(fixed_body="none"))
    energy = float(batch.state.last_sample.numpy()[0, layout.GRAVITATIONAL])
    print(json.dumps([batch.position(0).tolist(), batch.velocity(0).tolist(), energy]))


if __name__ == "__main__":
    main(*sys.argv[1:])
