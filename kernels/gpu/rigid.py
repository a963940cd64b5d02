"""Rigid joints in the block form: one thread per link, and the joint at its right end; see :mod:`cpu.implicit.rigid`.

S F = r is solved by :mod:`gpu.solver`. Neighbours meet in two places of memory, ``ends`` (5 numbers a thread) and
``forces`` (3), given by their addresses: a function that is called rather than inlined would take a tile by reference,
and then all of the kernel would find that tile by way of local memory. Between two exchanges in one place lies one in
the other, or a barrier. The state stands on the board.

From one impulse to the next an attempt takes a hundred times as long as one on springs and goes further still, so what
is kept here lies in memory rather than in registers, which the attempts on springs need.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.cpu.implicit.rigid import CLOSED, GREATEST_RINGING, GREATEST_STRETCHING, MOST_CORRECTIONS
from warpchain.kernels.cpu.implicit.solver import block_type
from warpchain.kernels.gpu.board import point
from warpchain.kernels.gpu.factors import FactorLayout, reductions_for
from warpchain.kernels.gpu.solver import block_solver
from warpchain.kernels.gpu.stage import Place, direction_on, joint_constants, link_on
from warpchain.kernels.gpu.threads import barrier, exchange, read, warp_greatest, warp_width, write
from warpchain.kernels.layout import (
    BOARD_FIRST,
    BOARD_NOTES,
    INERTIA,
    INVERSE_INERTIA,
    INVERSE_MASS,
    MASS,
    NOTE_GRAVITY,
    NOTE_HALF_LENGTH,
    OMEGA,
    THETA,
    U,
    V,
    X,
    Y,
)
from warpchain.kernels.methods.w_tableaus import ROS34PW2
from warpchain.kernels.physics.elementary import HALF, ONE, TWO, ZERO, order_bits_single
from warpchain.kernels.physics.joint import friction_torque
from warpchain.kernels.physics.rigid_joint import inward_pull, opening_of, opening_rate_of, pushed, turning_share

wp.set_module_options({"enable_backward": False})

vec2d = wp.types.vector(length=2, dtype=wp.float64)
mat22d = block_type(2)

CLOSED_SQUARE = wp.constant(wp.float32(float(CLOSED) ** 2))

# Numbers of a link from which S is made: 1/m and a² t tᵀ / I.
SHARE, SHARE_XX, SHARE_XY, SHARE_YY = 0, 1, 2, 3
FORCE_NUMBERS = 4
FRICTION_NUMBERS = 5
"""Of the system of the stages, see :mod:`gpu.flight`."""


@wp.struct
class FlightMemory:
    """Addresses of what the threads of a block share on rigid joints."""

    ends: wp.uint64  # five numbers a thread, between neighbours
    forces: wp.uint64  # three
    memory: wp.uint64  # what a flight keeps, laid out by FlightLayout


@dataclass(frozen=True)
class FlightLayout:
    """Where a block keeps what flights need, in doubles from the beginning of its memory; nothing outlasts a step.

    Attributes:
        block_dim: Threads in a block.
    """

    block_dim: int

    @property
    def forces(self) -> FactorLayout:
        """System of the joint forces, at the beginning."""
        return self._system(2, FORCE_NUMBERS)

    @property
    def friction(self) -> FactorLayout:
        """System of the stages, behind it."""
        return self._system(3, FRICTION_NUMBERS)

    @property
    def stages(self) -> int:
        """Six numbers a link and stage: its changes; while joints are closed, the state before."""
        return self.forces.size + self.friction.size

    @property
    def force(self) -> int:
        """Two numbers a link: force of its right joint."""
        return self.stages + 6 * ROS34PW2.stages * self.block_dim

    @property
    def sums(self) -> int:
        """Two numbers a link that are being added up."""
        return self.force + 2 * self.block_dim

    @property
    def maxima(self) -> int:
        """A number a hardware warp of which the greatest is wanted."""
        return self.sums + 2 * self.block_dim

    @property
    def size(self) -> int:
        """Doubles in all."""
        return self.maxima + self.block_dim

    def _system(self, order: int, numbers: int) -> FactorLayout:
        reductions = reductions_for(self.block_dim)
        return FactorLayout(self.block_dim, reductions, numbers, order=order, has_diagonals=False)


@dataclass(frozen=True)
class BlockRigidJoints:
    """Warp functions for blocks of one size.

    Attributes:
        factorise: ``(M.memory, K, place, cosine, sine)``: makes S of the links' directions ready to solve with.
        accelerate: ``(M, K, place, cosine, sine, spin, torque)`` → force of the right joint and acceleration of the
            link, from its direction and spin and its right joint's friction torque.
        project: ``(M, K, place, is_closing)`` → whether C = 0 and Ċ = 0 hold now, whether springs would hold so little
            energy that they may count as rigid, kinetic energy and energy [J] that went. Leaves joint forces,
            accelerations and S factorised. ``is_closing``: from springs, which may also be refused; then nothing has
            changed.
        open_joints: ``(M, K, place, kinetic)``, after ``project`` and impulses → energy [J] that went.
    """

    factorise: Any
    accelerate: Any
    project: Any
    open_joints: Any


@functools.cache
def block_rigid_joints(block_dim: int) -> BlockRigidJoints:
    """The functions of rigid joints for blocks of this many threads."""
    memory = FlightLayout(block_dim)
    kept, force, sums, maxima = memory.stages, memory.force, memory.sums, memory.maxima
    hand, handed = exchange(block_dim)

    @wp.func
    def share_of(S: wp.uint64, link: int, side: wp.float64):
        """What a link adds to a block of S: coupling (side −1) or diagonal (side 1)."""
        own = side * read(S, wp.static(SHARE * block_dim) + link)
        xy = read(S, wp.static(SHARE_XY * block_dim) + link)
        return mat22d(
            read(S, wp.static(SHARE_XX * block_dim) + link) + own,
            xy,
            xy,
            read(S, wp.static(SHARE_YY * block_dim) + link) + own,
        )

    @wp.func
    def couplings_of(S: wp.uint64, n: int, link: int, constant: wp.float64):
        return share_of(S, link, -ONE), share_of(S, wp.where(link == n - 1, 0, link + 1), -ONE)

    @wp.func
    def diagonal_of(S: wp.uint64, n: int, link: int, constant: wp.float64):
        return share_of(S, link, ONE) + share_of(S, wp.where(link == n - 1, 0, link + 1), ONE)

    factor, solve = block_solver(memory.forces, couplings_of, diagonal_of)

    @wp.func
    def factorise(S: wp.uint64, K: wp.array2d(dtype=wp.float64), place: Place, cosine: wp.float64, sine: wp.float64):
        lane = place.lane
        xx, xy, yy = turning_share(K[BOARD_NOTES, NOTE_HALF_LENGTH], K[INVERSE_INERTIA, place.column], cosine, sine)
        write(S, wp.static(SHARE * block_dim) + lane, K[INVERSE_MASS, place.column])
        write(S, wp.static(SHARE_XX * block_dim) + lane, xx)
        write(S, wp.static(SHARE_XY * block_dim) + lane, xy)
        write(S, wp.static(SHARE_YY * block_dim) + lane, yy)
        barrier()
        factor(S, place.links, place.lane, ZERO)
        barrier()

    @wp.func
    def push_of(
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        cosine: wp.float64,
        sine: wp.float64,
        left_x: wp.float64,
        left_y: wp.float64,
        own: vec2d,
    ):
        """What P of the joints at its ends do to a link on the board."""
        return pushed(
            K[BOARD_NOTES, NOTE_HALF_LENGTH],
            K[INVERSE_MASS, place.column],
            K[INVERSE_INERTIA, place.column],
            cosine,
            sine,
            left_x,
            left_y,
            own[0],
            own[1],
        )

    @wp.func
    def accelerate(
        M: FlightMemory,
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        cosine: wp.float64,
        sine: wp.float64,
        spin: wp.float64,
        torque: wp.float64,
    ):
        lane = place.lane
        hand(M.ends, 0, lane, torque)
        barrier()
        free = (handed(M.ends, 0, place.before) - torque) * K[INVERSE_INERTIA, place.column]
        own_x, own_y = inward_pull(cosine, sine, spin, free)
        hand(M.forces, 0, lane, own_x)
        hand(M.forces, 1, lane, own_y)
        barrier()
        right_x = own_x + handed(M.forces, 0, place.after)
        right_y = own_y + handed(M.forces, 1, place.after)
        a = K[BOARD_NOTES, NOTE_HALF_LENGTH]
        own = solve(M.memory, place.links, lane, ZERO, vec2d(a * right_x, a * right_y))
        hand(M.ends, 0, lane, own[0])
        hand(M.ends, 1, lane, own[1])
        barrier()
        left_x = handed(M.ends, 0, place.before)
        left_y = handed(M.ends, 1, place.before)
        ax, ay, turn = push_of(K, place, cosine, sine, left_x, left_y, own)
        return own, ax, ay - K[BOARD_NOTES, NOTE_GRAVITY], free + turn

    @wp.func
    def opening(ends: wp.uint64, K: wp.array2d(dtype=wp.float64), place: Place):
        """C of the right joint on the board, none behind the last link, and the next link's direction."""
        link = link_on(K, place.lane)
        hand(ends, 0, place.lane, link.x)
        hand(ends, 1, place.lane, link.y)
        cosine, sine = direction_on(K, place.lane)
        hand(ends, 2, place.lane, cosine)
        hand(ends, 3, place.lane, sine)
        barrier()
        after_cosine = handed(ends, 2, place.after)
        after_sine = handed(ends, 3, place.after)
        cx, cy = opening_of(
            K[BOARD_NOTES, NOTE_HALF_LENGTH],
            link.x,
            link.y,
            cosine,
            sine,
            handed(ends, 0, place.after),
            handed(ends, 1, place.after),
            after_cosine,
            after_sine,
        )
        if place.lane >= place.links:
            cx = ZERO
            cy = ZERO
        return cx, cy, after_cosine, after_sine

    @wp.func
    def greatest_square(S: wp.uint64, lane: int, x: wp.float64, y: wp.float64):
        """The greatest x² + y² of all threads, in single precision; a NaN before any number."""
        bits = warp_greatest(order_bits_single(wp.float32(x * x + y * y)))
        write(S, wp.static(maxima) + lane // warp_width(), wp.float64(bits))
        barrier()
        top = read(S, wp.static(maxima))
        i = int(1)
        while i < wp.static(block_dim) // warp_width():
            top = wp.max(top, read(S, wp.static(maxima) + i))
            i += 1
        return wp.cast(int(top), wp.float32)

    @wp.func
    def two_sums(S: wp.uint64, place: Place, first: wp.float64, second: wp.float64):
        """Sums over all links, in their order, the same in all threads."""
        lane = place.lane
        if lane < place.links:
            write(S, wp.static(sums) + lane, first)
            write(S, wp.static(sums + block_dim) + lane, second)
        barrier()
        total_first = ZERO
        total_second = ZERO
        i = int(0)
        while i < place.links:
            total_first += read(S, wp.static(sums) + i)
            total_second += read(S, wp.static(sums + block_dim) + i)
            i += 1
        return total_first, total_second

    @wp.func
    def twice_kinetic(K: wp.array2d(dtype=wp.float64), place: Place):
        """Of a link [J]."""
        lane = place.lane
        square = K[U, lane] * K[U, lane] + K[V, lane] * K[V, lane]
        return K[MASS, place.column] * square + K[INERTIA, place.column] * K[OMEGA, lane] * K[OMEGA, lane]

    @wp.func
    def project(
        M: FlightMemory,
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        is_closing: bool,
    ):
        lane = place.lane
        S = M.memory
        chain = joint_constants(K)
        held = ZERO
        kinetic = ZERO
        may_close = bool(True)
        cx, cy, after_cosine, after_sine = opening(M.ends, K, place)
        if is_closing:
            row = int(0)
            while row < 6:
                write(S, wp.static(kept) + row * wp.static(block_dim) + lane, K[row, lane])
                row += 1
            square, doubled = two_sums(S, place, cx * cx + cy * cy, twice_kinetic(K, place))
            held = HALF * chain.joint_stiffness * square
            kinetic = HALF * doubled
            may_close = held <= GREATEST_STRETCHING * kinetic
        is_closed = bool(False)
        is_stiff = bool(False)
        ringing = ZERO
        if may_close:
            corrections = int(0)
            goes_on = bool(True)
            while goes_on:
                widest = greatest_square(S, lane, cx, cy)
                is_closed = widest <= CLOSED_SQUARE
                # a NaN goes on to nothing
                goes_on = widest > CLOSED_SQUARE and corrections < wp.static(MOST_CORRECTIONS)
                link = link_on(K, lane)
                cosine, sine = direction_on(K, lane)
                factorise(S, K, place, cosine, sine)
                hand(M.forces, 0, lane, link.u)
                hand(M.forces, 1, lane, link.v)
                hand(M.forces, 2, lane, link.omega)
                barrier()
                right = vec2d(cx, cy)
                if not goes_on and lane < place.links:
                    cu, cv = opening_rate_of(
                        chain.half_length,
                        link.u,
                        link.v,
                        link.omega,
                        cosine,
                        sine,
                        handed(M.forces, 0, place.after),
                        handed(M.forces, 1, place.after),
                        handed(M.forces, 2, place.after),
                        after_cosine,
                        after_sine,
                    )
                    right = vec2d(cu, cv)
                own = solve(S, place.links, lane, ZERO, right)
                hand(M.ends, 0, lane, own[0])
                hand(M.ends, 1, lane, own[1])
                barrier()
                left_x = handed(M.ends, 0, place.before)
                left_y = handed(M.ends, 1, place.before)
                px, py, turn = push_of(K, place, cosine, sine, left_x, left_y, own)
                first = wp.where(goes_on, X, U)
                if lane < place.links:
                    K[first, lane] = K[first, lane] + px
                    K[first + 1, lane] = K[first + 1, lane] + py
                    K[first + 2, lane] = K[first + 2, lane] + turn
                barrier()
                if goes_on:
                    point(K, lane)
                    cx, cy, after_cosine, after_sine = opening(M.ends, K, place)
                    corrections += 1
            link = link_on(K, lane)
            hand(M.forces, 0, lane, link.omega)
            barrier()
            torque = friction_torque(chain, link.omega - handed(M.forces, 0, place.after))
            cosine, sine = direction_on(K, lane)
            pull, ax, ay, at = accelerate(M, K, place, cosine, sine, link.omega, torque)
            square, doubled = two_sums(S, place, pull[0] * pull[0] + pull[1] * pull[1], twice_kinetic(K, place))
            left_over = HALF * doubled
            is_stiff = HALF * square / chain.joint_stiffness <= GREATEST_STRETCHING * left_over
            keeps = bool(True)
            if is_closing:
                ringing = kinetic - left_over
                is_closed = is_closed and is_stiff and wp.abs(ringing) <= GREATEST_RINGING * kinetic
                keeps = is_closed
            kinetic = left_over
            write(S, wp.static(force) + lane, pull[0])
            write(S, wp.static(force + block_dim) + lane, pull[1])
            if keeps:
                K[BOARD_FIRST, lane] = ax
                K[BOARD_FIRST + 1, lane] = ay
                K[BOARD_FIRST + 2, lane] = at
            else:
                row = int(0)
                while row < 6:
                    K[row, lane] = read(S, wp.static(kept) + row * wp.static(block_dim) + lane)
                    row += 1
                point(K, lane)
        return is_closed, is_stiff, kinetic, held + ringing

    @wp.func
    def open_joints(
        M: FlightMemory,
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        kinetic: wp.float64,
    ):
        lane = place.lane
        S = M.memory
        chain = joint_constants(K)
        x = K[X, lane]
        y = K[Y, lane]
        theta = K[THETA, lane]
        cx, cy, _cosine, _sine = opening(M.ends, K, place)
        before, _none = two_sums(S, place, cx * cx + cy * cy, ZERO)
        give = ONE / chain.joint_stiffness
        right = vec2d()
        if lane < place.links:
            right = vec2d(
                cx - give * read(S, wp.static(force) + lane), cy - give * read(S, wp.static(force + block_dim) + lane)
            )
        own = solve(S, place.links, lane, ZERO, right)
        hand(M.forces, 0, lane, own[0])
        hand(M.forces, 1, lane, own[1])
        barrier()
        left_x = handed(M.forces, 0, place.before)
        left_y = handed(M.forces, 1, place.before)
        cosine, sine = direction_on(K, lane)
        px, py, turn = push_of(K, place, cosine, sine, left_x, left_y, own)
        if lane < place.links:
            K[X, lane] = x + px
            K[Y, lane] = y + py
            K[THETA, lane] = theta + turn
            point(K, lane)
        cx, cy, _cosine, _sine = opening(M.ends, K, place)
        after, _none = two_sums(S, place, cx * cx + cy * cy, ZERO)
        half_stiffness = HALF * chain.joint_stiffness
        lost = half_stiffness * (before - after)
        if half_stiffness * after > TWO * GREATEST_STRETCHING * kinetic:
            lost = ZERO
            K[X, lane] = x
            K[Y, lane] = y
            K[THETA, lane] = theta
            point(K, lane)
        barrier()
        return lost

    return BlockRigidJoints(factorise, accelerate, project, open_joints)
