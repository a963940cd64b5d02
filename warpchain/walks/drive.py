"""The motion of the sprocket and the hold until the release, as the kernels' `Drive` needs them.

`WalkRun` calls this when it starts a walk. The hold ends by the kernels' release rule.
"""

import math
from collections.abc import Sequence
from operator import attrgetter
from typing import Final

import numpy as np

from warpchain.chain.link_values import LinkValues
from warpchain.chain.setup import Setup
from warpchain.chain.softened_joints import SOFT, SOFT_MASS, SOFTEST, Joints
from warpchain.inputs.arrays import Array

HOLD_STRAIN = 3e-4
"""Maximum strain of a held loop with softened joints, due to its speed."""
LOADED_STRAIN = 1e-3
"""Maximum strain due to speed and mean weight while loads are scaled."""
GREATEST_LOAD = 50.0
"""Factor by which loads are scaled, unless the chain bears less. With 15, 30 and 60 the released loop is the
same to 0.2 % of its height and 0.4 % of its width (60 to 180 links, 5 to 30 Hz), and within 0.8 % of the width of one
that was held for 40 s under its own loads. Twice as much takes two thirds of the time, in shorter steps."""
PUSH = 0.25
"""Part of its depth by which the sprocket pushes a circle out in the longest step near a contact."""
FASTEST_PUSH = 5e3
"""Greatest rate [1/s] of that push, with which circles sink in by 0.1 mm at most, without it by 0.3 mm and more."""
STILL_PERIOD = 0.25
"""Loop period [s] that is assumed when the sprocket stands still."""
SHORTEST_WINDOW, LONGEST_WINDOW = 0.05, 0.25
"""Bounds of the time [s] over which a loop under its own loads is averaged; between them half a loop period.

Loops whose links do not alternate are averaged over whole periods, no more than the lower bound needs."""
BY_ITSELF = -1.0
"""As `steady_time` means: the kernel chooses how long to watch, see :mod:`warpchain.kernels.events.release`."""


_SCENE: Final = attrgetter(
    "links", "frequency", "spin_up_time", "load_factor", "steady_time", "steady_tolerance", "extra_hold", "phase"
)
_PARAMETERS: Final = attrgetter("link_length", "gravity", "joint_stiffness")


def drives_of(setups: Sequence[Setup], own: LinkValues) -> dict[str, Array]:
    """The fields of `Drive`, (w,) by name, of walks of equal options that begin on a sprocket; `own` have their chains.

    Logarithms and the like are taken one by one, since arrays of them may be rounded otherwise.
    """
    options, from_rest = setups[0].options, np.array([setup.scene.start == "rest" for setup in setups])
    scenes = np.array([_SCENE(setup.scene) for setup in setups], dtype=float).T  # None is NaN
    links, frequency, spin_up_time, load_factor, steady_time, steady_tolerance, extra_hold, phase = scenes
    length, gravity, stiffness = np.array([_PARAMETERS(setup.parameters) for setup in setups]).T
    radius, settled = np.array([(setup.joint_radius, setup.settling_time) for setup in setups]).T
    alternates, mean_mass = own.alternates, own.mean_mass
    speed = 2 * math.pi * frequency * radius
    density = mean_mass / length
    tension = density * speed**2
    side = np.maximum(0.0, links * length / 2 - math.pi * radius)
    weight = density * gravity * side / 2  # the tension that it causes in the middle of the sides
    soft, softest = (_as_soft_as(each, stiffness, mean_mass) for each in (SOFT, SOFTEST))
    bearable = LOADED_STRAIN * (soft if options.soften_drive else stiffness) * length
    limit = np.minimum(GREATEST_LOAD, own.greatest_load(length))
    suitable = np.maximum(
        1.0, np.fmin(limit, np.divide(bearable, weight, out=np.full_like(weight, np.inf), where=weight > 0))
    )
    suitable[~alternates] = 1.0  # the loop under load is another
    load_factor = np.where(np.isnan(load_factor), suitable, load_factor)
    softness = loaded_softness = np.zeros_like(speed)
    if options.soften_drive:
        pull = tension + load_factor * weight
        softness = _softness(stiffness, soft, softest, tension / (HOLD_STRAIN * length))
        loaded_softness = _softness(stiffness, soft, softest, pull / (LOADED_STRAIN * length))
    period = np.divide(links * length, speed, out=np.full_like(speed, STILL_PERIOD), where=speed > 0)
    window = np.minimum(np.maximum(period / 2, SHORTEST_WINDOW), LONGEST_WINDOW)
    # a loop of links that do not alternate swings as it turns: only over whole turns does its mean stay
    window = np.where(alternates, window, period * np.ceil(SHORTEST_WINDOW / period))
    longest_step = max(options.contact_step, options.soft_contact_step if options.soften_drive else 0.0)
    spin_up = np.where(from_rest & (speed > 0), spin_up_time, 0.0)
    return {
        "sprocket_speed": -2 * math.pi * frequency,  # clockwise, so that the walk goes towards +x
        "spin_up_start": settled,
        "spin_up_time": spin_up,
        "hold_start": settled + spin_up,
        "loop_speed": np.array([setup.loop_speed for setup in setups]),
        "loop_period": period,
        "load_factor": load_factor,
        "steady_window": window,
        "steady_time": np.where(np.isnan(steady_time), BY_ITSELF, steady_time),
        "steady_tolerance": steady_tolerance,
        "extra_hold": extra_hold,
        "release_phase": phase,
        "hold_softness": softness,
        "loaded_softness": loaded_softness,
        "push_rate": np.full_like(speed, min(FASTEST_PUSH, PUSH / longest_step)),
    }


def _as_soft_as(joints: Joints, own: Array, mean_mass: Array) -> Array:
    """Stiffness [N/m] of chains' joints that are as soft as these; none becomes stiffer than its own."""
    heavier = mean_mass / SOFT_MASS
    return np.minimum(own, np.where(heavier > 2, heavier, 1.0) * joints.stiffness)


def _softness(*stiffnesses: Array) -> Array:
    """See `_softness_of`, of several chains."""
    return np.array([*map(_softness_of, *(each.tolist() for each in stiffnesses))])


def _softness_of(own: float, soft: float, softest: float, wanted: float) -> float:
    """Softness of joints as stiff as wanted: from 0, their own stiffness, over 1, soft, to 2, softest, all in N/m."""
    if softest == own or wanted <= softest:
        return 2.0
    if wanted > soft:
        return math.log(own / min(wanted, own)) / math.log(own / soft) if own > soft else 1.0
    return 1.0 + math.log(soft / wanted) / math.log(soft / softest)
