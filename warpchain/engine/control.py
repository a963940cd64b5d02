"""Numerical settings of a launch, from the options and the properties of soft joints."""

import math

from warpchain.inputs.link_values import LinkValues
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.kernels.types import Control

SOFT = preset("soft")
"""Parameters of soft joints, see :mod:`warpchain.kernels.events.softening`."""
SOFTEST = SOFT.with_values({"joint_stiffness": 1e6, "joint_damping": 30.0})
"""Parameters of the softest joints.

Measured with `paper` and dp5 at 1e-4 on walks that are the same until the loop encloses half of its first area: Δx then
shifts by 0.01 ± 0.04 mm (24 walks of 60 links at 15 Hz) and 1.5 ± 1.5 mm (16 of 150 at 20 Hz; 0.01 ± 0.08 mm from 0.3
of the area), in 2.7 times fewer attempts. That was with ω_c = 1 rad/s, which takes 5 % fewer attempts than the ω_c of
soft joints but lets circles sink in half as deep again. k = 3e5 N/m takes 1.6 times fewer again, but circles sink 2 mm
into the floor. From 0.9 of the area 1e6 N/m may shift Δx: by 8 ± 4 mm of 1 m (12 walks of 150 links).
"""
STIFFENING_TIME = 0.03
"""Time [s] in which joints that were soft on the sprocket return to their own values after the release."""

HOLD_STRAIN = 3e-4
"""Greatest strain of a held loop on softened joints by its speed."""
LOADED_STRAIN = 1e-3
"""Greatest strain by speed and mean weight while loads are multiplied."""
GREATEST_LOAD = 50.0
"""Factor by which loads are multiplied, unless the chain bears less.

With 15, 30 and 60 the loop that is released is the same to 0.2 % of its height and 0.4 % of its width (60 to 180
links, 5 to 30 Hz), and within 0.8 % of the width of one that was held for 40 s under its own loads. Twice as much
makes it stationary in two thirds of the time, in steps that are shorter by as much.
"""
PUSH = 0.25
"""Part of its depth by which the sprocket pushes a circle out in the longest step near a contact."""
FASTEST_PUSH = 5e3
"""Greatest rate [1/s] of that push.

With it circles of 60 to 180 links at 5 to 30 Hz sink in by 0.1 mm at most under load, without it by 0.3 mm and more.
"""
PILE_PUSH = 1e3
"""Rate [1/s] of the push by floor and links while joints are soft or softer.

Without it circles that joints press on sink deeper in every step. In 12,800 walks with `explicit` (60 to 180 links, 5
to 30 Hz) it lowered the 99th percentile of the greatest depth from 2.25 to 0.30 mm (floor) and from 0.65 to 0.22 mm
(links), although tolerances were several times looser. A rate of 300/s gave 0.38 and 0.22 mm. Mean Δx kept to 0.1 %.
"""


def mean_weight(parameters: Parameters, density: float, links: int, radius: float) -> float:
    """Tension [N] that the weight of a loop causes in the middle of its sides.

    Args:
        parameters: The chain's parameters.
        density: Its mass per length [kg/m].
        links: Number of links.
        radius: Distance from the sprocket's centre at which joints ride [m].
    """
    side = max(0.0, links * parameters.link_length / 2 - math.pi * radius)
    return density * parameters.gravity * side / 2


def hold_softness(parameters: Parameters, tension: float, strain: float) -> float:
    """Softness of the joints of a loop that is held, from 1 for soft ones to 2 for the softest.

    Args:
        parameters: The chain's parameters.
        tension: T [N], which stretches the joints by T/k.
        strain: Greatest T/k, in link lengths.
    """
    wanted = tension / (strain * parameters.link_length)
    soft = min(parameters.joint_stiffness, SOFT.joint_stiffness)  # as no joint becomes stiffer than its own
    softest = SOFTEST.joint_stiffness
    if soft <= softest:
        return 2.0
    return 1.0 + max(0.0, math.log(soft / max(wanted, softest)) / math.log(soft / softest))


def suitable_load(parameters: Parameters, links: LinkValues, options: Options, weight: float) -> float:
    """Factor by which loads are multiplied while a loop becomes stationary, unless the scene gives one.

    Args:
        parameters: The chain's parameters.
        links: What each of its links has; unless they alternate, the loop under load is another, and it is 1.
        options: They say whether joints are softened on the sprocket.
        weight: Mean tension by the loop's weight [N].
    """
    stiffness = parameters.joint_stiffness
    if options.soften_drive:
        stiffness = min(stiffness, SOFT.joint_stiffness)
    bearable = LOADED_STRAIN * stiffness * parameters.link_length
    if not links.alternates:
        return 1.0
    limit = min(GREATEST_LOAD, links.greatest_load(parameters.link_length))
    return max(1.0, min(limit, bearable / weight) if weight > 0 else limit)


def push_rate(options: Options) -> float:
    """Rate [1/s] at which the sprocket pushes out circles that have sunk in."""
    longest = options.contact_step
    if options.soften_drive:
        longest = max(longest, options.soft_contact_step)
    return min(FASTEST_PUSH, PUSH / longest)


def control_of(options: Options) -> Control:
    """Settings from the options; the caller sets the length of a launch and which frames are kept."""
    control = Control()
    control.tolerance = options.tolerance
    control.soft_tolerance = options.tolerance if options.soft_tolerance is None else options.soft_tolerance
    control.flight_tolerance = options.flight_tolerance
    control.proportional = int(options.controller == "pi")
    control.contact_step = options.contact_step
    control.skin = options.skin
    control.smallest_step = options.smallest_step
    control.step_limit = options.step_limit
    control.sample_interval = options.record_interval
    control.rest_speed = options.rest_speed
    control.rest_time = options.rest_time
    control.soft_stiffness = SOFT.joint_stiffness
    control.soft_damping = SOFT.joint_damping
    control.soft_smoothing = SOFT.friction_smoothing
    control.softest_stiffness = SOFTEST.joint_stiffness
    control.softest_damping = SOFTEST.joint_damping
    control.soft_contact_step = options.soft_contact_step
    control.pile_push = PILE_PUSH
    control.soften_area = options.soften_area if options.soften_pile else -math.inf
    control.stiffening_time = STIFFENING_TIME
    return control
