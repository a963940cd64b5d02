"""Chains in awkward states, what their energy ledger leaves open, and the methods that must cope with them."""

from collections.abc import Mapping
from typing import Final

import numpy as np
import pytest

from tests.oracle_model import contact_equations, motion_equations
from tests.oracle_model.circular_loop import circular_loop
from tests.support.arrays import Array
from tests.support.presets import PAPER, SOFT
from warpchain.chain.start_shapes import ellipse, lay_chain, links_between
from warpchain.inputs.parameters import Parameters
from warpchain.kernels.methods.method import method_names
from warpchain.run.simulation import Trajectory

State = tuple[Array, Array]
"""Position (n, 3) and velocity (n, 3) of a chain."""

METHODS = method_names()
every_method = pytest.mark.parametrize("method", METHODS)
PRECISION = {method: "mixed" if method == "hybrid" else "double" for method in METHODS}
"""Precision in which tests try each method; another one needs a kernel of its own, which takes long to compile."""
every_precision = pytest.mark.parametrize(
    ("method", "precision"),
    [
        *PRECISION.items(),
        ("os32", "mixed"),
        *(pytest.param(*other, marks=pytest.mark.thorough) for other in (("dp5", "mixed"), ("hybrid", "double"))),
    ],
)

UNDISSIPATIVE: Final[Mapping[str, float]] = {
    "joint_stiffness": 1e5,
    **dict.fromkeys(["joint_damping", "viscous_friction", "coulomb_friction"], 0.0),
    **dict.fromkeys(["floor_restitution", "chain_restitution"], 1.0),
    **dict.fromkeys(["floor_friction", "chain_friction"], 0.0),
}
"""Nothing dissipates, neither joints nor collisions; springs soft enough to show the order of convergence."""

ELASTIC: Final = SOFT.with_values(UNDISSIPATIVE)


def set_down(position: Array, gap: float = 2e-4, parameters: Parameters = SOFT) -> Array:
    """The chain raised or lowered so that its lowest circle is this far above the floor [m]."""
    ends = np.concatenate(motion_equations.link_ends(position, parameters))
    lowered: Array = position - [0.0, ends[:, 1].min() - parameters.circle_radius - gap, 0.0]
    return lowered


def dropped(links: int = 8, speed: float = 2.0, fall: float = 1.0, gap: float = 2e-4, aspect: float = 1.2) -> State:
    """A circulating ellipse just above the floor, falling: it hits within the first millisecond."""
    position, velocity = lay_chain(ellipse(aspect), links, SOFT.link_length, speed, 0.1)
    return set_down(position, gap), velocity - [0.0, fall, 0.0]


def dropped_circle(links: int) -> State:
    """A circulating circle just above the floor, falling."""
    position, velocity = circular_loop(links, SOFT, -3.0)
    return set_down(position), velocity - [0.0, 1.0, 0.0]


def folded(links: int, height: float = 0.02) -> State:
    """A chain laid out on a line and folded back by 180° at both ends, its strands exactly on each other."""
    place = np.arange(links)
    along = np.minimum(place, links - place) * SOFT.link_length
    joints = np.column_stack([along, np.full(links, height)])
    return links_between(joints, np.zeros_like(joints))


def pulled_apart(links: int = 8) -> State:
    """A falling ellipse, 1 mm above the floor, whose joints are open by about 0.1 mm."""
    position, velocity = dropped(links, gap=1e-3)
    shift = np.random.default_rng(1).normal(size=(links, 2))
    position[:, :2] += 0.7e-4 * shift / np.linalg.norm(shift, axis=1)[:, None]
    return position, velocity


def overlapping() -> State:
    """A zigzag of 8 links: joints alternate between two places, so every second joint lies on every other."""
    links = 8
    joints = np.column_stack([np.arange(links) % 2 * SOFT.link_length, 0.02 + 1e-4 * np.arange(links)])
    joints[:, 0] += np.sqrt(SOFT.link_length**2 - 1e-8) - SOFT.link_length
    joints[::2, 0] = 0.0
    joints[-1, 1] = joints[0, 1] + 1e-4
    position, velocity = links_between(joints, np.zeros_like(joints))
    velocity[:, 1] += np.random.default_rng(2).normal(size=links) * 0.1
    return position, velocity


def turning_joints() -> State:
    """A circulating octagon whose neighbours turn against each other by 0.02 rad/s."""
    position, velocity = circular_loop(8, PAPER.with_values({"gravity": 0.0}), 1.0)
    position[:, 1] += 0.1
    velocity[:, 2] += 0.01 * np.array([1, -1] * 4)
    return position, velocity


def struck_loop(turned: float) -> State:
    """A circular loop of 40 links that turns clockwise at 60 rad/s, just after it hit the floor at 2 m/s.

    The impulses of the impact have changed the velocities of the lowest links and of no others: joints around them
    reverse many times while their springs ring.

    Args:
        turned: Angle by which the loop is turned [rad].
    """
    position, velocity = circular_loop(40, PAPER, -60.0 * PAPER.link_length / (2 * np.sin(np.pi / 40)))
    cosine, sine = np.cos(turned), np.sin(turned)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    for state in (position, velocity):
        state[:, :2] = state[:, :2] @ turn
    position[:, 2] += turned
    position, velocity = set_down(position, -1e-9, PAPER), velocity - [0.0, 2.0, 0.0]
    return position, contact_equations.resolve_contacts(position, velocity, PAPER, self_contact=False)[0]


def reversing_loop() -> State:
    """A circular loop of 40 links, 10 mm above the floor, that turns at ω_i = 60 (1 + 0.2 sin 2θ_i) rad/s.

    The centres move as those of the turning loop, so that ends of neighbours move apart at up to 0.15 m/s: springs
    ring, and joints reverse within the first microseconds.
    """
    position, velocity = circular_loop(40, PAPER, 60 * PAPER.link_length / (2 * np.sin(np.pi / 40)))
    velocity[:, 2] *= 1 + 0.2 * np.sin(2 * position[:, 2])
    return set_down(position, 0.01, PAPER), velocity


def energy_error(flight: Trajectory, parameters: Parameters, start: State) -> float:
    """What the ledger of a flight leaves open, relative to the energy of motion and springs at the start.

    A fall through 1 cm is added to that energy, so that a chain which starts at rest has a scale as well.
    """
    position, velocity = flight.position[-1], flight.velocity[-1]
    at_start = motion_equations.total_energy(*start, parameters)
    at_end = motion_equations.total_energy(position, velocity, parameters)
    return abs(at_start - at_end - sum(flight.losses.values())) / energy_scale(parameters, start)


def energy_scale(parameters: Parameters, start: State) -> float:
    """Energy [J] of motion and springs at the start, and of a fall through 1 cm."""
    moving = motion_equations.kinetic_energy(start[1], parameters) + motion_equations.spring_energy(
        start[0], parameters
    )
    return moving + parameters.gravity * float(motion_equations.link_masses(len(start[0]), parameters).sum()) * 0.01
