"""Rosenbrock methods in the block form: one thread per link, the linear systems by :mod:`gpu.solver`.

The equations are those of :mod:`cpu.implicit.rosenbrock`, with a stage's change of place divided by g = hγ: Z = U_q / g
solves

    (M + g D + g² K) Z = M (r_q + r_v) + g D r_q,   U_v = Z − r_q,

with r_q = v + γ Σ C Z and r_v = g M⁻¹ Q + γ Σ C U_v at the stage's place. The product D r_q is what dampers and
friction would do to the start of the step if its velocities were r_q, so it rides on the exchange of the joint forces:
a stage costs two barriers and a solution. Angles are multiplied by half a link length in the system, which makes the
couplings of links free of it:

    D_i = diag(m + 2σ, m + 2σ, I/a² + 2σ + g (φ_i + φ_i₋₁)/a² + g² u·(F_i + F_i₋₁)/a),
    U_i = −(1; t_iᵀ) (σ, −c_i₊₁) − g φ_i/a²,    L_i = −(1; −t_iᵀ) (σ, c_i₋₁) − g φ_i₋₁/a²,

with σ = g b + g² k, c = σ t − g² b ω u and φ of :func:`friction_secant`, in the corner of the angles. A stage's joints
open by what they do at the start plus the change, for the reason that :mod:`cpu.implicit.rosenbrock_system` gives.
"""

import functools

import warp as wp

from warpchain.kernels.cpu.implicit.rosenbrock import GREATEST_TURN
from warpchain.kernels.cpu.implicit.rosenbrock_system import friction_secant
from warpchain.kernels.cpu.implicit.solver import block_type
from warpchain.kernels.gpu.factors import FactorLayout, reductions_for
from warpchain.kernels.gpu.solver import block_solver
from warpchain.kernels.gpu.stage import (
    Place,
    Trial,
    block_stage,
    direction_on,
    first_on,
    greatest_error,
    joint_constants,
    link_on,
    vec3d,
    vec5d,
)
from warpchain.kernels.gpu.threads import barrier, constant_table, read, write
from warpchain.kernels.layout import (
    BOARD_FIRST,
    BOARD_NOTES,
    INERTIA,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LEFT_X,
    LEFT_Y,
    MASS,
    NOTE_GRAVITY,
    RIGHT_X,
    RIGHT_Y,
    THETA,
    X,
    Y,
)
from warpchain.kernels.methods.rosenbrock_tableaus import ROSENBROCK_TABLES
from warpchain.kernels.physics.elementary import ONE, TWO, ZERO, cos_sin, versine_sine
from warpchain.kernels.physics.geometry import end_positions, end_velocities
from warpchain.kernels.physics.joint import friction_slope, friction_torque, joint_force, link_acceleration

wp.set_module_options({"enable_backward": False})

mat33d = block_type(3)

# Numbers of a link from which its couplings are made: t, c, g φ/a² of its right joint; and one more that a link hands
# to the one before: the spin of the velocities r_q.
NORMAL_X, NORMAL_Y, COLUMN_X, COLUMN_Y, SLOPE, SHIFT_SPIN = 0, 1, 2, 3, 4, 5
LINK_NUMBERS = 6
# Rows of the board that are free between two contact passes. With its left end a link hands to the link before that
# end's velocity by r_q, and with the force of its right joint to the link behind what the damper does with r_q.
SHIFT_U, SHIFT_V = LEFT_X, LEFT_Y
DAMPER_X, DAMPER_Y = RIGHT_X, RIGHT_Y


@functools.cache
def factor_layout(block_dim: int) -> FactorLayout:
    """Where the factors of a block of this size lie in its shared memory."""
    return FactorLayout(block_dim=block_dim, reductions=reductions_for(block_dim), link_numbers=LINK_NUMBERS)


MATRIX, COUPLINGS, QUADRATURE = 0, 1, 2


@functools.cache
def coefficients(name: str):
    """Warp function ``coefficient(kind, i, j)``: A_ij, γ C_ij, or w_i for any j, zero where a table has none.

    Read from memory by all threads at once, so that the stages are one loop: unrolled, a kernel is six times as long
    and waits for its instructions.
    """
    table = ROSENBROCK_TABLES[name]
    rows = []
    for matrix, scale in ((table.matrix, 1.0), (table.couplings, table.gamma)):
        for row in matrix:
            rows.append([scale * entry for entry in row] + [0.0] * (table.stages - len(row)))
    rows.extend([weight] * table.stages for weight in table.quadrature)
    entry_of = constant_table(tuple(map(tuple, rows)))
    stages = table.stages

    @wp.func
    def coefficient(kind: int, i: int, j: int):
        return entry_of(wp.static(stages) * kind + i, j)

    return coefficient


@wp.func
def hand(K: wp.array2d(dtype=wp.float64), row: int, lane: int, value: wp.float64):
    """Puts a number on the board."""
    write(K.ptr, row * K.shape[1] + lane, value)


@wp.func
def handed(K: wp.array2d(dtype=wp.float64), row: int, lane: int):
    """A number on the board."""
    return read(K.ptr, row * K.shape[1] + lane)


@wp.func
def coupling(
    side: wp.float64,
    sigma: wp.float64,
    normal_x: wp.float64,
    normal_y: wp.float64,
    column_x: wp.float64,
    column_y: wp.float64,
    slope: wp.float64,
) -> mat33d:
    """Block by which a link's row is coupled to the link behind (side 1) or before (side −1).

    Args:
        side: 1 or −1.
        sigma: σ.
        normal_x: t of the row's link …
        normal_y: … likewise.
        column_x: c of the other link …
        column_y: … likewise.
        slope: g φ/a² of the joint between them.
    """
    return mat33d(
        -sigma,
        ZERO,
        side * column_x,
        ZERO,
        -sigma,
        side * column_y,
        -side * sigma * normal_x,
        -side * sigma * normal_y,
        normal_x * column_x + normal_y * column_y - slope,
    )


@functools.cache
def rosenbrock_attempt(name: str, block_dim: int):
    """Warp function that attempts a step with a Rosenbrock method in blocks of this size.

    Args:
        name: Key of :data:`ROSENBROCK_TABLES`.
        block_dim: Threads in a block.

    Returns:
        ``attempt(ends, forces, maxima, S, K, place, h, tolerance)`` → Trial, from the state and first stage on the
        board, with S the block's memory for the linear systems, laid out by :func:`factor_layout`.
    """
    table = ROSENBROCK_TABLES[name]
    stages, gamma = table.stages, table.gamma
    quadrature = table.quadrature
    coefficient = coefficients(name)
    memory = factor_layout(block_dim)
    exchange_ends, _stage = block_stage(block_dim)
    Stages = wp.types.vector(length=stages - 1, dtype=wp.float64)

    @wp.func
    def couplings_of(S: wp.uint64, n: int, link: int, sigma: wp.float64):
        before = wp.where(link == 0, n - 1, link - 1)
        after = wp.where(link == n - 1, 0, link + 1)
        normal_x = read(S, wp.static(NORMAL_X * block_dim) + link)
        normal_y = read(S, wp.static(NORMAL_Y * block_dim) + link)
        lower = coupling(
            -ONE,
            sigma,
            normal_x,
            normal_y,
            read(S, wp.static(COLUMN_X * block_dim) + before),
            read(S, wp.static(COLUMN_Y * block_dim) + before),
            read(S, wp.static(SLOPE * block_dim) + before),
        )
        upper = coupling(
            ONE,
            sigma,
            normal_x,
            normal_y,
            read(S, wp.static(COLUMN_X * block_dim) + after),
            read(S, wp.static(COLUMN_Y * block_dim) + after),
            read(S, wp.static(SLOPE * block_dim) + link),
        )
        return lower, upper

    factor, solve = block_solver(memory, couplings_of)

    @wp.func
    def attempt(
        ends: wp.tile[vec5d, block_dim],
        forces: wp.tile[vec3d, block_dim],
        maxima: wp.uint64,
        S: wp.uint64,
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        h: wp.float64,
        tolerance: wp.float64,
    ):
        lane = place.lane
        column = place.column
        n = place.links
        # the joint at the start of the step, as it enters the system
        chain = joint_constants(K)
        inverse_length = ONE / chain.half_length
        g = wp.static(wp.float64(gamma)) * h
        link = link_on(K, lane)
        start_cosine, start_sine = direction_on(K, lane)
        first = first_on(K, lane)
        next_end = exchange_ends(ends, place, link)
        _left_x, _left_y, right_x, right_y = end_positions(link.x, link.y, link.arm_x, link.arm_y)
        _left_u, _left_v, right_u, right_v = end_velocities(link.u, link.v, link.omega, link.arm_x, link.arm_y)
        base_cu = next_end[2] - right_u
        base_cv = next_end[3] - right_v
        base_spin = link.omega - next_end[4]
        opening_x = next_end[0] - right_x
        opening_y = next_end[1] - right_y
        force_x = joint_force(chain, opening_x, base_cu)
        force_y = joint_force(chain, opening_y, base_cv)
        power_slope = friction_torque(chain, base_spin)
        slope = friction_secant(
            chain,
            friction_slope(chain, base_spin),
            power_slope,
            base_spin,
            first.theta - K[BOARD_FIRST + 2, place.after],
            link.omega,
            h,
            tolerance,
        )
        torque = slope * base_spin
        power_slope += torque
        sigma = g * (chain.joint_damping + g * chain.joint_stiffness)
        turning = g * g * chain.joint_damping * link.omega
        own_slope = g * slope * inverse_length * inverse_length
        damper_x = chain.joint_damping * base_cu
        damper_y = chain.joint_damping * base_cv
        write(S, wp.static(SLOPE * block_dim) + lane, own_slope)
        if lane < n:
            hand(K, DAMPER_X, lane, damper_x)
            hand(K, DAMPER_Y, lane, damper_y)
        forces[lane] = vec3d(force_x, force_y, torque)
        before = place.before
        pull = forces[before]
        tension = start_cosine * (force_x + pull[0]) + start_sine * (force_y + pull[1])
        own_angle = K[INERTIA, column] * inverse_length * inverse_length + TWO * sigma
        own_angle += own_slope + read(S, wp.static(SLOPE * block_dim) + before) + g * g * inverse_length * tension
        write(S, wp.static(NORMAL_X * block_dim) + lane, -start_sine)
        write(S, wp.static(NORMAL_Y * block_dim) + lane, start_cosine)
        write(S, wp.static(COLUMN_X * block_dim) + lane, -sigma * start_sine - turning * start_cosine)
        write(S, wp.static(COLUMN_Y * block_dim) + lane, sigma * start_cosine - turning * start_sine)
        own_place = K[MASS, column] + TWO * sigma
        # accelerations less what the dampers do with r_q, which are the velocities in the first stage
        chain.gravity = ZERO
        ax, ay, at = link_acceleration(
            chain,
            K[INVERSE_MASS, column],
            K[INVERSE_INERTIA, column],
            link.arm_x,
            link.arm_y,
            handed(K, DAMPER_X, before),
            handed(K, DAMPER_Y, before),
            damper_x,
            damper_y,
            pull[2],
            torque,
        )
        ax = first.x - ax
        ay = first.y - ay
        at = first.theta - at
        friction = wp.static(wp.float64(quadrature[0])) * first.friction
        damping = wp.static(wp.float64(quadrature[0])) * first.damping
        pivot = factor(S, n, lane, vec3d(own_place, own_place, own_angle), sigma)
        barrier()

        trial = Trial()
        zx = Stages()
        zy = Stages()
        zt = Stages()
        ux = Stages()
        uy = Stages()
        ut = Stages()
        # Σ w U, of which the lost power needs no more
        lost_turn = ZERO
        lost_u = ZERO
        lost_v = ZERO
        lost_omega = ZERO
        i = int(0)
        while i < wp.static(stages):
            # the stage's place, r_q and γ Σ C U_v
            dx = ZERO
            dy = ZERO
            turn = ZERO
            u = link.u
            v = link.v
            omega = link.omega
            rx = ZERO
            ry = ZERO
            rt = ZERO
            sx = ZERO
            sy = ZERO
            st = ZERO
            for j in range(wp.static(stages - 1)):
                weight = coefficient(MATRIX, i, j)
                dx += weight * zx[j]
                dy += weight * zy[j]
                turn += weight * zt[j]
                u += weight * ux[j]
                v += weight * uy[j]
                omega += weight * ut[j]
                weight = coefficient(COUPLINGS, i, j)
                rx += weight * zx[j]
                ry += weight * zy[j]
                rt += weight * zt[j]
                sx += weight * ux[j]
                sy += weight * uy[j]
                st += weight * ut[j]
            dx = g * dx
            dy = g * dy
            turn = g * turn
            rx += u
            ry += v
            rt += omega
            weight = coefficient(QUADRATURE, i, 0)
            if i > 0:
                constants = joint_constants(K)
                a = constants.half_length
                versine, sine = versine_sine(turn)
                turn_x = -(start_cosine * versine + start_sine * sine)
                turn_y = start_cosine * sine - start_sine * versine
                cosine = start_cosine + turn_x
                sine = start_sine + turn_y
                left_x, left_y, right_x, right_y = end_positions(dx, dy, a * turn_x, a * turn_y)
                left_u, left_v, right_u, right_v = end_velocities(u, v, a * omega, cosine, sine)
                shift_left_u, shift_left_v, shift_u, shift_v = end_velocities(rx, ry, rt, link.arm_x, link.arm_y)
                write(S, wp.static(SHIFT_SPIN * block_dim) + lane, rt)
                if lane < n:
                    hand(K, SHIFT_U, lane, shift_left_u)
                    hand(K, SHIFT_V, lane, shift_left_v)
                after = place.after
                ends[lane] = vec5d(left_x, left_y, left_u, left_v, omega)
                next_end = ends[after]
                cu = next_end[2] - right_u
                cv = next_end[3] - right_v
                spin = omega - next_end[4]
                force_x = joint_force(constants, opening_x + (next_end[0] - right_x), cu)
                force_y = joint_force(constants, opening_y + (next_end[1] - right_y), cv)
                torque = friction_torque(constants, spin)
                friction += weight * (torque * spin)
                damping += weight * (cu * cu + cv * cv)
                torque -= slope * (rt - read(S, wp.static(SHIFT_SPIN * block_dim) + after))
                damper_x = constants.joint_damping * (handed(K, SHIFT_U, after) - shift_u)
                damper_y = constants.joint_damping * (handed(K, SHIFT_V, after) - shift_v)
                if lane < n:
                    hand(K, DAMPER_X, lane, damper_x)
                    hand(K, DAMPER_Y, lane, damper_y)
                forces[lane] = vec3d(force_x, force_y, torque)
                pull = forces[before]
                constants.gravity = K[BOARD_NOTES, NOTE_GRAVITY]
                inverse_mass = K[INVERSE_MASS, column]
                inverse_inertia = K[INVERSE_INERTIA, column]
                ax, ay, at = link_acceleration(
                    constants,
                    inverse_mass,
                    inverse_inertia,
                    a * cosine,
                    a * sine,
                    pull[0],
                    pull[1],
                    force_x,
                    force_y,
                    pull[2],
                    torque,
                )
                constants.gravity = ZERO
                bx, by, bt = link_acceleration(
                    constants,
                    inverse_mass,
                    inverse_inertia,
                    link.arm_x,
                    link.arm_y,
                    handed(K, DAMPER_X, before),
                    handed(K, DAMPER_Y, before),
                    damper_x,
                    damper_y,
                    ZERO,
                    ZERO,
                )
                ax -= bx
                ay -= by
                at -= bt
            right = vec3d(
                K[MASS, column] * (sx + rx + g * ax),
                K[MASS, column] * (sy + ry + g * ay),
                K[INERTIA, column] * inverse_length * (st + rt + g * at),
            )
            z = solve(S, n, lane, sigma, pivot, right)
            z[2] = z[2] * inverse_length
            du = z[0] - rx
            dv = z[1] - ry
            dw = z[2] - rt
            for j in range(wp.static(stages - 1)):
                if i == j:
                    zx[j] = z[0]
                    zy[j] = z[1]
                    zt[j] = z[2]
                    ux[j] = du
                    uy[j] = dv
                    ut[j] = dw
            lost_turn += weight * z[2]
            lost_u += weight * du
            lost_v += weight * dv
            lost_omega += weight * dw
            i += 1
            if i == wp.static(stages):
                # the last change is the error, too
                theta = K[THETA, lane]
                turn += g * z[2]
                link.x = K[X, lane]
                link.y = K[Y, lane]
                trial.x = link.x + (dx + g * z[0])
                trial.y = link.y + (dy + g * z[1])
                trial.theta = theta + turn
                trial.u = u + du
                trial.v = v + dv
                trial.omega = omega + dw
                trial.turns_far = wp.abs(turn) > GREATEST_TURN
                new_cosine, new_sine = cos_sin(trial.theta)
                trial.cosine = new_cosine
                trial.sine = new_sine
                error, scale = greatest_error(link, theta, first, h, g * z[0], g * z[1], g * z[2], du, dv, dw)
                trial.error = error
                trial.scale = scale
        # lost power: how the joint's spin and opening rate change by Σ w U
        left_u, left_v, right_u, right_v = end_velocities(lost_u, lost_v, lost_omega, link.arm_x, link.arm_y)
        swing = link.omega * g * lost_turn
        ends[lane] = vec5d(ZERO, ZERO, left_u + swing * link.arm_x, left_v + swing * link.arm_y, lost_omega)
        change = ends[place.after]
        cu = change[2] - (right_u - swing * link.arm_x)
        cv = change[3] - (right_v - swing * link.arm_y)
        trial.friction = friction + power_slope * (lost_omega - change[4])
        trial.damping = damping + TWO * (base_cu * cu + base_cv * cv)
        return trial

    return attempt
