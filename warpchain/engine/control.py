"""Numerical settings of a launch, from the options and the properties of soft joints."""

import math

from warpchain.chain.softened_joints import SOFT, SOFT_MASS, SOFTEST
from warpchain.inputs.options import Options
from warpchain.kernels.types import Control

STIFFENING_TIME = 0.03
"""Time [s] in which joints that were soft on the sprocket return to their own values after the release."""

PILE_PUSH = 100.0
"""Rate [1/s] of the push by floor and links while joints are soft or softer.

Without it circles that joints press on sink four times as deep, and slow long loops go less far (100 to 240 links, 5 to
9 Hz: Δx −0.36 ± 0.05 %, with it +0.04 %); with a faster one they go too far (1000/s: +0.40 %).
"""


def control_of(options: Options) -> Control:
    """Settings, by name those of the options; the caller sets the length of a launch and which frames are kept."""
    control = Control()
    tolerance = options.tolerance if options.soft_tolerance is None else options.soft_tolerance
    for name, value in {**vars(options), "soft_tolerance": tolerance}.items():
        if name in Control.vars:  # type: ignore[attr-defined, unused-ignore]
            setattr(control, name, value)
    control.proportional = int(options.controller == "pi")
    control.sample_interval = options.record_interval
    control.soft_stiffness = SOFT.stiffness
    control.soft_damping = SOFT.damping
    control.soft_smoothing = SOFT.smoothing
    control.softest_stiffness = SOFTEST.stiffness
    control.softest_damping = SOFTEST.damping
    control.soft_mass = SOFT_MASS
    control.pile_push = PILE_PUSH
    control.soften_area = options.soften_area if options.soften_pile else -math.inf
    control.stiffening_time = STIFFENING_TIME
    return control
