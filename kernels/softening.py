"""Softer joints where nothing fast is left to resolve: on the sprocket, just after the release, in the collapsed loop.

Stiff joints are what makes steps short. Softness s is 0 for the model's own k, b and 1/ω_c, 1 for those of soft joints
and 2 for the softest, which have less k and b; in between they are interpolated geometrically. No value ever becomes
stiffer than the model's own. Softness changes at looks only, so that a run does not depend on how it is cut into
launches. On the softest joints, and on soft ones in the drive, steps near a contact may be longer, too: there they
would else be what keeps steps short.

*Drive.* Joints are softest while the chain settles and the sprocket spins up, and as soft as the loop's tension allows
while it is to become steady: C = T/k stretches it by m v²/ℓ²k, at 30 Hz on the softest joints by 0.3 %; so much is
wanted of k that it is a tenth of that. Circles sink deeper into the sprocket, in the spin-up 0.9 mm with 60 links and
2.2 mm with 180, for in each step a contact gives way by half a step's acceleration; the loop goes the slower, but after
half a turn no link remembers it. So long or slow loops take shorter steps in the half turn before the
release, or before each moment at which it may come. With 160 links at 5 Hz circles have then sunk in 0.06 mm instead of
0.14, and the loop that is released has 0.02 % less kinetic energy than from short steps throughout, else 0.26 %. With
ten times the ω_c of soft joints 9 of 24 loops of 150 links were released a period earlier, for friction is what holds a
loop's width; with the same ω_c none were.
*Release.* Soft joints get their own values back before the chain lands. Earlier was tried and rejected: nobody knows
beforehand when the loop will be steady, and putting the release off by 0.25 s shifts Δx by 4 %, for the loop's width
swings slowly. *Pile.* Joints are soft for good once the loop begins to collapse, and softest once it encloses half of
what it did then; softest at once shifts Δx of long chains.

A change of k at openings C sets ½ (k_before − k_after) Σ C² of energy free, which is booked. Going soft is one jump: C
has then grown to T/k_after within a few periods of the soft springs. Going back, C must shrink a hundred- to a
thousandfold, which a jump would turn into a pull of as many times T; so it takes many small ones, each damped away
before the next.
"""

import math

import warp as wp

from .elementary import HALF, ONE, TWO, ZERO
from .layout import (
    LEFT_X,
    LEFT_Y,
    LOSS_SOFTENING,
    RIGHT_X,
    RIGHT_Y,
    SOFTENED_AT,
    SPRING,
    STEADY_SINCE,
    TIME,
    WINDOW_START,
)
from .types import Chain, Control, Model, Program, State, read_chain

wp.set_module_options({"enable_backward": False})

PI = wp.constant(wp.float64(math.pi))
FINISHED = wp.constant(2)
"""Status of a drive whose end has been set, a code shared with warpchain.status."""


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
def on_scale(own: wp.float64, soft: wp.float64, softest: wp.float64, softness: wp.float64):
    """A joint's value from its own at 0 over the soft one at 1 to the softest at 2."""
    return between(between(own, soft, softness), softest, softness - ONE)


@wp.func
def softened(own: Chain, control: Control, softness: wp.float64) -> Chain:
    """A chain whose joints have this softness, from one that has its own values."""
    chain = own
    chain.joint_stiffness = on_scale(own.joint_stiffness, control.soft_stiffness, control.softest_stiffness, softness)
    chain.joint_damping = on_scale(own.joint_damping, control.soft_damping, control.softest_damping, softness)
    chain.inverse_smoothing = between(own.inverse_smoothing, ONE / control.soft_smoothing, softness)
    return chain


@wp.func
def is_stiffer(chain: Chain, other: Chain):
    """Whether any value of a chain's joints is above the other's."""
    return (
        chain.joint_stiffness > other.joint_stiffness
        or chain.joint_damping > other.joint_damping
        or chain.inverse_smoothing > other.inverse_smoothing
    )


@wp.func
def may_end_soon(program: Program, state: State, control: Control, world: int):
    """Whether at the last look less than half a turn of the sprocket was left of the hold, as far as can be known.

    The release comes at a moment that has been set, or else at the earliest when a window of the steadiness watch ends.
    """
    time = state.last_look[world, TIME]
    if time < program.hold_start[world]:
        return False
    end = state.stop_time[world]
    if state.stop_status[world] != FINISHED:
        if state.watch[world, STEADY_SINCE] < ZERO:
            return False
        end = state.watch[world, WINDOW_START] + program.loop_period[world]
        # the window ends at the look after that
        if end + control.sample_interval - state.watch[world, STEADY_SINCE] < program.steady_time[world]:
            return False
    return (end - time) * wp.abs(program.sprocket_speed[world]) < PI


@wp.func
def contact_step(program: Program, state: State, control: Control, world: int, is_driven: bool):
    """Longest step [s] near a contact after the last look; longer on the softest joints, in the drive on soft ones."""
    softness = state.softness[world]
    if softness < ONE or (softness == ONE and not is_driven):
        return control.contact_step
    longest = control.soft_contact_step
    if is_driven:
        if may_end_soon(program, state, control, world):
            longest = wp.min(longest, program.release_step[world])
    return wp.max(control.contact_step, longest)


@wp.func
def spring_tolerance(control: Control, softness: wp.float64):
    """Error allowed in a step of the springs while joints have this softness."""
    return wp.where(softness >= ONE, control.soft_tolerance, control.tolerance)


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
    """Makes joints soft, for good, once the loop encloses less than a fraction of what it did at the first look.

    Below half of that fraction they become softest. Joints that are as soft already stay as they are, and no moment of
    softening is noted.
    """
    if is_first:
        state.first_area[world] = enclosed_area(K, chain)
        return
    softness = state.softness[world]
    is_collapsed = state.watch[world, SOFTENED_AT] >= ZERO
    if softness >= TWO or (softness > ZERO and not is_collapsed):
        return
    share = enclosed_area(K, chain) / state.first_area[world]
    wanted = ZERO
    if share < control.soften_area:
        wanted = ONE
    if share < HALF * control.soften_area:
        wanted = TWO
    if wanted > softness and is_stiffer(chain, softened(chain, control, wanted)):
        state.softness[world] = wanted
        if not is_collapsed:
            state.watch[world, SOFTENED_AT] = time


@wp.func
def watch_stiffening(state: State, program: Program, control: Control, world: int, time: wp.float64):
    """Gives joints that were soft on the sprocket their own values back, in the first moments after the release."""
    if state.softness[world] > ZERO and state.watch[world, SOFTENED_AT] < ZERO:
        left = wp.max(ZERO, ONE - time / control.stiffening_time)
        state.softness[world] = program.hold_softness[world] * left


@wp.func
def watch_spin_up(state: State, program: Program, control: Control, world: int, time: wp.float64):
    """Makes joints softest until the sprocket has spun up, and as soft as the hold allows by the time it begins."""
    ahead = (program.hold_start[world] - time) / control.stiffening_time
    hold = program.hold_softness[world]
    state.softness[world] = hold + (TWO - hold) * wp.clamp(ahead, ZERO, ONE)
