"""A chain with softer joints: values between its own, soft and softest ones."""

import warp as wp

from warpchain.kernels.physics.elementary import ONE, TWO, ZERO
from warpchain.kernels.types import Chain, Control


@wp.func
def between(own: wp.float64, soft: wp.float64, softness: wp.float64):
    """From a joint's own value (0) to the lesser of that and a soft one (1), geometrically; exact at both ends."""
    least = wp.min(own, soft)
    if softness <= ZERO or least == own:
        return own
    if softness >= ONE:
        return least
    return own * wp.pow(least / own, softness)


@wp.func
def on_scale(own: wp.float64, soft: wp.float64, softest: wp.float64, softness: wp.float64):
    """A joint's value from its own at 0 over the soft one at 1 to the softest at 2."""
    return between(between(own, soft, softness), softest, softness - ONE)


@wp.func
def softened(own: Chain, control: Control, softness: wp.float64) -> Chain:
    """A chain whose joints have this softness; ``own`` has its own values."""
    chain = own
    heavier = own.mass / (wp.float64(own.link_count) * control.soft_mass)
    heavier = wp.where(heavier > TWO, heavier, ONE)  # so that no bit depends on small differences
    soft = heavier * control.soft_stiffness
    chain.joint_stiffness = on_scale(own.joint_stiffness, soft, heavier * control.softest_stiffness, softness)
    soft = heavier * control.soft_damping
    chain.joint_damping = on_scale(own.joint_damping, soft, heavier * control.softest_damping, softness)
    chain.inverse_smoothing = between(own.inverse_smoothing, ONE / control.soft_smoothing, softness)
    chain.push_rate = wp.where(softness >= ONE, control.pile_push, ZERO)
    return chain


@wp.func
def is_stiffer(chain: Chain, other: Chain):
    """Whether any value of a chain's joints is above the other's."""
    return (
        chain.joint_stiffness > other.joint_stiffness
        or chain.joint_damping > other.joint_damping
        or chain.inverse_smoothing > other.inverse_smoothing
    )
