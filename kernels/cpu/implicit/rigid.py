"""Rigid joints: the limit k → ∞, without oscillating springs, where the motion of the chain alone limits steps.

A rigid joint has the opening C = 0 and Ċ = 0 at all times. The joint forces F follow from C̈ = 0, which is S F = r. For
joint i between link i (l) and link i + 1 (r), with u the direction of a link, t = ẑ × u and 𝟙 the unit matrix,

    S_ii = (1/m_l + 1/m_r) 𝟙 + a² (t_l t_lᵀ/I_l + t_r t_rᵀ/I_r),    S_i,i+1 = −1/m_r 𝟙 + a² t_r t_rᵀ/I_r,
    r_i = a (u_l ω_l² + u_r ω_r²) − a (t_l α_l + t_r α_r).

α_i = (f_i−1 − f_i)/I_i is the angular acceleration of link i by the friction torques f of its joints alone. S is
symmetric, positive definite and cyclic block-tridiagonal. The same matrix projects: impulses P with S P = Ċ remove the
opening rates; displacements by P with S P = C remove the openings. Both projections are orthogonal in the metric of the
masses. As they act between two links, they keep momentum and centre of mass.

Memory is in the order of :mod:`cpu.implicit.solver`, see :mod:`cpu.implicit.rigid_layout`.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.cpu.implicit import rigid_layout as at
from warpchain.kernels.cpu.implicit.rigid_layout import BASE, COSINE, FREE, INVERSE_INERTIA, INVERSE_MASS, SINE, SPIN
from warpchain.kernels.cpu.implicit.solver import cyclic_solver, end_column, link_at, segment_places
from warpchain.kernels.layout import X
from warpchain.kernels.physics.elementary import HALF, ONE, ZERO, cos_sin, order_bits
from warpchain.kernels.physics.geometry import Link, put, three, two
from warpchain.kernels.physics.joint import friction_torque
from warpchain.kernels.physics.load import weight
from warpchain.kernels.physics.rigid_joint import inward_pull, turning_share
from warpchain.kernels.types import Chain, Rows

CLOSED = wp.constant(wp.float64(1e-11))
"""Opening [m] below which a joint counts as closed; a spring of 1e9 N/m has 1e-2 N there."""
MOST_CORRECTIONS = 5
GREATEST_RINGING = wp.constant(wp.float64(1e-5))
"""Part of the kinetic energy that the projection may take; more means that springs still oscillate.

It takes the energy of long waves round the loop, which the dampers would take a little later. In walks at Table 1's
values the projections take 0.2 (60 links) to 0.4 % (150) of the energy in all. Together with the dampers' part that is
as much as with 1e-6 here, in less than half of the steps before a loop of 150 links collapses. 1e-4 would save another
quarter of all steps of its walk, and take 1.2 %.
"""
GREATEST_STRETCHING = wp.constant(wp.float64(3e-4))
"""Part of the kinetic energy that springs may hold and still count as rigid.

In a loop turning at a speed v that part is m v²/(k ℓ²), the relative stretch: 7e-5 for k = 1e7 N/m at 5 m/s. Where the
links of a loop lie on one line, S is singular, and unbounded forces would be handed to the springs.
"""


LOWER, DIAGONAL, UPPER = (at.FORCES.submatrix(k) for k in range(3))
RIGHT = at.FORCES.right
factor, solve = cyclic_solver(at.FORCES)


@wp.func
def load(S: Rows, K: Rows, chain: Chain):
    """Copies the state and the constants of links and joints from the scratch K."""
    c = int(8)
    while c < end_column(chain):
        i, is_copy = link_at(c, chain.link_count)
        for k in range(6):
            S[BASE + k, c] = K[X + k, i]
            S[at.MASS + k, c] = K[layout.MASS + k, i]
        S[at.COUNTED, c] = wp.where(is_copy, ZERO, ONE)
        c += 1
    at.pad_behind(S, INVERSE_MASS, 2, chain)


@wp.func
def store(S: Rows, K: Rows, chain: Chain):
    """Copies the state to the scratch K."""
    c = int(8)
    while c < end_column(chain):
        i, _is_copy = link_at(c, chain.link_count)
        for k in range(6):
            K[X + k, i] = S[BASE + k, c]
        c += 1


@wp.func
def factorise(S: Rows, chain: Chain):
    """Assembles and factorises the matrix S for the present directions."""
    a = chain.half_length
    at.pad_behind(S, SPIN, 3, chain)
    c = int(8)
    while c < end_column(chain):
        m_left = S[INVERSE_MASS, c]
        m_right = S[INVERSE_MASS, c + 8]
        xx, xy, yy = turning_share(a, S[INVERSE_INERTIA, c], S[COSINE, c], S[SINE, c])
        after_xx, after_xy, after_yy = turning_share(a, S[INVERSE_INERTIA, c + 8], S[COSINE, c + 8], S[SINE, c + 8])
        cross = xy + after_xy
        put(S, DIAGONAL, c, wp.vec4d(m_left + m_right + xx + after_xx, cross, cross, m_left + m_right + yy + after_yy))
        put(S, LOWER, c, wp.vec4d(xx - m_left, xy, xy, yy - m_left))
        put(S, UPPER, c, wp.vec4d(after_xx - m_right, after_xy, after_xy, after_yy - m_right))
        c += 1
    places, full = segment_places(chain.link_count)
    factor(S, places, full)


@wp.func
def solve_joints(S: Rows, chain: Chain):
    """Solves with the last factors; the solution replaces the right-hand side."""
    places, full = segment_places(chain.link_count)
    solve(S, places, full)
    at.pad_joints(S, RIGHT, 2, chain)


@wp.func
def pushed_at(S: Rows, a: wp.float64, c: int):
    """M⁻¹ Gᵀ P of a link: how the last solution P (forces, impulses or displacements) changes x, y and θ."""
    left = two(S, RIGHT, c - 8)
    right = two(S, RIGHT, c)
    both = right + left
    lever = a * (S[COSINE, c] * both[1] - S[SINE, c] * both[0])
    pushed = (right - left) * S[INVERSE_MASS, c]
    return wp.vec3d(pushed[0], pushed[1], lever * S[INVERSE_INERTIA, c])


@wp.func
def push(S: Rows, row: int, chain: Chain):
    """Adds the changes by the last solution to places or velocities, three rows from this one on."""
    c = int(8)
    while c < end_column(chain):
        put(S, row, c, three(S, row, c) + pushed_at(S, chain.half_length, c))
        c += 1


@wp.func
def solve_forces(S: Rows, chain: Chain):
    """Joint forces and accelerations for the directions, spins and smoothing of a stage."""
    a = chain.half_length
    c = int(8)
    while c < end_column(chain):
        spin = S[SPIN, c] - S[SPIN, c + 8]
        S[at.TORQUE, c] = friction_torque(S[at.VISCOUS, c], S[at.COULOMB, c], spin, S[at.INVERSE_SMOOTHING, c])
        c += 1
    at.pad_joints(S, at.TORQUE, 1, chain)
    c = int(8)
    while c < end_column(chain):
        S[FREE, c] = (S[at.TORQUE, c - 8] - S[at.TORQUE, c]) * S[INVERSE_INERTIA, c]
        c += 1
    at.pad_behind(S, FREE, 1, chain)
    c = int(8)
    while c < end_column(chain):
        rx, ry = inward_pull(S[COSINE, c], S[SINE, c], S[SPIN, c], S[FREE, c])
        after_x, after_y = inward_pull(S[COSINE, c + 8], S[SINE, c + 8], S[SPIN, c + 8], S[FREE, c + 8])
        put(S, RIGHT, c, wp.vec2d(a * (rx + after_x), a * (ry + after_y)))
        c += 1
    solve_joints(S, chain)
    c = int(8)
    while c < end_column(chain):
        pushed = pushed_at(S, a, c)
        load_x, load_y, load_turn = weight(chain, c, Link(), S[INVERSE_MASS, c], S[INVERSE_INERTIA, c])
        put(S, at.RATE, c, wp.vec3d(pushed[0] + load_x, pushed[1] + load_y, S[FREE, c] + (pushed[2] + load_turn)))
        c += 1


@wp.func
def openings(S: Rows, chain: Chain):
    """Sets directions and spins of the state and the right-hand side C; returns the greatest |C| [m]."""
    a = chain.half_length
    c = int(8)
    while c < end_column(chain):
        cosine, sine = cos_sin(S[BASE + 2, c])
        put(S, SPIN, c, wp.vec3d(S[BASE + 5, c], cosine, sine))
        c += 1
    at.pad_behind(S, SPIN, 3, chain)
    at.pad_behind(S, BASE, 2, chain)
    greatest = wp.int64(0)
    c = int(8)
    while c < end_column(chain):
        opening = (two(S, BASE, c + 8) - two(S, BASE, c)) - a * (two(S, COSINE, c + 8) + two(S, COSINE, c))
        put(S, RIGHT, c, opening)
        greatest = wp.max(greatest, order_bits(opening[0] * opening[0] + opening[1] * opening[1]))
        c += 1
    return wp.sqrt(wp.cast(greatest, wp.float64))


@wp.func
def opening_rates(S: Rows, chain: Chain):
    """Sets the right-hand side to Ċ."""
    a = chain.half_length
    at.pad_behind(S, BASE + 3, 3, chain)
    c = int(8)
    while c < end_column(chain):
        turn_x = S[SPIN, c] * S[SINE, c] + S[SPIN, c + 8] * S[SINE, c + 8]
        turn_y = S[SPIN, c] * S[COSINE, c] + S[SPIN, c + 8] * S[COSINE, c + 8]
        cu = S[BASE + 3, c + 8] - S[BASE + 3, c] + a * turn_x
        cv = S[BASE + 4, c + 8] - S[BASE + 4, c] - a * turn_y
        put(S, RIGHT, c, wp.vec2d(cu, cv))
        c += 1


@wp.func
def sum_of_squares(S: Rows, row: int, chain: Chain):
    """Σ (x² + y²) over the joints, of vectors in this row and the next."""
    total = ZERO
    c = int(8)
    while c < end_column(chain):
        vector = two(S, row, c)
        total += S[at.COUNTED, c] * (vector[0] * vector[0] + vector[1] * vector[1])
        c += 1
    return total


@wp.func
def stretching(S: Rows, chain: Chain):
    """Energy [J] of springs that are open by the right-hand side."""
    return HALF * chain.joint_stiffness * sum_of_squares(S, RIGHT, chain)


@wp.func
def begin(S: Rows, chain: Chain):
    """Joint forces and accelerations of a state that has been closed, with the chain's own smoothing."""
    c = int(8)
    while c < end_column(chain):
        S[at.INVERSE_SMOOTHING, c] = chain.inverse_smoothing
        c += 1
    solve_forces(S, chain)
    c = int(8)
    while c < end_column(chain):
        put(S, at.FORCE, c, two(S, RIGHT, c))
        put(S, at.BASE_RATE, c, three(S, at.RATE, c))
        c += 1


@wp.func
def kinetic_energy(S: Rows, chain: Chain):
    """Kinetic energy of the state [J]."""
    total = ZERO
    c = int(8)
    while c < end_column(chain):
        u = S[BASE + 3, c]
        v = S[BASE + 4, c]
        w = S[BASE + 5, c]
        total += S[at.COUNTED, c] * (S[at.MASS, c] * (u * u + v * v) + S[at.INERTIA, c] * w * w)
        c += 1
    return HALF * total


@wp.func
def are_stiff(S: Rows, chain: Chain):
    """Whether springs would hold so little energy with the state's joint forces that they count as rigid."""
    held = HALF * sum_of_squares(S, at.FORCE, chain) / chain.joint_stiffness
    return held <= GREATEST_STRETCHING * kinetic_energy(S, chain)


@functools.cache
def closing(columns: int, first_row: int):
    """Warp function ``close(K, chain)`` for rows from ``first_row`` on, in scratch of this width.

    It projects the state on C = 0 (to rounding) and Ċ = 0, and returns False if the joints could not be closed. clang
    does not inline it: its loops vectorise only because the static shape of the rows is given in it again.
    """
    rows = at.segment_rows(columns, first_row)

    @wp.func
    def close(K: Rows, chain: Chain):
        S = rows(K)
        corrections = int(0)
        widest = openings(S, chain)
        factorise(S, chain)
        while widest > CLOSED and corrections < MOST_CORRECTIONS:
            solve_joints(S, chain)
            push(S, BASE, chain)
            widest = openings(S, chain)
            factorise(S, chain)
            corrections += 1
        opening_rates(S, chain)
        solve_joints(S, chain)
        push(S, BASE + 3, chain)
        c = int(8)
        while c < end_column(chain):
            S[SPIN, c] = S[BASE + 5, c]
            c += 1
        at.pad_behind(S, SPIN, 3, chain)
        return widest <= CLOSED

    return close
