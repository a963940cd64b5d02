"""Numerical settings of a launch, from the options and the properties of soft joints."""

import math

from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
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
SOFT_MASS = SOFT.inner_mass + SOFT.outer_mass
"""Mean mass of links [kg] above which k and b of softened joints grow with it: twice Table 1's.

Else a chain of 900 times its masses, k and b, which is the same in another unit of mass, walks 2 % less far from an
ellipse and 9 % farther from a sprocket.
"""
STIFFENING_TIME = 0.03
"""Time [s] in which joints that were soft on the sprocket return to their own values after the release."""

PILE_PUSH = 100.0
"""Rate [1/s] of the push by floor and links while joints are soft or softer.

Without it circles that joints press on sink deeper in every step, and slow long loops go less far than on joints of
their own; with a fast one they go too far. Mean of 40 cells (100 to 240 links, 5 to 9 Hz, 2,400 walks), 99th percentile
of the greatest depth in the floor and of links in links (60 to 180 links, 5 to 30 Hz, 3,200 walks), `explicit`:

| rate / (1/s) | 0 | 50 | 100 | 150 | 300 | 1000 |
| --- | --- | --- | --- | --- | --- | --- |
| Δx, ± 0.05 % | −0.36 % | −0.04 % | +0.04 % | +0.12 % | +0.19 % | +0.40 % |
| floor / mm | 2.25 | | 0.53 | 0.44 | 0.38 | 0.30 |
| links / mm | 0.65 | | 0.24 | 0.22 | 0.22 | 0.22 |

Where loops are shorter or faster, Δx keeps to 0.1 %.
"""


def control_of(options: Options) -> Control:
    """Settings, by name those of the options; the caller sets the length of a launch and which frames are kept."""
    control = Control()
    tolerance = options.tolerance if options.soft_tolerance is None else options.soft_tolerance
    for name, value in {**vars(options), "soft_tolerance": tolerance}.items():
        if name in Control.vars:  # type: ignore[attr-defined]
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
