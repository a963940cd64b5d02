"""Numerical settings of a launch, from the options and the properties of soft joints."""

import math

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.kernels.types import Control

SOFT = preset("soft")
"""Parameters of soft joints, see :mod:`warpchain.kernels.events.softening`."""
SOFTEST = SOFT.with_values({"joint_stiffness": 1e6, "joint_damping": 30.0})
"""Parameters of the softest joints. From half of the loop's first area on, walks on them end within 0.01 ± 0.04 mm (60
links at 15 Hz) and 1.5 ± 1.5 mm (150 at 20 Hz) of those on joints of their own, in 2.7 times fewer attempts. On k = 3e5
N/m circles sink 2 mm into the floor; from 0.9 of the area on, 1e6 N/m may shift Δx, by 8 ± 4 mm of 1 m.
"""
SOFT_MASS = (SOFT.inner_mass + SOFT.outer_mass) / 2
"""Mean mass of links [kg] for which these k and b are meant. From twice as much on they grow with it: else a chain with
900 times Table 1's masses, k and b, the same in another unit of mass, walks up to 9 % too far."""
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
    control.soft_stiffness = SOFT.joint_stiffness
    control.soft_damping = SOFT.joint_damping
    control.soft_smoothing = SOFT.friction_smoothing
    control.softest_stiffness = SOFTEST.joint_stiffness
    control.softest_damping = SOFTEST.joint_damping
    control.soft_mass = SOFT_MASS
    control.pile_push = PILE_PUSH
    control.soften_area = options.soften_area if options.soften_pile else -math.inf
    control.stiffening_time = STIFFENING_TIME
    return control
