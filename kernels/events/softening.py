"""Softer joints where no fast motion matters: on the sprocket, just after the release, in the collapsed loop.

Stiff joints make steps short. Softness s is 0 for the model's own k, b and 1/ω_c, 1 for SOFT and 2 for SOFTEST
(engine/control.py), which has less k and b; in between values are interpolated geometrically. Both have more k and b
where links are heavy. No value ever becomes stiffer than the model's own. Softness changes at samples only, so that a
run does not depend on how it is cut into launches. On the softest joints, and in the drive on soft ones, steps near a
contact may be longer too: otherwise contacts would limit the step.

*Drive.* Joints are softest while the chain settles and the sprocket spins up. Afterwards, while the loop becomes
stationary, they are as soft as its tension T allows. Openings C = T/k stretch the loop by the strain T/kℓ, with ℓ the
length of a link. On the softest joints it is 0.3 % at 30 Hz. k is chosen so that the strain is at most 0.03 %, which
loops above 32 Hz have on joints stiffer than SOFT. Under multiplied loads (:mod:`physics.scaled_loads`) 0.1 % is
allowed. With ten times the ω_c of soft joints another loop becomes stationary, because friction determines its width.
*Release.* Soft joints return to their own values before the chain reaches the floor. *Pile.* Joints become soft for
good when the loop begins to collapse, and softest when its area is below half of that at which it began. Softest at
once shifts Δx of long chains. From soft joints on, floor and links push out circles that have sunk in
(:attr:`Chain.push_rate`): soft joints press on them for long, and an impulse stops a circle only after a step in which
it has sunk in.

A change of k at openings C releases the energy ½ (k_before − k_after) Σ C², which is booked. Softening is one jump: C
grows to T/k_after within a few periods of the soft springs. When joints stiffen, C must shrink by a factor of 100 to
1000. One jump would make a pull 100 to 1000 times T; so joints stiffen in small jumps, each damped before the next.
"""

import warp as wp

from warpchain.kernels.layout import HOLD_LOAD, LOSS_SOFTENING, SOFTENED_AT, SPRING, TIME
from warpchain.kernels.physics.elementary import HALF, ONE, TWO, ZERO
from warpchain.kernels.physics.softness import is_stiffer, softened
from warpchain.kernels.types import Chain, Worlds

TEN = wp.constant(wp.float64(10.0))
ROUGHEST = wp.constant(wp.float64(0.05))
"""Tolerance from which on the drive is no looser: at 0.1 circles sink half as deep again into the sprocket."""


@wp.func
def contact_step(worlds: Worlds, world: int, is_driven: bool):
    """Longest step [s] near a contact; longer on the softest joints, in the drive also on soft ones."""
    softness = worlds.softness[world]
    if softness < ONE or (softness == ONE and not is_driven):
        return worlds.control.contact_step
    return wp.max(worlds.control.contact_step, worlds.control.soft_contact_step)


@wp.func
def spring_tolerance(worlds: Worlds, world: int, is_driven: bool):
    """Tolerance of steps on springs, until the next sample.

    Ten times looser on the sprocket, until the loop is held under its own loads: the stationary loop does not depend on
    how it was reached, and steps are twice as long.
    """
    tolerance = wp.where(worlds.softness[world] >= ONE, worlds.control.soft_tolerance, worlds.control.tolerance)
    if is_driven:
        is_spun_up = worlds.last_sample[world, TIME] >= worlds.drive.hold_start[world]
        if not is_spun_up or worlds.load_factor[world] > ONE:
            tolerance = wp.max(tolerance, wp.min(TEN * tolerance, ROUGHEST))
    return tolerance


@wp.func
def book_softening(before: Chain, after: Chain, worlds: Worlds, world: int):
    """Books the energy that a change of the joints' stiffness at the last sample has released."""
    freed = worlds.last_sample[world, SPRING] * (ONE - after.joint_stiffness / before.joint_stiffness)
    worlds.losses[world, LOSS_SOFTENING] = worlds.losses[world, LOSS_SOFTENING] + freed


@wp.func
def watch_collapse(chain: Chain, worlds: Worlds, world: int, time: wp.float64, area: wp.float64, is_first: bool):
    """Makes joints soft, for good, when the loop's area [m²] has fallen below a fraction of that at the first sample.

    Below half of that fraction they become softest. Joints that are as soft themselves stay so, and no time is noted.
    """
    if is_first:
        return
    softness = worlds.softness[world]
    is_collapsed = worlds.watch[world, SOFTENED_AT] >= ZERO
    if softness >= TWO or (softness > ZERO and not is_collapsed):
        return
    share = area / worlds.first_area[world]
    wanted = ZERO
    if share < worlds.control.soften_area:
        wanted = ONE
    if share < HALF * worlds.control.soften_area:
        wanted = TWO
    if wanted > softness and is_stiffer(chain, softened(chain, worlds.control, wanted)):
        worlds.softness[world] = wanted
        if not is_collapsed:
            worlds.watch[world, SOFTENED_AT] = time


@wp.func
def watch_stiffening(worlds: Worlds, world: int, time: wp.float64):
    """Returns joints that were soft on the sprocket to their own values, in the first moments after the release."""
    if worlds.softness[world] > ZERO and worlds.watch[world, SOFTENED_AT] < ZERO:
        left = wp.max(ZERO, ONE - time / worlds.control.stiffening_time)
        worlds.softness[world] = worlds.drive.hold_softness[world] * left


@wp.func
def watch_drive(worlds: Worlds, world: int, time: wp.float64):
    """Makes joints softest until the sprocket has spun up, and as soft as the hold allows by the time it begins."""
    hold = worlds.drive.hold_softness[world]
    if hold == ZERO:
        return
    ahead = (worlds.drive.hold_start[world] - time) / worlds.control.stiffening_time
    if worlds.load_factor[world] > ONE:
        share = wp.log(worlds.load_factor[world]) / wp.log(worlds.watch[world, HOLD_LOAD])
        hold += (worlds.drive.loaded_softness[world] - hold) * share
    worlds.softness[world] = hold + (TWO - hold) * wp.clamp(ahead, ZERO, ONE)
