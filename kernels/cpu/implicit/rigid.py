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
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.cpu.implicit.rigid_layout import (
    BASE,
    BASE_RATE,
    COSINE,
    COULOMB,
    COUNTED,
    FORCE,
    FREE,
    INERTIA,
    INVERSE_INERTIA,
    INVERSE_MASS,
    INVERSE_SMOOTHING,
    MASS,
    RATE,
    ROWS_OF_RIGID,
    SINE,
    SPIN,
    TORQUE,
    VISCOUS,
    force_layout,
    pad_behind,
    pad_joints,
)
from warpchain.kernels.cpu.implicit.solver import LANES, cyclic_solver, link_at, place_column, row_at, segment_places
from warpchain.kernels.layout import STAGES, X
from warpchain.kernels.physics.elementary import HALF, ONE, ZERO, cos_sin, order_bits
from warpchain.kernels.physics.joint import friction_torque
from warpchain.kernels.physics.rigid_joint import inward_pull, opening_rate_of, pushed, turning_share
from warpchain.kernels.types import Chain, Rows

wp.set_module_options({"enable_backward": False})

CLOSED = wp.constant(wp.float64(1e-11))
"""Opening [m] below which a joint counts as closed; a spring of 1e9 N/m has 1e-2 N there."""
MOST_CORRECTIONS = 5
LINK_CONSTANTS = (MASS, INERTIA, INVERSE_MASS, INVERSE_INERTIA, VISCOUS, COULOMB)
CONSTANTS_OF_LINK = tuple(range(layout.MASS, layout.MASS + len(LINK_CONSTANTS)))
"""Rows of :mod:`layout` that hold the same."""
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


@dataclass(frozen=True)
class RigidJoints:
    """Warp functions on the rows S of :mod:`cpu.implicit.rigid_layout` and the separators' rows R.

    Attributes:
        load: Copies the state and the links' constants from the scratch.
        store: Copies the state to the scratch, and accelerations to where the step loop checks them.
        factorise: Assembles and factorises the matrix S for the present directions.
        solve_joints: Solves with the last factors; the solution replaces the right-hand side.
        solve_forces: Joint forces and accelerations for the directions, spins and smoothing of a stage.
        displace: Moves the links by the last solution.
        openings: Sets directions and spins of the state and the right-hand side C; returns the greatest |C| [m].
        stretching: Energy [J] of springs that are open by the right-hand side.
        close: Projects the state on C = 0 (to rounding) and Ċ = 0; returns False if the joints could not be closed.
        begin: Joint forces and accelerations of a state that ``close`` has left, with the chain's own smoothing.
        kinetic_energy: Of the state [J].
        are_stiff: Whether springs would hold so little energy with these forces that they count as rigid.
    """

    load: Any
    store: Any
    factorise: Any
    solve_joints: Any
    solve_forces: Any
    displace: Any
    openings: Any
    stretching: Any
    close: Any
    begin: Any
    kinetic_energy: Any
    are_stiff: Any


@functools.cache
def rigid_joints(columns: int) -> RigidJoints:
    """The functions of rigid joints for scratch of this width."""
    system = force_layout(columns)
    factor, solve = cyclic_solver(system)
    lower, diagonal, upper = (system.submatrix(k) for k in range(3))
    right, width, separator_rows = system.right, system.columns, system.separator_rows
    pad_constants = pad_behind((INVERSE_MASS, INVERSE_INERTIA))
    pad_directions = pad_behind((COSINE, SINE, SPIN))
    pad_free = pad_behind((FREE,))
    pad_places = pad_behind((BASE, BASE + 1))
    pad_rates = pad_behind((BASE + 3, BASE + 4, BASE + 5))
    pad_torques = pad_joints((TORQUE,))
    pad_solution = pad_joints((right, right + 1))

    @wp.func
    def load(S: Rows, K: Rows, chain: Chain):
        n = chain.link_count
        places, full, _ = segment_places(n)
        p = int(0)
        while p < places:
            s = int(0)
            while s < 8:
                i = link_at(p, s, places, full, n)
                c = 8 * p + 8 + s
                for k in range(6):
                    S[wp.static(BASE + k), c] = K[wp.static(X + k), i]
                for k in range(wp.static(len(LINK_CONSTANTS))):
                    S[wp.static(LINK_CONSTANTS[k]), c] = K[wp.static(CONSTANTS_OF_LINK[k]), i]
                repeats = (p == 0 and s >= full) or row_at(p, s, places, full) >= n
                S[COUNTED, c] = wp.where(repeats, ZERO, ONE)
                s += 1
            p += 1
        pad_constants(S, places, full)

    @wp.func
    def store(S: Rows, K: Rows, chain: Chain):
        n = chain.link_count
        places, full, _ = segment_places(n)
        p = int(0)
        while p < places:
            s = int(0)
            while s < 8:
                i = link_at(p, s, places, full, n)
                c = 8 * p + 8 + s
                for k in range(6):
                    K[wp.static(X + k), i] = S[wp.static(BASE + k), c]
                for k in range(3):
                    K[wp.static(STAGES + k), i] = S[wp.static(BASE_RATE + k), c]
                s += 1
            p += 1

    @wp.func
    def assemble(S: Rows, chain: Chain, places: int, full: int):
        a = chain.half_length
        pad_directions(S, places, full)
        end = place_column(places + 1)
        c = int(8)
        while c < end:
            repeats = c < 16 and c >= 8 + full
            m_left = S[INVERSE_MASS, c]
            m_right = S[INVERSE_MASS, c + 8]
            xx, xy, yy = turning_share(a, S[INVERSE_INERTIA, c], S[COSINE, c], S[SINE, c])
            after_xx, after_xy, after_yy = turning_share(a, S[INVERSE_INERTIA, c + 8], S[COSINE, c + 8], S[SINE, c + 8])
            S[wp.static(diagonal), c] = wp.where(repeats, ONE, m_left + m_right + xx + after_xx)
            S[wp.static(diagonal + 1), c] = wp.where(repeats, ZERO, xy + after_xy)
            S[wp.static(diagonal + 2), c] = wp.where(repeats, ZERO, xy + after_xy)
            S[wp.static(diagonal + 3), c] = wp.where(repeats, ONE, m_left + m_right + yy + after_yy)
            S[wp.static(lower), c] = wp.where(repeats, -ONE, xx - m_left)
            S[wp.static(lower + 1), c] = wp.where(repeats, ZERO, xy)
            S[wp.static(lower + 2), c] = wp.where(repeats, ZERO, xy)
            S[wp.static(lower + 3), c] = wp.where(repeats, -ONE, yy - m_left)
            S[wp.static(upper), c] = wp.where(repeats, ZERO, after_xx - m_right)
            S[wp.static(upper + 1), c] = wp.where(repeats, ZERO, after_xy)
            S[wp.static(upper + 2), c] = wp.where(repeats, ZERO, after_xy)
            S[wp.static(upper + 3), c] = wp.where(repeats, ZERO, after_yy - m_right)
            c += 1

    @wp.func
    def factorise(S: Rows, R: Rows, chain: Chain, places: int, full: int):
        assemble(S, chain, places, full)
        factor(S, R, places, full)

    @wp.func
    def solve_joints(S: Rows, R: Rows, places: int, full: int):
        solve(S, R, places)
        pad_solution(S, places, full)

    @wp.func
    def pushed_at(S: Rows, a: wp.float64, c: int):
        """Change of the link of a column by the last solution, forces or impulses of the joints."""
        ax, ay, turn = pushed(
            a,
            S[INVERSE_MASS, c],
            S[INVERSE_INERTIA, c],
            S[COSINE, c],
            S[SINE, c],
            S[wp.static(right), c - 8],
            S[wp.static(right + 1), c - 8],
            S[wp.static(right), c],
            S[wp.static(right + 1), c],
        )
        return ax, ay, turn

    @wp.func
    def solve_forces(S: Rows, R: Rows, chain: Chain, places: int, full: int):
        a = chain.half_length
        end = place_column(places + 1)
        c = int(8)
        while c < end:
            spin = S[SPIN, c] - S[SPIN, c + 8]
            S[TORQUE, c] = friction_torque(S[VISCOUS, c], S[COULOMB, c], spin, S[INVERSE_SMOOTHING, c])
            c += 1
        pad_torques(S, places, full)
        c = int(8)
        while c < end:
            S[FREE, c] = (S[TORQUE, c - 8] - S[TORQUE, c]) * S[INVERSE_INERTIA, c]
            c += 1
        pad_free(S, places, full)
        c = int(8)
        while c < end:
            repeats = c < 16 and c >= 8 + full
            rx, ry = inward_pull(S[COSINE, c], S[SINE, c], S[SPIN, c], S[FREE, c])
            after_x, after_y = inward_pull(S[COSINE, c + 8], S[SINE, c + 8], S[SPIN, c + 8], S[FREE, c + 8])
            S[wp.static(right), c] = wp.where(repeats, ZERO, a * (rx + after_x))
            S[wp.static(right + 1), c] = wp.where(repeats, ZERO, a * (ry + after_y))
            c += 1
        solve_joints(S, R, places, full)
        c = int(8)
        while c < end:
            ax, ay, turn = pushed_at(S, a, c)
            S[RATE, c] = ax
            S[wp.static(RATE + 1), c] = ay - chain.gravity
            S[wp.static(RATE + 2), c] = S[FREE, c] + turn
            c += 1

    def pusher(row: int):
        """Warp function that adds the changes by the last solution to three rows from this one on."""

        @wp.func
        def push(S: Rows, chain: Chain, places: int):
            a = chain.half_length
            end = place_column(places + 1)
            c = int(8)
            while c < end:
                dx, dy, turn = pushed_at(S, a, c)
                S[wp.static(row), c] = S[wp.static(row), c] + dx
                S[wp.static(row + 1), c] = S[wp.static(row + 1), c] + dy
                S[wp.static(row + 2), c] = S[wp.static(row + 2), c] + turn
                c += 1

        return push

    displace, push = pusher(BASE), pusher(BASE + 3)

    @wp.func
    def openings(S: Rows, chain: Chain, places: int, full: int):
        a = chain.half_length
        end = place_column(places + 1)
        c = int(8)
        while c < end:
            cosine, sine = cos_sin(S[wp.static(BASE + 2), c])
            S[COSINE, c] = cosine
            S[SINE, c] = sine
            S[SPIN, c] = S[wp.static(BASE + 5), c]
            c += 1
        pad_directions(S, places, full)
        pad_places(S, places, full)
        greatest = wp.int64(0)
        c = int(8)
        while c < end:
            repeats = c < 16 and c >= 8 + full
            cx = (S[BASE, c + 8] - S[BASE, c]) - a * (S[COSINE, c + 8] + S[COSINE, c])
            cy = (S[wp.static(BASE + 1), c + 8] - S[wp.static(BASE + 1), c]) - a * (S[SINE, c + 8] + S[SINE, c])
            S[wp.static(right), c] = wp.where(repeats, ZERO, cx)
            S[wp.static(right + 1), c] = wp.where(repeats, ZERO, cy)
            greatest = wp.max(greatest, order_bits(cx * cx + cy * cy))
            c += 1
        return wp.sqrt(wp.cast(greatest, wp.float64))

    @wp.func
    def opening_rates(S: Rows, chain: Chain, places: int, full: int):
        """Sets the right-hand side to Ċ."""
        a = chain.half_length
        end = place_column(places + 1)
        pad_rates(S, places, full)
        c = int(8)
        while c < end:
            repeats = c < 16 and c >= 8 + full
            cu, cv = opening_rate_of(
                a,
                S[wp.static(BASE + 3), c],
                S[wp.static(BASE + 4), c],
                S[SPIN, c],
                S[COSINE, c],
                S[SINE, c],
                S[wp.static(BASE + 3), c + 8],
                S[wp.static(BASE + 4), c + 8],
                S[SPIN, c + 8],
                S[COSINE, c + 8],
                S[SINE, c + 8],
            )
            S[wp.static(right), c] = wp.where(repeats, ZERO, cu)
            S[wp.static(right + 1), c] = wp.where(repeats, ZERO, cv)
            c += 1

    @wp.func
    def stretching(S: Rows, chain: Chain, places: int):
        total = ZERO
        c = int(8)
        while c < place_column(places + 1):
            cx = S[wp.static(right), c]
            cy = S[wp.static(right + 1), c]
            total += S[COUNTED, c] * (cx * cx + cy * cy)
            c += 1
        return HALF * chain.joint_stiffness * total

    @wp.func
    def close(rows: Rows, separators: Rows, chain: Chain, places: int, full: int):
        # clang does not inline this function: its loops vectorise only if static shapes are given here again
        S = wp.array(ptr=rows.ptr, shape=(wp.static(ROWS_OF_RIGID), wp.static(width)), dtype=wp.float64)
        R = wp.array(ptr=separators.ptr, shape=(wp.static(separator_rows), LANES), dtype=wp.float64)
        corrections = int(0)
        widest = openings(S, chain, places, full)
        factorise(S, R, chain, places, full)
        while widest > CLOSED and corrections < MOST_CORRECTIONS:
            solve_joints(S, R, places, full)
            displace(S, chain, places)
            widest = openings(S, chain, places, full)
            factorise(S, R, chain, places, full)
            corrections += 1
        opening_rates(S, chain, places, full)
        solve_joints(S, R, places, full)
        push(S, chain, places)
        end = place_column(places + 1)
        c = int(8)
        while c < end:
            S[SPIN, c] = S[wp.static(BASE + 5), c]
            c += 1
        pad_directions(S, places, full)
        return widest <= CLOSED

    @wp.func
    def begin(S: Rows, R: Rows, chain: Chain, places: int, full: int):
        end = place_column(places + 1)
        c = int(8)
        while c < end:
            S[INVERSE_SMOOTHING, c] = chain.inverse_smoothing
            c += 1
        solve_forces(S, R, chain, places, full)
        c = int(8)
        while c < end:
            S[FORCE, c] = S[wp.static(right), c]
            S[wp.static(FORCE + 1), c] = S[wp.static(right + 1), c]
            for k in range(3):
                S[wp.static(BASE_RATE + k), c] = S[wp.static(RATE + k), c]
            c += 1

    @wp.func
    def kinetic_energy(S: Rows, end: int):
        total = ZERO
        c = int(8)
        while c < end:
            u = S[wp.static(BASE + 3), c]
            v = S[wp.static(BASE + 4), c]
            w = S[wp.static(BASE + 5), c]
            total += S[COUNTED, c] * (S[MASS, c] * (u * u + v * v) + S[INERTIA, c] * w * w)
            c += 1
        return HALF * total

    @wp.func
    def are_stiff(S: Rows, chain: Chain, end: int):
        square = ZERO
        c = int(8)
        while c < end:
            fx = S[FORCE, c]
            fy = S[wp.static(FORCE + 1), c]
            square += S[COUNTED, c] * (fx * fx + fy * fy)
            c += 1
        held = HALF * square / chain.joint_stiffness
        return held <= GREATEST_STRETCHING * kinetic_energy(S, end)

    return RigidJoints(
        load,
        store,
        factorise,
        solve_joints,
        solve_forces,
        displace,
        openings,
        stretching,
        close,
        begin,
        kinetic_energy,
        are_stiff,
    )
