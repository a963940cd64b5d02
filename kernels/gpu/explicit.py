"""Embedded explicit Runge–Kutta methods on a GPU: one thread per link, stages in registers.

Stages of the same tableaus as in :mod:`cpu.increments`, in double precision. In every stage the threads wait for the
friction of their joints. Meanwhile they evaluate their places in the next stage, which in the Nyström form do not
depend on the present one. In a last stage at the new state they evaluate its proximity instead.
"""

import functools
from typing import Any

import warp as wp

from warpchain.kernels.features import Features
from warpchain.kernels.gpu.stage import Attempt, Run, block_stage, read_first_stage, read_link, vec3d, vec5d
from warpchain.kernels.layout import INVERSE_INERTIA, INVERSE_MASS, THETA
from warpchain.kernels.methods.controller import error_scale
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.physics.elementary import LARGEST_TURN, ONE, ZERO, cos_sin
from warpchain.kernels.physics.geometry import Link, turned


@wp.struct
class Ahead:
    """A stage, or the new state, as far as it is known before the preceding stage."""

    x: wp.float64  # [m]
    y: wp.float64  # [m]
    turn: wp.float64  # since the step began [rad]
    sums: vec3d  # Σ a_ij k_j so far, without the term of the preceding stage


@wp.func
def greater(error_a: wp.float64, scale_a: wp.float64, error_b: wp.float64, scale_b: wp.float64):
    """The greater of two quotients |error| / scale with positive scales; a NaN is the greatest."""
    keeps_a = wp.abs(error_a) * scale_b >= wp.abs(error_b) * scale_a or error_a != error_a
    return wp.where(keeps_a, error_a, error_b), wp.where(keeps_a, scale_a, scale_b)


@wp.func
def velocity_of(link: Link) -> vec3d:
    """ẋ, ẏ [m/s] and θ̇ [rad/s] of a link."""
    return vec3d(link.u, link.v, link.omega)


@wp.func
def greatest_of_three(error: vec3d, value: vec3d, rate: vec3d, h: wp.float64):
    """The greatest of the errors of three values with these rates over their scales, as numerator and divisor.

    Quotients are compared by cross-multiplication, so that a single division remains.
    """
    top = error[0]
    scale = error_scale(value[0], rate[0], h)
    for k in range(1, 3):
        top, scale = greater(top, scale, error[k], error_scale(value[k], rate[k], h))
    return top, scale


@functools.cache
def explicit_attempt(features: Features, block_dim: int, write_proximity: Any, read_proximity: Any):
    """Warp function ``attempt(ends, forces, run, h)`` → Attempt, from the state and first stage on the board."""
    tableau = find_method(features.method).tableau
    stages, last = tableau.stages, tableau.stages - 1
    reuses_last = tableau.first_same_as_last
    velocity_weights = tableau.velocity_weights
    velocity_errors, position_errors = tableau.velocity_errors, tableau.position_errors
    # the new state is one more row of the tableau
    velocity = (*tableau.velocity, velocity_weights)
    position = (*tableau.position, tableau.position_weights)
    nodes = (*tableau.nodes, 1.0)
    exchange_ends, stage = block_stage(features, block_dim)
    Stages = wp.types.matrix(shape=(stages, 3), dtype=wp.float64)

    def ahead_of(s: int):
        """Warp function ``ahead(link, h, rates)`` → Ahead of row s, from the accelerations before row s − 1."""

        @wp.func
        def ahead(link: Link, h: wp.float64, rates: Stages):
            sums = vec3d()
            moved = vec3d()
            for j in range(wp.static(s - 1)):
                if wp.static(velocity[s][j] != 0.0):
                    sums += wp.static(wp.float64(velocity[s][j])) * rates[j]
                if wp.static(position[s][j] != 0.0):
                    moved += wp.static(wp.float64(position[s][j])) * rates[j]
            moved = wp.static(wp.float64(nodes[s])) * h * velocity_of(link) + h * h * moved
            return Ahead(link.x + moved[0], link.y + moved[1], moved[2], sums)

        return ahead

    rows = [None, *map(ahead_of, range(1, stages + 1))]

    @wp.func
    def attempt(ends: wp.tile[vec5d, block_dim], forces: wp.tile[vec3d, block_dim], run: Run, h: wp.float64):
        K = run.K
        lane = run.lane
        rates = Stages()
        link = read_link(K, lane)
        inverse_mass = K[INVERSE_MASS, run.column]
        inverse_inertia = K[INVERSE_INERTIA, run.column]
        first = read_first_stage(K, lane)
        rates[0] = vec3d(first[0], first[1], first[2])
        result = Attempt()
        if wp.static(velocity_weights[0] != 0.0):
            result.friction = wp.static(wp.float64(velocity_weights[0])) * first[3]
            result.damping = wp.static(wp.float64(velocity_weights[0])) * first[4]
        row = wp.static(rows[1])(link, h, rates)
        error = ZERO
        scale = ONE
        sums = vec3d()
        velocity_error = vec3d()
        for s in range(1, wp.static(stages)):
            arm_x, arm_y = turned(link.arm_x, link.arm_y, row.turn)
            sums = row.sums
            if wp.static(velocity[s][s - 1] != 0.0):
                sums += wp.static(wp.float64(velocity[s][s - 1])) * rates[s - 1]
            rate = velocity_of(link) + h * sums
            there = Link(row.x, row.y, rate[0], rate[1], rate[2], arm_x, arm_y)
            next_end = exchange_ends(ends, run, there)
            # what does not depend on this stage is evaluated while its friction is
            if wp.static(s < last or not reuses_last):
                row = wp.static(rows[s + 1])(link, h, rates)
            if wp.static(s == last):
                position_error = vec3d()
                for j in range(wp.static(last)):
                    if wp.static(velocity_errors[j] != 0.0):
                        velocity_error += wp.static(wp.float64(velocity_errors[j])) * rates[j]
                    if wp.static(position_errors[j] != 0.0):
                        position_error += wp.static(wp.float64(position_errors[j])) * rates[j]
                theta = K[THETA, lane]
                place = vec3d(link.x, link.y, theta)
                error, scale = greatest_of_three(h * h * position_error, place, velocity_of(link), h)
                result.place = vec3d(row.x, row.y, theta + row.turn)
                result.turns_far = wp.abs(row.turn) > LARGEST_TURN
                new_cosine, new_sine = cos_sin(theta + row.turn)
                result.cosine = new_cosine
                result.sine = new_sine
                if wp.static(reuses_last):
                    write_proximity(run, there, next_end)
            found = stage(forces, run, next_end, there, inverse_mass, inverse_inertia)
            if wp.static(s == last and reuses_last):
                result.proximity = read_proximity(run)
            rates[s] = vec3d(found[0], found[1], found[2])
            if wp.static(velocity_weights[s] != 0.0):
                result.friction += wp.static(wp.float64(velocity_weights[s])) * found[3]
                result.damping += wp.static(wp.float64(velocity_weights[s])) * found[4]
            if wp.static(s == last):
                result.last = found
        link = read_link(K, lane)  # read again, so that its registers were free meanwhile
        if wp.static(not reuses_last):
            sums = row.sums
            if wp.static(velocity_weights[last] != 0.0):
                sums += wp.static(wp.float64(velocity_weights[last])) * rates[wp.static(last)]
        result.velocity = velocity_of(link) + h * sums
        if wp.static(velocity_errors[last] != 0.0):
            velocity_error += wp.static(wp.float64(velocity_errors[last])) * rates[wp.static(last)]
        first = read_first_stage(K, lane)
        rate = vec3d(first[0], first[1], first[2])
        error_v, scale_v = greatest_of_three(h * velocity_error, velocity_of(link), rate, h)
        error, scale = greater(error, scale, error_v, scale_v)
        result.error = error
        result.scale = scale
        return result

    return attempt
