"""Numerical settings of a launch, as options say them and as soft joints are."""

import math

from warpchain.kernels.types import Control
from warpchain.options import Options
from warpchain.parameters import Parameters, preset

SOFT = preset("soft")
"""Whose joints soft ones have, see :mod:`warpchain.kernels.softening`."""
SOFTEST = SOFT.with_values({"joint_stiffness": 1e6, "joint_damping": 30.0})
"""Whose joints the softest have.

Measured with `paper` and dp5 at 1e-4 on walks that are the same until the loop encloses half of its first area: Δx then
shifts by 0.01 ± 0.04 mm (24 walks of 60 links at 15 Hz) and 1.5 ± 1.5 mm (16 of 150 at 20 Hz; 0.01 ± 0.08 mm from 0.3
of the area), in 2.7 times fewer tries. That was with ω_c = 1 rad/s, which takes 5 % fewer tries than the ω_c of soft
joints but lets circles sink in half as deep again. k = 3e5 N/m takes 1.6 times fewer again, but circles sink 2 mm into
the floor. From 0.9 of the area 1e6 N/m may shift Δx: by 8 ± 4 mm of 1 m (12 walks of 150 links).
"""
STIFFENING_TIME = 0.03
"""Time [s] in which joints that were soft on the sprocket get their own values back after the release."""

HOLD_STRAIN = 3e-4
"""Strain that the loop's speed may cause in joints that are softened while it is held."""


def hold_softness(parameters: Parameters, speed: float) -> float:
    """Softness of the joints while the loop is held, from 1 for soft ones to 2 for the softest.

    A loop that circulates is under the tension m v² / ℓ, and stretches by that over k ℓ: slow ones may be softer.

    Args:
        parameters: Of the chain.
        speed: Of the joints along the loop [m/s].
    """
    mass = (parameters.inner_mass + parameters.outer_mass) / 2
    wanted = mass * (speed / parameters.link_length) ** 2 / HOLD_STRAIN
    soft = min(parameters.joint_stiffness, SOFT.joint_stiffness)  # as no joint becomes stiffer than its own
    softest = SOFTEST.joint_stiffness
    if soft <= softest:
        return 2.0
    return 1.0 + max(0.0, math.log(soft / max(wanted, softest)) / math.log(soft / softest))


SINKING = 1.5e-3
"""Part of its distance from the sprocket's centre by which a joint may sink in before a release, see `release_step`.

Measured with `soft` on 60 and 160 links at 5 to 15 Hz, those on the sprocket sink a quarter to two fifths of the
estimate below in the mean. At this much of it, or with `contact_step`, which is the longer one from some 85 links on at
5 Hz, the loop has hardly less kinetic energy than from steps of 20 µs throughout, in twice the tries.
"""


def release_step(parameters: Parameters, links: int, speed: float, radius: float) -> float:
    """Longest step [s] near the sprocket in its half turn before a release.

    Impulses after each step stop circles that have sunk in, so that in each they sink by what an acceleration does in
    that time: a h²/2. Half of the loop's weight pulls at either end of what lies on the sprocket, a = n ℓ g / 2ρ, for
    half a turn, π ρ / v: joints sink by up to π n ℓ g h / 4v, slow ones and long loops most.

    Args:
        parameters: Of the chain.
        links: Their number n.
        speed: Of the joints along the loop, v [m/s].
        radius: Distance ρ from the sprocket's centre at which joints ride [m].
    """
    weight = links * parameters.link_length * parameters.gravity  # of the loop, over a link's mass per length
    return SINKING * radius * 4 * speed / (math.pi * weight) if weight > 0 else math.inf


def control_of(options: Options) -> Control:
    """What options say of every launch; how long a launch is and which frames it keeps is still to be said."""
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
    control.soften_area = options.soften_area if options.soften_pile else -math.inf
    control.stiffening_time = STIFFENING_TIME
    return control
