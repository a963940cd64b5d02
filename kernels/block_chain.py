"""Explicit methods whose stages follow from the one before alone, in the block form: a loop that is not unrolled.

All stages and the last one, which the next step reuses, are turns of one loop, with coefficients that are looked up. What
a thread keeps of earlier stages is three accelerations instead of all, and the code of a stage stands in the kernel once:
chains of different lengths are carried by kernels of their own, and a multiprocessor that holds several of those has
room for the instructions of hardly more than one unrolled step.
"""

import functools
from collections.abc import Sequence

import warp as wp

from .block_step import Link, Place, Trial, block_stage, first_on, greatest_error, link_on, vec3d, vec5d
from .elementary import LARGEST_TURN, ZERO
from .geometry import turned_direction
from .layout import THETA
from .tableaus import TABLEAUS

wp.set_module_options({"enable_backward": False})


@wp.func_native('asm volatile("" : "+r"(x)); return x;')
def hidden(x: int) -> int:
    """The same number, of which the compiler knows nothing: a loop of a known length it would unroll."""
    ...


def lookup(values: Sequence[float]):
    """Warp function that gives one of these numbers, which the compiler puts into constant memory, by its place."""

    @wp.func_native(f"const double values[] = {{{', '.join(map(repr, values))}}};\n    return values[place];")
    def value_at(place: int) -> wp.float64: ...

    return value_at


@functools.cache
def chained_attempt(name: str, block_dim: int):
    """Warp function that tries a step with a chained tableau in blocks of this size.

    Args:
        name: Key of :data:`TABLEAUS`, of one that is chained.
        block_dim: Threads in a block.

    Returns:
        ``attempt`` as that of :func:`block_step.explicit_attempt`.
    """
    tableau = TABLEAUS[name]
    last = tableau.stages - 1
    node = lookup(tableau.nodes)
    weight = lookup(tableau.velocity_weights)
    from_latest = lookup([0.0, *(row[-1] for row in tableau.velocity[1:])])
    from_first = lookup([0.0, 0.0, *(row[0] for row in tableau.velocity[2:])])
    from_one_before = lookup([0.0, 0.0, *(row[-2] for row in tableau.position[2:])])
    weights = tableau.velocity_weights
    errors = tableau.velocity_errors
    rate_first, rate_before, rate_latest = (wp.constant(wp.float64(errors[k])) for k in (0, last - 1, last))
    errors = tableau.position_errors
    place_first, place_before, place_latest = (wp.constant(wp.float64(errors[k])) for k in (0, last - 2, last - 1))
    hand_over, stage = block_stage(block_dim)

    @wp.func
    def attempt(
        ends: wp.tile[vec5d, block_dim],
        forces: wp.tile[vec3d, block_dim],
        S: wp.uint64,
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        n: int,
        h: wp.float64,
        tolerance: wp.float64,
    ):
        hh = h * h
        lane = place.lane
        theta = K[THETA, lane]
        first = first_on(K, lane)
        trial = Trial()
        friction = wp.static(wp.float64(weights[0])) * first.friction
        damping = wp.static(wp.float64(weights[0])) * first.damping
        # accelerations of the last three stages, a the latest
        ax = first.x + ZERO
        ay = first.y + ZERO
        at = first.theta + ZERO
        bx = ZERO + ZERO
        by = ZERO + ZERO
        bt = ZERO + ZERO
        cx = ZERO + ZERO
        cy = ZERO + ZERO
        ct = ZERO + ZERO
        end = hidden(wp.static(last))
        s = int(1)
        while s <= end:
            ch = node(s) * h
            of_first = from_first(s)
            of_latest = from_latest(s)
            of_one_before = from_one_before(s)
            link = link_on(K, lane)
            there = Link()
            there.x = link.x + (ch * link.u + hh * (of_one_before * bx))
            there.y = link.y + (ch * link.v + hh * (of_one_before * by))
            turn = ch * link.omega + hh * (of_one_before * bt)
            begin = first_on(K, lane)
            there.u = link.u + h * (of_first * begin.x + of_latest * ax)
            there.v = link.v + h * (of_first * begin.y + of_latest * ay)
            there.omega = link.omega + h * (of_first * begin.theta + of_latest * at)
            cosine, sine = turned_direction(link.cosine, link.sine, turn)
            there.cosine = cosine
            there.sine = sine
            next_end = hand_over(ends, K, place, there)
            rates = stage(forces, K, place, next_end, there)
            cx = bx + ZERO
            cy = by + ZERO
            ct = bt + ZERO
            bx = ax + ZERO
            by = ay + ZERO
            bt = at + ZERO
            ax = rates.x + ZERO
            ay = rates.y + ZERO
            at = rates.theta + ZERO
            friction += weight(s) * rates.friction
            damping += weight(s) * rates.damping
            if s == end:
                # the last stage is at the new state
                trial.x = there.x
                trial.y = there.y
                trial.theta = theta + turn
                trial.u = there.u
                trial.v = there.v
                trial.omega = there.omega
                trial.cosine = cosine
                trial.sine = sine
                trial.next_end = next_end
                trial.last = rates
            s += 1
        first = first_on(K, lane)
        ex = place_first * first.x + place_before * cx + place_latest * bx
        ey = place_first * first.y + place_before * cy + place_latest * by
        et = place_first * first.theta + place_before * ct + place_latest * bt
        eu = rate_first * first.x + rate_before * bx + rate_latest * ax
        ev = rate_first * first.y + rate_before * by + rate_latest * ay
        ew = rate_first * first.theta + rate_before * bt + rate_latest * at
        trial.friction = friction
        trial.damping = damping
        error, scale = greatest_error(link_on(K, lane), theta, first, h, hh * ex, hh * ey, hh * et, h * eu, h * ev, h * ew)
        trial.error = error
        trial.scale = scale
        trial.turns_far = wp.abs(trial.theta - theta) > LARGEST_TURN
        return trial

    return attempt
