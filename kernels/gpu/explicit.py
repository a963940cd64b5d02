"""Embedded explicit Runge–Kutta methods on a GPU: one thread per link, stages in registers.

The same stages as in :mod:`cpu.explicit`, for the same tableaus. In every stage the threads wait for the friction of
their joints. Meanwhile they evaluate their places in the next stage, which in the Nyström form do not depend on the
present one. In a last stage at the new state they evaluate its proximity instead.
"""

import functools
from typing import Any

import warp as wp

from warpchain.kernels.gpu.stage import (
    Attempt,
    Link,
    Place,
    block_stage,
    greater,
    greatest_position_error,
    greatest_velocity_error,
    read_first_stage,
    read_link,
    vec3d,
    vec5d,
)
from warpchain.kernels.layout import INVERSE_INERTIA, INVERSE_MASS, THETA
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS
from warpchain.kernels.physics.elementary import LARGEST_TURN, ONE, ZERO, cos_sin
from warpchain.kernels.physics.geometry import turned
from warpchain.kernels.types import Ground, Rows

wp.set_module_options({"enable_backward": False})


@wp.struct
class Ahead:
    """A stage, or the new state, as far as it is known before the preceding stage."""

    x: wp.float64  # [m]
    y: wp.float64  # [m]
    turn: wp.float64  # since the step began [rad]
    u: wp.float64  # sums Σ a_ij k_j so far, …
    v: wp.float64
    omega: wp.float64  # … without the term of the preceding stage


@functools.cache
def explicit_attempt(name: str, block_dim: int, write_proximity: Any, read_proximity: Any, tilts: bool = False):
    """Warp function that attempts a step with a tableau in blocks of this size.

    Args:
        name: Key of :data:`TABLEAUS`.
        block_dim: Threads in a block.
        write_proximity: See :func:`gpu.contacts.proximity.block_proximity`.
        read_proximity: See :func:`gpu.contacts.proximity.block_proximity`.
        tilts: Whether the plane of the chain may move.

    Returns:
        ``attempt(ends, forces, maxima, K, place, ground, h)`` → Attempt, from the state and first stage on the board;
        ``maxima``: memory of ``write_proximity``.
    """
    tableau = TABLEAUS[name]
    stages, last = tableau.stages, tableau.stages - 1
    reuses_last = tableau.first_same_as_last
    velocity_weights = tableau.velocity_weights
    velocity_errors, position_errors = tableau.velocity_errors, tableau.position_errors
    # the new state is one more row of the tableau
    velocity = (*tableau.velocity, velocity_weights)
    position = (*tableau.position, tableau.position_weights)
    nodes = (*tableau.nodes, 1.0)
    exchange_ends, stage = block_stage(block_dim, tilts)
    Stages = wp.types.vector(length=stages, dtype=wp.float64)

    def ahead_of(s: int):
        """Warp function ``ahead(link, h, ax, ay, at)`` → Ahead of row s, from the accelerations before row s − 1."""

        @wp.func
        def ahead(link: Link, h: wp.float64, ax: Stages, ay: Stages, at: Stages):
            row = Ahead()
            dx = ZERO
            dy = ZERO
            turn = ZERO
            for j in range(wp.static(s - 1)):
                if wp.static(velocity[s][j] != 0.0):
                    row.u += wp.static(wp.float64(velocity[s][j])) * ax[j]
                    row.v += wp.static(wp.float64(velocity[s][j])) * ay[j]
                    row.omega += wp.static(wp.float64(velocity[s][j])) * at[j]
                if wp.static(position[s][j] != 0.0):
                    dx += wp.static(wp.float64(position[s][j])) * ax[j]
                    dy += wp.static(wp.float64(position[s][j])) * ay[j]
                    turn += wp.static(wp.float64(position[s][j])) * at[j]
            ch = wp.static(wp.float64(nodes[s])) * h
            row.x = link.x + (ch * link.u + h * h * dx)
            row.y = link.y + (ch * link.v + h * h * dy)
            row.turn = ch * link.omega + h * h * turn
            return row

        return ahead

    rows = [None, *map(ahead_of, range(1, stages + 1))]

    @wp.func
    def attempt(
        ends: wp.tile[vec5d, block_dim],
        forces: wp.tile[vec3d, block_dim],
        maxima: wp.uint64,
        K: Rows,
        place: Place,
        ground: Ground,
        h: wp.float64,
    ):
        lane = place.lane
        ax = Stages()
        ay = Stages()
        at = Stages()
        link = read_link(K, lane)
        inverse_mass = K[INVERSE_MASS, place.column]
        inverse_inertia = K[INVERSE_INERTIA, place.column]
        first = read_first_stage(K, lane)
        ax[0] = first.x
        ay[0] = first.y
        at[0] = first.theta
        result = Attempt()
        if wp.static(velocity_weights[0] != 0.0):
            result.friction = wp.static(wp.float64(velocity_weights[0])) * first.friction
            result.damping = wp.static(wp.float64(velocity_weights[0])) * first.damping
        row = wp.static(rows[1])(link, h, ax, ay, at)
        error = ZERO
        scale = ONE
        eu = ZERO
        ev = ZERO
        ew = ZERO
        for s in range(1, wp.static(stages)):
            there = Link()
            there.x = row.x
            there.y = row.y
            arm_x, arm_y = turned(link.arm_x, link.arm_y, row.turn)
            there.arm_x = arm_x
            there.arm_y = arm_y
            if wp.static(velocity[s][s - 1] != 0.0):
                row.u += wp.static(wp.float64(velocity[s][s - 1])) * ax[s - 1]
                row.v += wp.static(wp.float64(velocity[s][s - 1])) * ay[s - 1]
                row.omega += wp.static(wp.float64(velocity[s][s - 1])) * at[s - 1]
            there.u = link.u + h * row.u
            there.v = link.v + h * row.v
            there.omega = link.omega + h * row.omega
            next_end = exchange_ends(ends, place, there)
            # what does not depend on this stage is evaluated while its friction is
            if wp.static(s < last or not reuses_last):
                row = wp.static(rows[s + 1])(link, h, ax, ay, at)
            if wp.static(s == last):
                ex = ZERO
                ey = ZERO
                et = ZERO
                for j in range(wp.static(last)):
                    if wp.static(velocity_errors[j] != 0.0):
                        eu += wp.static(wp.float64(velocity_errors[j])) * ax[j]
                        ev += wp.static(wp.float64(velocity_errors[j])) * ay[j]
                        ew += wp.static(wp.float64(velocity_errors[j])) * at[j]
                    if wp.static(position_errors[j] != 0.0):
                        ex += wp.static(wp.float64(position_errors[j])) * ax[j]
                        ey += wp.static(wp.float64(position_errors[j])) * ay[j]
                        et += wp.static(wp.float64(position_errors[j])) * at[j]
                theta = K[THETA, lane]
                error, scale = greatest_position_error(link, theta, h, h * h * ex, h * h * ey, h * h * et)
                result.x = row.x
                result.y = row.y
                result.theta = theta + row.turn
                result.turns_far = wp.abs(row.turn) > LARGEST_TURN
                new_cosine, new_sine = cos_sin(result.theta)
                result.cosine = new_cosine
                result.sine = new_sine
                if wp.static(reuses_last):
                    write_proximity(K, maxima, place, ground, there, next_end)
            rates = stage(forces, K, place, next_end, there, inverse_mass, inverse_inertia)
            if wp.static(s == last and reuses_last):
                result.proximity = read_proximity(maxima)
            ax[s] = rates.x
            ay[s] = rates.y
            at[s] = rates.theta
            if wp.static(velocity_weights[s] != 0.0):
                result.friction += wp.static(wp.float64(velocity_weights[s])) * rates.friction
                result.damping += wp.static(wp.float64(velocity_weights[s])) * rates.damping
            if wp.static(s == last):
                result.last = rates
        link = read_link(K, lane)  # read again, so that its registers were free meanwhile
        if wp.static(not reuses_last and velocity_weights[last] != 0.0):
            row.u += wp.static(wp.float64(velocity_weights[last])) * result.last.x
            row.v += wp.static(wp.float64(velocity_weights[last])) * result.last.y
            row.omega += wp.static(wp.float64(velocity_weights[last])) * result.last.theta
        result.u = link.u + h * row.u
        result.v = link.v + h * row.v
        result.omega = link.omega + h * row.omega
        if wp.static(velocity_errors[last] != 0.0):
            eu += wp.static(wp.float64(velocity_errors[last])) * result.last.x
            ev += wp.static(wp.float64(velocity_errors[last])) * result.last.y
            ew += wp.static(wp.float64(velocity_errors[last])) * result.last.theta
        error_v, scale_v = greatest_velocity_error(link, read_first_stage(K, lane), h, h * eu, h * ev, h * ew)
        error, scale = greater(error, scale, error_v, scale_v)
        result.error = error
        result.scale = scale
        return result

    return attempt
