"""The motion of the sprocket and the hold until the release, as the kernels' `Drive` needs them.

`WalkRun` calls this when it starts a walk. The hold ends by the kernels' release rule.
"""

import math
from collections.abc import Sequence

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


def drives_of(setups: Sequence[Setup], links: LinkValues) -> dict[str, Array]:
    """The fields of `Drive`, (w,) by name, of walks that begin on a sprocket; `links` are what their chains have."""
    greatest = links.greatest_load(np.array([setup.parameters.link_length for setup in setups]))
    facts = (values.tolist() for values in (links.mean_mass, links.alternates, greatest))
    drives = [_drive_of(*given) for given in zip(setups, *facts, strict=True)]
    return {name: np.array([drive[name] for drive in drives]) for name in drives[0]}


def _drive_of(setup: Setup, mean_mass: float, alternates: bool, greatest_load: float) -> dict[str, float]:
    """The fields of `Drive` of a walk, given three facts of its `LinkValues`."""
    scene, parameters, options = setup.scene, setup.parameters, setup.options
    from_rest = scene.start == "rest"
    radius = setup.joint_radius
    speed = 2 * math.pi * scene.frequency * radius
    density = mean_mass / parameters.link_length
    tension = density * speed**2
    side = max(0.0, scene.links * parameters.link_length / 2 - math.pi * radius)
    weight = density * parameters.gravity * side / 2  # the tension that it causes in the middle of the sides
    own = parameters.joint_stiffness
    soft, softest = (_as_soft_as(each, own, mean_mass) for each in (SOFT, SOFTEST))
    suitable = 1.0  # unless links alternate: the loop under load is another
    if alternates:
        bearable = LOADED_STRAIN * (soft if options.soften_drive else own) * parameters.link_length
        limit = min(GREATEST_LOAD, greatest_load)
        suitable = max(1.0, min(limit, bearable / weight) if weight > 0 else limit)
    load_factor = scene.load_factor or suitable
    softness = loaded_softness = 0.0
    if options.soften_drive:
        pull, length = tension + load_factor * weight, parameters.link_length
        softness = _softness(own, soft, softest, tension / (HOLD_STRAIN * length))
        loaded_softness = _softness(own, soft, softest, pull / (LOADED_STRAIN * length))
    period = scene.links * parameters.link_length / speed if speed > 0 else STILL_PERIOD
    window = min(max(period / 2, SHORTEST_WINDOW), LONGEST_WINDOW)
    if not alternates:  # the loop swings as it turns: only over whole turns does its mean stay
        window = period * math.ceil(SHORTEST_WINDOW / period)
    longest_step = max(options.contact_step, options.soft_contact_step if options.soften_drive else 0.0)
    settled, spin_up = setup.settling_time, scene.spin_up_time if from_rest and speed > 0 else 0.0
    return {
        "sprocket_speed": -2 * math.pi * scene.frequency,  # clockwise, so that the walk goes towards +x
        "spin_up_start": settled,
        "spin_up_time": spin_up,
        "hold_start": settled + spin_up,
        "loop_speed": setup.loop_speed,
        "loop_period": period,
        "load_factor": load_factor,
        "steady_window": window,
        "steady_time": BY_ITSELF if scene.steady_time is None else scene.steady_time,
        "steady_tolerance": scene.steady_tolerance,
        "extra_hold": scene.extra_hold,
        "release_phase": scene.phase,
        "hold_softness": softness,
        "loaded_softness": loaded_softness,
        "push_rate": min(FASTEST_PUSH, PUSH / longest_step),
    }


def _as_soft_as(joints: Joints, own: float, mean_mass: float) -> float:
    """Stiffness [N/m] of a chain's joints that are as soft as these; none becomes stiffer than its own."""
    heavier = mean_mass / SOFT_MASS
    return min(own, (heavier if heavier > 2 else 1.0) * joints.stiffness)


def _softness(own: float, soft: float, softest: float, wanted: float) -> float:
    """Softness of joints as stiff as wanted: from 0, their own stiffness, over 1, soft, to 2, softest, all in N/m."""
    if softest == own or wanted <= softest:
        return 2.0
    if wanted > soft:
        return math.log(own / min(wanted, own)) / math.log(own / soft) if own > soft else 1.0
    return 1.0 + math.log(soft / wanted) / math.log(soft / softest)
