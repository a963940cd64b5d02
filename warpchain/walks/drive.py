"""What the sprocket does with a chain until the release, as kernels read it."""

import math

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.control import (
    HOLD_STRAIN,
    LOADED_STRAIN,
    hold_softness,
    mean_weight,
    push_rate,
    suitable_load,
)
from warpchain.inputs.link_values import LinkValues, mean_value
from warpchain.inputs.scene import joint_radius, loop_speed, settling_time
from warpchain.inputs.setup import Setup
from warpchain.inputs.start_shapes import lay_chain, stadium

Array = NDArray[np.float64]

STILL_PERIOD = 0.25
"""Loop period [s] that is assumed when the sprocket stands still."""
SHORTEST_WINDOW, LONGEST_WINDOW = 0.05, 0.25
"""Bounds of the time [s] over which a loop under its own loads is averaged; between them half a loop period.

Loops whose links do not alternate are averaged over whole periods, no more than the lower bound needs."""
BY_ITSELF = -1.0
"""As `steady_time` means: the kernel chooses how long to watch, see :mod:`warpchain.kernels.events.release`."""


def drive_of(setup: Setup, links: LinkValues) -> tuple[tuple[Array, Array], dict[str, float]]:
    """Position and velocity (n, 3) of a chain on its sprocket, about the origin, and fields of `Drive` by name.

    Args:
        setup: Of the walk.
        links: What each of its links has.
    """
    scene, parameters, options = setup.scene, setup.parameters, setup.options
    from_rest = scene.start == "rest"
    radius = joint_radius(scene, parameters)
    speed = 2 * math.pi * scene.frequency * radius
    density = mean_value(links.mass) / parameters.link_length
    tension = density * speed**2
    weight = mean_weight(parameters, density, scene.links, radius)
    load_factor = scene.load_factor or suitable_load(parameters, links, options, weight)
    softness = loaded_softness = 0.0
    if options.soften_drive:
        softness = hold_softness(parameters, tension, HOLD_STRAIN)
        loaded_softness = hold_softness(parameters, tension + load_factor * weight, LOADED_STRAIN)
    period = scene.links * parameters.link_length / speed if speed > 0 else STILL_PERIOD
    window = min(max(period / 2, SHORTEST_WINDOW), LONGEST_WINDOW)
    if not links.alternates:  # the loop swings as it turns: only over whole turns does its mean stay
        window = period * math.ceil(SHORTEST_WINDOW / period)
    settled, spin_up = settling_time(scene), scene.spin_up_time if from_rest and speed > 0 else 0.0
    drive = {
        "sprocket_speed": -2 * math.pi * scene.frequency,  # clockwise, so that the walk goes towards +x
        "spin_up_start": settled,
        "spin_up_time": spin_up,
        "hold_start": settled + spin_up,
        "loop_speed": loop_speed(scene, parameters),
        "loop_period": period,
        "load_factor": load_factor,
        "steady_window": window,
        "steady_time": BY_ITSELF if scene.steady_time is None else scene.steady_time,
        "steady_tolerance": scene.steady_tolerance,
        "further_hold": scene.further_hold,
        "release_phase": scene.phase,
        "hold_softness": softness,
        "loaded_softness": loaded_softness,
        "push_rate": push_rate(options),
    }
    return lay_chain(stadium(radius), scene.links, parameters.link_length, 0.0 if from_rest else speed), drive
