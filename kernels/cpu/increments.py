"""Embedded explicit Runge–Kutta steps on springs: one source for every tableau, precision and load.

The algebra is that of :mod:`physics.increments`. K is the chain's scratch in double precision, see :mod:`layout`, and S
what stages work on, see :mod:`cpu.stage_rows`. A stage is two loops: one over joints, and one over links, which finds
their accelerations and displaces them for the next stage. Loops have the form that clang vectorises: ``while`` loops
with an integer of their own, arrays of static shape, no branch and no library call inside.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.cpu import stage_rows as at
from warpchain.kernels.cpu.placing import place_ends
from warpchain.kernels.methods.explicit_tableaus import Tableau
from warpchain.kernels.physics.elementary import HALF, order_bits, order_bits_single
from warpchain.kernels.physics.geometry import Link, read_link, whole_lanes
from warpchain.kernels.physics.increments import increments
from warpchain.kernels.types import Chain, Rows

WEIGHT, PLANE = "weight", "plane"
"""Loads that stages know: weight alone, which opens no joint, and that of a plane that tilts."""


@dataclass(frozen=True)
class Steps:
    """Warp functions of a method's steps. On a plane that may move ``chain`` is on that of mid-step."""

    take_constants: Any  # ``(K, S, chain)`` when those of links and joints have changed
    begin: Any  # ``(K, S, chain)`` rounds the state at the start of a step, whose ends are placed
    first_stage: Any  # ``(K, S, chain)`` evaluates the first stage
    take_last_stage: Any  # ``(S, n)`` takes the last stage of the step before for the first one
    attempt: Any  # ``(K, S, chain, h, tolerance)`` → bits of the greatest error ratio, see :func:`order_bits`
    commit: Any  # ``(K, S, chain, h)`` takes the new state and places its ends
    start_is_finite: Any  # ``(S, n)``


@functools.cache
def steps_in_increments(tableau: Tableau, real: Any, load: Any) -> Steps:
    """Steps of one tableau in single or double precision; load: ``WEIGHT``, ``PLANE``, or a script's Warp function."""
    algebra, exact = increments(real), increments(wp.float64)
    Numbers = wp.array2d(dtype=real)
    six = wp.types.vector(length=6, dtype=real)
    is_single = real is wp.float32
    lanes_of_vector = at.CACHE_LINE // (4 if is_single else 8)
    bits = order_bits_single if is_single else order_bits
    integer = wp.int32 if is_single else wp.int64
    is_weight, on_plane = load == WEIGHT, load == PLANE
    of_script = None if is_weight or on_plane else load
    stages, nodes = tableau.stages, tableau.nodes
    rows, power_rows, _ = at.stage_rows(tableau)
    needs_power = at.needs_power(tableau)
    weights = tableau.velocity_weights
    stage_sums = [at.sums_over(real, *both, rows) for both in zip(tableau.velocity, tableau.position, strict=True)]
    new_state = at.sums_over(real, weights, tableau.position_weights, rows)
    errors = at.sums_over(real, tableau.velocity_errors, (0.0,) * stages, rows)

    def later(s: int) -> int:
        """The next stage, if there is one: in a branch that is left out names must have a meaning."""
        return min(s + 1, stages - 1)

    @wp.func
    def whole_vectors(n: int):
        """The number of links, rounded up to whole vectors."""
        return (n + wp.static(lanes_of_vector - 1)) & wp.static(-lanes_of_vector)

    @wp.func
    def begin_joint(K: Rows, S: Numbers, stage: algebra.Stage, a: wp.float64, i: int, j: int):
        """Writes what the joint from link i to link j has at the start of a step."""
        joint = algebra.begin_joint(K, a, i, j)
        S[at.FORCE_AT_START, i] = algebra.start_force(stage, joint.x, joint.u)
        S[at.FORCE_AT_START + 1, i] = algebra.start_force(stage, joint.y, joint.v)
        S[at.RATE, i] = joint.u
        S[at.RATE + 1, i] = joint.v
        S[at.SPIN, i] = joint.spin
        if wp.static(on_plane):
            S[at.OPENING, i] = joint.x
            S[at.OPENING + 1, i] = joint.y

    @wp.func
    def begin(K: Rows, S: Numbers, chain: Chain):
        n = chain.link_count
        a = chain.half_length
        stage = algebra.stage_at(chain, real(0.0), real(0.0))
        vectors = whole_vectors(n)
        i = int(0)
        while i < vectors:
            begin_joint(K, S, stage, a, i, i + 1)
            S[at.ARM_X, i] = real(a * K[layout.COSINE, i])
            S[at.ARM_Y, i] = real(a * K[layout.SINE, i])
            for k in range(3):
                S[at.U + k, i] = real(K[layout.U + k, i])
            i += 1
        begin_joint(K, S, stage, a, n - 1, 0)

    @wp.func
    def take_constants(K: Rows, S: Numbers, chain: Chain):
        vectors = whole_vectors(chain.link_count)
        i = int(0)
        while i < vectors:
            S[at.VISCOUS, i] = real(K[layout.VISCOUS, i])
            S[at.COULOMB, i] = real(K[layout.COULOMB, i])
            S[at.INVERSE_MASS, i] = real(K[layout.INVERSE_MASS, i])
            S[at.INVERSE_INERTIA, i] = real(K[layout.INVERSE_INERTIA, i])
            i += 1

    @wp.func
    def pull_joints(S: Numbers, stage: algebra.Stage, n: int, power_row: int, is_first: bool, has_power: bool):
        """Forces and torques of the joints in a stage."""
        vectors = whole_vectors(n)
        i = int(0)
        while i < vectors:
            force_x = S[at.FORCE_AT_START, i]
            force_y = S[at.FORCE_AT_START + 1, i]
            rate_x = S[at.RATE, i]
            rate_y = S[at.RATE + 1, i]
            spin = S[at.SPIN, i]
            if not is_first:
                force_x = algebra.force(stage, force_x, rate_x, S[at.LEFT, i + 1], S[at.RIGHT, i])
                force_y = algebra.force(stage, force_y, rate_y, S[at.LEFT + 1, i + 1], S[at.RIGHT + 1, i])
                spin += S[at.STAGE_SPIN, i] - S[at.STAGE_SPIN, i + 1]
                if has_power:
                    rate_x += S[at.LEFT_RATE, i + 1] - S[at.RIGHT_RATE, i]
                    rate_y += S[at.LEFT_RATE + 1, i + 1] - S[at.RIGHT_RATE + 1, i]
            torque = algebra.torque(stage, S[at.VISCOUS, i], S[at.COULOMB, i], spin)
            S[at.FORCE, i + 1] = force_x
            S[at.FORCE + 1, i + 1] = force_y
            S[at.TORQUE, i + 1] = torque
            if has_power:
                S[power_row, i] = torque * spin
                S[power_row + 1, i] = stage.damping * (rate_x * rate_x + rate_y * rate_y)
                S[power_row + 2, i + 1] = force_x
                S[power_row + 3, i + 1] = force_y
            i += 1
        for c in range(3):
            S[at.FORCE + c, 0] = S[at.FORCE + c, n]
        if has_power:
            for c in range(2, 4):
                S[power_row + c, 0] = S[power_row + c, n]

    @wp.func
    def link_in_stage(K: Rows, S: Numbers, chain: Chain, i: int, arm_row: int, is_first: bool) -> Link:
        """A link in a stage, in double precision, as loads of scripts read it."""
        link = read_link(K, chain, i)
        if not is_first:
            link.arm_x = wp.float64(S[arm_row, i])
            link.arm_y = wp.float64(S[arm_row + 1, i])
            link.x += wp.float64(S[at.WAY, i])
            link.y += wp.float64(S[at.WAY + 1, i])
            link.u += wp.float64(S[at.CHANGE, i])
            link.v += wp.float64(S[at.CHANGE + 1, i])
            link.omega += wp.float64(S[at.STAGE_SPIN, i])
        return link

    @wp.func
    def load_ends(S: Numbers, chain: Chain, h: real):
        """Writes the loads of the links' ends, in the step that begins, on a plane that turns."""
        plane = algebra.plane_motion(chain)
        half = real(0.5) * h
        vectors = whole_vectors(chain.link_count)
        i = int(0)
        while i < vectors:
            load = algebra.end_load(
                plane, half, S[at.OMEGA, i], S[at.ARM_X, i], S[at.ARM_Y, i], S[at.OPENING, i], S[at.OPENING + 1, i]
            )
            # links behind the last stay at rest: powers of their slow motion would be subnormal, a hundred cycles each
            is_there = i < chain.link_count
            S[at.END_LOAD, i] = wp.where(is_there, load.left_x, real(0.0))
            S[at.END_LOAD + 1, i] = wp.where(is_there, load.left_y, real(0.0))
            S[at.END_LOAD + 2, i] = wp.where(is_there, load.right_x, real(0.0))
            S[at.END_LOAD + 3, i] = wp.where(is_there, load.right_y, real(0.0))
            S[at.END_LOAD + 4, i] = wp.where(is_there, load.turn, real(0.0))
            i += 1

    @wp.func
    def accelerate(
        K: Rows,
        S: Numbers,
        chain: Chain,
        row: int,
        power_row: int,
        i: int,
        arm_row: int,
        is_first: bool,
        has_power: bool,
    ):
        """Accelerations of a link in a stage, but for loads of scripts seen from one that falls freely."""
        arm_x = S[arm_row, i]
        arm_y = S[arm_row + 1, i]
        ax, ay, turn = algebra.acceleration(
            S[at.INVERSE_MASS, i],
            S[at.INVERSE_INERTIA, i],
            arm_x,
            arm_y,
            S[at.FORCE, i],
            S[at.FORCE + 1, i],
            S[at.TORQUE, i],
            S[at.FORCE, i + 1],
            S[at.FORCE + 1, i + 1],
            S[at.TORQUE, i + 1],
        )
        if wp.static(of_script is not None):
            link = link_in_stage(K, S, chain, i, arm_row, is_first)
            load_x, load_y, load_turn = wp.static(of_script)(
                chain, i, link, K[layout.INVERSE_MASS, i], K[layout.INVERSE_INERTIA, i]
            )
            ax += real(load_x)
            ay += real(load_y)
            turn += real(load_turn)
        S[row, i] = ax
        S[row + 1, i] = ay
        S[row + 2, i] = turn

    @wp.func
    def displace(S: Numbers, stage: algebra.Stage, i: int, sums: six, has_power: bool):
        """Writes a link in a stage, from sums over the accelerations of the stages before."""
        omega = S[at.OMEGA, i]
        moved = algebra.displace(
            stage, S[at.ARM_X, i], S[at.ARM_Y, i], omega, sums[0], sums[1], sums[2], sums[3], sums[4], sums[5]
        )
        if wp.static(on_plane):
            load = algebra.EndLoad()
            load.left_x = S[at.END_LOAD, i]
            load.left_y = S[at.END_LOAD + 1, i]
            load.right_x = S[at.END_LOAD + 2, i]
            load.right_y = S[at.END_LOAD + 3, i]
            load.turn = S[at.END_LOAD + 4, i]
            moved = algebra.ends_drawn(stage, moved, load)
        S[at.LEFT, i] = moved.left_x
        S[at.LEFT + 1, i] = moved.left_y
        S[at.RIGHT, i] = moved.right_x
        S[at.RIGHT + 1, i] = moved.right_y
        if has_power:
            S[at.LEFT_RATE, i] = moved.left_u
            S[at.LEFT_RATE + 1, i] = moved.left_v
            S[at.RIGHT_RATE, i] = moved.right_u
            S[at.RIGHT_RATE + 1, i] = moved.right_v
        S[at.STAGE_ARM_X, i] = moved.arm_x
        S[at.STAGE_ARM_Y, i] = moved.arm_y
        S[at.STAGE_SPIN, i] = moved.spin
        if wp.static(of_script is not None):
            square = stage.h * stage.h
            S[at.WAY, i] = stage.even * S[at.U, i] + square * sums[3]
            S[at.WAY + 1, i] = stage.even * S[at.V, i] + square * sums[4]
            S[at.CHANGE, i] = stage.h * sums[0]
            S[at.CHANGE + 1, i] = stage.h * sums[1]

    @wp.func
    def close_loop(S: Numbers, n: int, has_power: bool):
        """Repeats column 0 in column n."""
        for c in range(2):
            S[at.LEFT + c, n] = S[at.LEFT + c, 0]
            if has_power:
                S[at.LEFT_RATE + c, n] = S[at.LEFT_RATE + c, 0]
        S[at.STAGE_SPIN, n] = S[at.STAGE_SPIN, 0]

    @wp.func
    def first_stage(K: Rows, S: Numbers, chain: Chain):
        stage = algebra.stage_at(chain, real(0.0), real(0.0))
        pull_joints(S, stage, chain.link_count, wp.static(power_rows[0]), True, wp.static(needs_power[0]))
        vectors = whole_vectors(chain.link_count)
        i = int(0)
        while i < vectors:
            accelerate(
                K,
                S,
                chain,
                wp.static(rows[0]),
                wp.static(power_rows[0]),
                i,
                at.ARM_X,
                True,
                wp.static(needs_power[0]),
            )
            i += 1

    @wp.func
    def attempt(K: Rows, S: Numbers, chain: Chain, step: wp.float64, tolerance: wp.float64):
        n = chain.link_count
        vectors = whole_vectors(n)
        h = real(step)
        stage = algebra.stage_at(chain, h, wp.static(real(nodes[1])) * h)
        if wp.static(on_plane):
            load_ends(S, chain, h)
        i = int(0)
        while i < vectors:
            displace(S, stage, i, wp.static(stage_sums[1])(S, i), wp.static(needs_power[1]))
            i += 1
        for s in range(1, wp.static(stages)):
            close_loop(S, n, wp.static(needs_power[s]))
            stage.even = wp.static(real(nodes[s])) * h
            pull_joints(S, stage, n, wp.static(power_rows[s]), False, wp.static(needs_power[s]))
            if wp.static(s + 1 < stages):
                stage.even = wp.static(real(nodes[later(s)])) * h
                i = int(0)
                while i < vectors:
                    accelerate(
                        K,
                        S,
                        chain,
                        wp.static(rows[s]),
                        wp.static(power_rows[s]),
                        i,
                        at.STAGE_ARM_X,
                        False,
                        wp.static(needs_power[s]),
                    )
                    displace(S, stage, i, wp.static(stage_sums[later(s)])(S, i), wp.static(needs_power[later(s)]))
                    i += 1
        inverse = real(wp.float64(1.0) / tolerance)
        i = int(0)
        while i < vectors:
            accelerate(
                K,
                S,
                chain,
                wp.static(rows[-1]),
                wp.static(power_rows[-1]),
                i,
                at.STAGE_ARM_X,
                False,
                wp.static(needs_power[-1]),
            )
            made = new_state(S, i)
            error = errors(S, i)
            ratio = algebra.error_ratio(
                stage,
                error[0],
                error[1],
                error[2],
                S[at.U, i],
                S[at.V, i],
                S[at.OMEGA, i],
                S[wp.static(rows[0]), i],
                S[wp.static(rows[0]) + 1, i],
                S[wp.static(rows[0]) + 2, i],
                h * S[at.OMEGA, i] + h * h * made[5],
                inverse,
            )
            S[at.ERROR, i] = wp.where(i < n, ratio, real(0.0))
            i += 1
        greatest = integer(0)
        i = int(0)
        while i < vectors:
            greatest = wp.max(greatest, bits(S[at.ERROR, i]))
            i += 1
        return order_bits(wp.float64(wp.cast(greatest, real)))

    @wp.func
    def impulse(S: Numbers, first: int, i: int):
        """Mean of a joint's or link's quantity over the step, from rows of the stages."""
        total = real(0.0)
        for j in range(wp.static(stages)):
            if wp.static(weights[j] != 0.0):
                total += wp.static(real(weights[j])) * S[wp.static(power_rows[j]) + first, i]
        return total

    @wp.func
    def fall_on_plane(K: Rows, plane: exact.PlaneMotion, chain: Chain, step: wp.float64, i: int):
        """What gravity and the motion of the plane take from a link's velocities in a step."""
        load_x, load_y, load_turn = exact.plane_load(plane, HALF * step, K, chain.half_length, i)
        less = wp.where(i < chain.link_count, -step, wp.float64(0.0))  # see load_ends
        return wp.vec3d(less * load_x, less * load_y, less * load_turn)

    @wp.func
    def commit(K: Rows, S: Numbers, chain: Chain, step: wp.float64):
        n = chain.link_count
        lanes = whole_lanes(n)
        fall = wp.vec2d(wp.float64(0.0), wp.float64(0.0))
        if wp.static(is_weight):
            fall = wp.vec2d(wp.float64(0.0), chain.gravity * step)
        plane = exact.plane_motion(chain)
        h = real(step)
        square = h * h
        i = int(0)
        while i < lanes:
            made = new_state(S, i)
            if wp.static(on_plane):
                own_fall = fall_on_plane(K, plane, chain, step, i)
            for c in range(2):
                K[layout.LOST_FRICTION + c, i] = K[layout.LOST_FRICTION + c, i] + wp.float64(h * impulse(S, c, i))
            for c in range(3):
                rate = K[layout.U + c, i]
                way = wp.float64(square * made[3 + c])
                change = wp.float64(h * made[c])
                if wp.static((is_weight or on_plane) and c < 2):
                    # the impulse of a joint is the same number on both of its links: momentum stays to the last bits
                    push = wp.float64(impulse(S, 2 + c, i + 1)) - wp.float64(impulse(S, 2 + c, i))
                    change = step * push * K[layout.INVERSE_MASS, i]
                if wp.static(is_weight and c < 2):
                    change -= fall[c]
                    way -= HALF * fall[c] * step
                if wp.static(on_plane):
                    change -= own_fall[c]
                    way -= HALF * own_fall[c] * step
                K[layout.X + c, i] = K[layout.X + c, i] + (step * rate + way)
                K[layout.U + c, i] = rate + change
            i += 1
        place_ends(K, chain)  # in a loop of its own, which is faster: the processor overlaps more of its short rounds

    @wp.func
    def take_last_stage(S: Numbers, n: int):
        vectors = whole_vectors(n)
        i = int(0)
        while i < vectors:
            for row in range(3):
                S[wp.static(rows[0]) + row, i] = S[wp.static(rows[-1]) + row, i]
            if wp.static(needs_power[0]):
                for row in range(wp.static(at.POWER_ROWS)):
                    S[wp.static(power_rows[0]) + row, i] = S[wp.static(power_rows[-1]) + row, i]
            i += 1
        if wp.static(needs_power[0]):
            for row in range(2, 4):
                S[wp.static(power_rows[0]) + row, n] = S[wp.static(power_rows[-1]) + row, n]

    @wp.func
    def start_is_finite(S: Numbers, n: int):
        finite = bool(True)
        for i in range(n):
            for row in range(3):
                finite = finite and wp.isfinite(S[wp.static(rows[0]) + row, i])
        return finite

    return Steps(take_constants, begin, first_stage, take_last_stage, attempt, commit, start_is_finite)
