"""Softer joints where nothing fast is left to resolve: in a loop that has collapsed, and just after the release.

A chain that was driven on soft joints is released with them; they get their own values back before it lands. Earlier
was tried and rejected: nobody knows beforehand when the loop will be steady, and putting the release off by 0.25 s
shifts Δx by 4 %, for the loop's width swings slowly.

Stiff joints are what makes steps short. Softness s goes from 0, the model's own k, b and 1/ω_c, to 1, those of soft
joints; in between they are interpolated geometrically. No value ever becomes stiffer than the model's own. Softness
changes at looks only, so that a run does not depend on how it is cut into launches.

A change of k at openings C sets ½ (k_before − k_after) Σ C² of energy free, which is booked. Going soft is one jump: C
has then grown to T/k_after within a few periods of the soft springs. Going back, C must shrink a hundredfold, which a
jump would turn into a pull of a hundred times T; so it takes many small ones, each damped away before the next.
"""

import warp as wp

from .elementary import HALF, ONE, ZERO
from .layout import (
    LEFT_X,
    LEFT_Y,
    LOSS_SOFTENING,
    RIGHT_X,
    RIGHT_Y,
    SOFTENED_AT,
    SPRING,
)
from .types import Chain, Control, Model, State, read_chain

wp.set_module_options({"enable_backward": False})


@wp.func
def between(own: wp.float64, soft: wp.float64, softness: wp.float64):
    """From a joint's own value to the lesser of that and a soft one, exact at both ends."""
    least = wp.min(own, soft)
    if softness <= ZERO or least == own:
        return own
    if softness >= ONE:
        return least
    return own * wp.pow(least / own, softness)


@wp.func
def softened(own: Chain, control: Control, softness: wp.float64) -> Chain:
    """A chain whose joints have this softness, from one that has its own values."""
    chain = own
    chain.joint_stiffness = between(own.joint_stiffness, control.soft_stiffness, softness)
    chain.joint_damping = between(own.joint_damping, control.soft_damping, softness)
    chain.inverse_smoothing = between(own.inverse_smoothing, ONE / control.soft_smoothing, softness)
    return chain


@wp.func
def change_joints(before: Chain, model: Model, state: State, control: Control, world: int) -> Chain:
    """The chain after a look that has changed its softness; books the energy that this sets free."""
    after = softened(read_chain(model, world), control, state.softness[world])
    freed = state.last_look[world, SPRING] * (ONE - after.joint_stiffness / before.joint_stiffness)
    state.losses[world, LOSS_SOFTENING] = state.losses[world, LOSS_SOFTENING] + freed
    return after


@wp.func
def enclosed_area(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """Area [m²] inside a placed loop, positive if it runs counter-clockwise: ½ Σ left end × right end."""
    area = ZERO
    i = int(0)
    while i < chain.link_count:
        area += K[LEFT_X, i] * K[RIGHT_Y, i] - K[RIGHT_X, i] * K[LEFT_Y, i]
        i += 1
    return HALF * area


@wp.func
def watch_collapse(
    K: wp.array2d(dtype=wp.float64),
    chain: Chain,
    state: State,
    control: Control,
    world: int,
    time: wp.float64,
    is_first: bool,
):
    """Softens the joints for good once the loop encloses less than a fraction of what it did at the first look.

    Joints that are soft already stay as they are, and no moment of softening is noted.
    """
    if is_first:
        state.first_area[world] = enclosed_area(K, chain)
    soft = softened(chain, control, ONE)
    is_stiffer = (
        chain.joint_stiffness > soft.joint_stiffness
        or chain.joint_damping > soft.joint_damping
        or chain.inverse_smoothing > soft.inverse_smoothing
    )
    if is_first or state.softness[world] > ZERO or not is_stiffer:
        return
    if enclosed_area(K, chain) / state.first_area[world] < control.soften_area:
        state.softness[world] = ONE
        state.watch[world, SOFTENED_AT] = time


@wp.func
def watch_stiffening(state: State, control: Control, world: int, time: wp.float64):
    """Gives joints that were soft on the sprocket their own values back, in the first moments after the release."""
    if state.softness[world] > ZERO and state.watch[world, SOFTENED_AT] < ZERO:
        state.softness[world] = wp.max(ZERO, ONE - time / control.stiffening_time)
