"""Steps in increments on a GPU: one thread per link, stages in registers, see :mod:`physics.increments`.

What stages need of the start of a step, its joints and accelerations, lies in memory of the block. An accepted step
carries it on by its own increments; every ``RENEWED`` steps, and after impulses, joints are formed anew from the state
in double precision. A thread evaluates the joints at both ends of its link, so that a stage takes one barrier.
"""

import functools
import math
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.block_memory import shares_board
from warpchain.kernels.gpu.stage import Run, address_on_board, constants, felt_plane
from warpchain.kernels.gpu.threads import barrier, number_memory
from warpchain.kernels.layout import COSINE, OMEGA, SINE, THETA, U, V, X, Y
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.physics import geometry
from warpchain.kernels.physics.elementary import HALF, ONE, cos_sin, order_bits_single
from warpchain.kernels.physics.geometry import Link, three, turned
from warpchain.kernels.physics.increments import increments, turn_double, turn_single

# Pairs of numbers that a link keeps of the start of a step: opening of its right joint, the rate of that; accelerations
# and spin of the joint; powers [W] lost in the joint by friction, and by damping, divided by b. Then its constants.
OPENING, RATE, SPIN_TURN, PUSH, POWERS = range(5)
KEPT = 5
"""The pairs above, which are kept between launches."""
FRICTION, INERTIAL = 5, 6
EXCHANGED = 16
"""Numbers of a thread in the memory in which stages exchange."""
RENEWED = 32
"""Accepted steps after which directions and joints are formed anew.

That costs hardly any time; openings are wrong by what the rounding of their rates adds up to, as the power 1.5 of it.
"""

vec3d = wp.types.vector(length=3, dtype=wp.float64)


def real_of(features: Features) -> Any:
    """Type of the numbers of stages."""
    return wp.float32 if features.is_mixed else wp.float64


@dataclass(frozen=True)
class BlockSteps:
    """Warp functions of the steps of a block, for all its threads."""

    take_constants: Any  # ``(run)`` rounds a link's constants, when those on the board have changed
    common_of: Any  # ``(run)`` → what links and stages have in common until the chain's constants change
    begin: Any  # ``(run, common, keeps rates)`` forms the joints from the state on the board; a barrier has passed
    attempt: Any  # ``(run, common, h, 1/tolerance)`` → Attempt
    accept: Any  # ``(run, Attempt)`` writes a link's new state, the losses of its joint, and the next start
    renew_direction: Any  # ``(run)`` forms a link's direction anew from its angle
    start_is_finite: Any  # ``(run)``: false if a link's state or start are not finite
    opening: Any  # ``(run)`` → square of the opening of a link's right joint at the start [m²]
    load_start: Any  # ``(run)`` loads what :attr:`store_start` has kept from the launch before
    store_start: Any


@functools.cache
def block_steps(features: Features, block_dim: int) -> BlockSteps:
    """Steps with one tableau, in mixed or in double precision."""
    real = real_of(features)
    vec2, vec3 = (wp.types.vector(length=length, dtype=real) for length in (2, 3))
    algebra = increments(real)
    Stage, Joint, EndLoad = algebra.Stage, algebra.Joint, algebra.EndLoad
    displace, force, torque_of, start_force = algebra.displace, algebra.force, algebra.torque, algebra.start_force
    tilts, plane_motion, plane_load = features.tilts, algebra.plane_motion, algebra.plane_load
    small_turn = turn_single if features.is_mixed else turn_double
    T4, T6, T8 = (real(1 / math.factorial(power)) for power in (4, 6, 8))
    write_pair, read_pair, write_one, read_one = number_memory(real)
    is_shared = shares_board(block_dim)
    acceleration, has_load = features.acceleration, features.load != "weight"

    tableau = find_method(features.method).tableau
    nodes, weights, velocity_errors = tableau.nodes, tableau.velocity_weights, tableau.velocity_errors
    velocity, position = tableau.velocity, tableau.position
    if not tableau.first_same_as_last:  # the new state is one more stage, the first one of the next step
        nodes, weights, velocity_errors = (*nodes, 1.0), (*weights, 0.0), (*velocity_errors, 0.0)
        velocity, position = (*velocity, tableau.velocity_weights), (*position, tableau.position_weights)
    stages, last = len(nodes), len(nodes) - 1
    Stages = wp.types.matrix(shape=(stages, 3), dtype=real)

    # Stages write in turn to two buffers of 7 and 9 numbers a thread, the last one to the larger.
    LEFT, RIGHT, LEFT_RATE, RIGHT_RATE = range(4)

    def pairs(s: int, part: int) -> int:
        """Index of a part's first pair; buffers begin at even numbers."""
        return (0 if (last - s) % 2 else 7 * block_dim // 2) + part * block_dim

    def turns(s: int) -> int:
        """Index of the first change of spin, behind the pairs."""
        return 2 * pairs(s, 4 if s == last else 3)

    @wp.struct
    class Common:
        """What all links and stages have in common until the chain's constants change."""

        stage: Stage
        half_length: real  # [m]
        per_length: real  # its inverse [1/m]
        gravity: real  # [m/s²]

    @wp.struct
    class Attempt:
        """A finished attempt: the link's new state, and what it keeps there."""

        place: vec3d  # x, y [m], θ [rad]
        cosine: wp.float64
        sine: wp.float64
        gain: vec3  # change of the velocities
        friction: real  # lost in the joint [J]
        damping: real
        joint: Joint
        push: vec3  # accelerations by the joints
        last_friction: real
        last_damping: real
        error: wp.int32  # error ratio as ordered bits
        opening: wp.float32  # square of the joint's [m²]
        speed: wp.float32  # square of the greatest of any point of the link, at most [m²/s²]

    @wp.func
    def put(run: Run, part: int, x: real, y: real):
        """Writes a pair of a link."""
        write_pair(run.S, part * wp.static(block_dim) + run.lane, x, y)

    @wp.func
    def get(run: Run, part: int, column: int):
        """A pair of any link."""
        return read_pair(run.S, part * wp.static(block_dim) + column)

    @wp.func
    def take_constants(run: Run):
        K = run.K
        lane = run.lane
        put(run, FRICTION, real(0.0), real(0.0))
        put(run, INERTIAL, real(1.0), real(1.0))
        if lane < run.links:
            put(run, FRICTION, real(K[layout.VISCOUS, lane]), real(K[layout.COULOMB, lane]))
            put(run, INERTIAL, real(K[layout.INVERSE_MASS, lane]), real(K[layout.INVERSE_INERTIA, lane]))

    @wp.func
    def common_of(run: Run) -> Common:
        chain = constants(run.K)
        stage = wp.static(algebra.stage_at)(chain, real(0.0), real(0.0))
        return Common(stage, real(chain.half_length), real(ONE / chain.half_length), real(chain.gravity))

    @wp.func
    def keep(run: Run, joint: Joint, push: vec3, friction: real, damping: real):
        """Keeps what a link knows of the start of the next step, but for its constants."""
        put(run, OPENING, joint.x, joint.y)
        put(run, RATE, joint.u, joint.v)
        put(run, SPIN_TURN, joint.spin, push[2])
        put(run, PUSH, push[0], push[1])
        put(run, POWERS, friction, damping)

    @wp.func
    def kept_joint(run: Run, column: int) -> Joint:
        opening = get(run, OPENING, column)
        rate = get(run, RATE, column)
        spin_turn = get(run, SPIN_TURN, column)
        return Joint(opening[0], opening[1], rate[0], rate[1], spin_turn[0])

    @wp.func
    def kept_push(run: Run):
        """Accelerations of a link by its joints at the start."""
        push = get(run, PUSH, run.lane)
        spin_turn = get(run, SPIN_TURN, run.lane)
        return vec3(push[0], push[1], spin_turn[1])

    @wp.func
    def pull(run: Run, stage: Stage, joint: Joint, column: int):
        """Force and torque of a joint in a known state."""
        friction = get(run, FRICTION, column)
        torque = torque_of(stage, friction[0], friction[1], joint.spin)
        return vec3(start_force(stage, joint.x, joint.u), start_force(stage, joint.y, joint.v), torque)

    @wp.func
    def pushed(run: Run, arm_x: real, arm_y: real, left: vec3, right: vec3):
        """Accelerations of a link by forces and torques of its joints."""
        inertial = get(run, INERTIAL, run.lane)
        ax, ay, turn = wp.static(algebra.acceleration)(
            inertial[0], inertial[1], arm_x, arm_y, left[0], left[1], left[2], right[0], right[1], right[2]
        )
        return vec3(ax, ay, turn)

    @wp.func
    def begin(run: Run, common: Common, keeps_rates: bool):
        K = run.K
        half_length = constants(K).half_length
        own = wp.static(algebra.begin_joint)(K, half_length, run.lane, run.after)
        push = kept_push(run)
        powers = get(run, POWERS, run.lane)
        if not keeps_rates:
            before = wp.static(algebra.begin_joint)(K, half_length, run.before, run.lane)
            left = pull(run, common.stage, before, run.before)
            right = pull(run, common.stage, own, run.lane)
            arm_x = real(half_length * K[COSINE, run.lane])
            arm_y = real(half_length * K[SINE, run.lane])
            push = pushed(run, arm_x, arm_y, left, right)
            powers = vec2(right[2] * own.spin, own.u * own.u + own.v * own.v)
        keep(run, own, push, powers[0], powers[1])

    @wp.func
    def doubles(x: vec3):
        return vec3d(wp.float64(x[0]), wp.float64(x[1]), wp.float64(x[2]))

    @wp.func
    def load(run: Run, even: real, gain: vec3, way: vec3):
        """Accelerations of a link by a script's load, at a time when ``gain`` and ``way`` are beyond even motion."""
        K = run.K
        lane = run.lane
        moved = wp.float64(even) * three(K, U, lane) + doubles(way)
        motion = three(K, U, lane) + doubles(gain)
        half_length = constants(K).half_length
        turned_x, turned_y = turned(half_length * K[COSINE, lane], half_length * K[SINE, lane], moved[2])
        there = Link(K[X, lane] + moved[0], K[Y, lane] + moved[1], motion[0], motion[1], motion[2], turned_x, turned_y)
        inverse_mass = K[layout.INVERSE_MASS, run.column]
        ax, ay, turn = acceleration(constants(K), lane, there, inverse_mass, K[layout.INVERSE_INERTIA, run.column])
        return vec3(real(ax), real(ay), real(turn))

    @wp.func
    def attempt(run: Run, common: Common, step: wp.float64, inverse_tolerance: real):
        K = run.K
        lane = run.lane
        exchange = run.exchange
        h = real(step)
        half_step = real(0.5) * h
        stage = common.stage
        stage.h = h
        # what the last stage needs it reads again: registers are scarce
        start_x = common.half_length * real(K[COSINE, lane])
        start_y = common.half_length * real(K[SINE, lane])
        omega = real(K[OMEGA, lane])
        own = kept_joint(run, lane)
        before = Joint()
        friction = get(run, FRICTION, lane)
        friction_before = get(run, FRICTION, run.before)
        end_load = EndLoad()
        if wp.static(tilts):
            plane = plane_motion(felt_plane(run))
            end_load = wp.static(algebra.end_load)(plane, half_step, omega, start_x, start_y, own.x, own.y)
        rates = Stages()
        rates[0] = kept_push(run)
        if wp.static(has_load):
            rates[0] += load(run, real(0.0), vec3(), vec3())
        own_force_x = start_force(stage, own.x, own.u)
        own_force_y = start_force(stage, own.y, own.v)
        force_before_x = real(0.0)
        force_before_y = real(0.0)
        result = Attempt()
        if wp.static(weights[0] != 0.0):
            powers = get(run, POWERS, lane)
            result.friction = wp.static(real(weights[0])) * powers[0]
            result.damping = wp.static(real(weights[0])) * powers[1]
        for s in range(1, wp.static(stages)):
            sums = vec3()
            ways = vec3()
            for j in range(wp.static(s)):
                if wp.static(velocity[s][j] != 0.0):
                    sums += wp.static(real(velocity[s][j])) * rates[j]
                if wp.static(position[s][j] != 0.0):
                    ways += wp.static(real(position[s][j])) * rates[j]
            stage.even = wp.static(real(nodes[s])) * h
            if wp.static(s == last):  # of the new state the openings are needed as well: plain ways of the ends
                stage.stiffness = real(1.0)
                stage.damping = real(0.0)
            moved = displace(stage, start_x, start_y, omega, sums[0], sums[1], sums[2], ways[0], ways[1], ways[2])
            if wp.static(tilts):
                moved = wp.static(algebra.ends_drawn)(stage, moved, end_load)
            write_pair(exchange, wp.static(pairs(s, LEFT)) + lane, moved.left_x, moved.left_y)
            write_pair(exchange, wp.static(pairs(s, RIGHT)) + lane, moved.right_x, moved.right_y)
            write_one(exchange, wp.static(turns(s)) + lane, moved.spin)
            if wp.static(s == last or weights[s] != 0.0):
                write_pair(exchange, wp.static(pairs(s, LEFT_RATE)) + lane, moved.left_u, moved.left_v)
            if wp.static(s == last):
                write_pair(exchange, wp.static(pairs(s, RIGHT_RATE)) + lane, moved.right_u, moved.right_v)
                ways = (h * h) * ways
                gain = h * sums
                if wp.static(tilts):
                    plane = plane_motion(felt_plane(run))
                    fall_x, fall_y, fall_turn = plane_load(plane, half_step, K, common.half_length, lane)
                    fall = h * vec3(fall_x, fall_y, fall_turn)
                    gain += fall
                    ways += half_step * fall
                elif wp.static(not has_load):
                    drop = h * common.gravity
                    gain[1] = gain[1] - drop
                    ways[1] = ways[1] - half_step * drop
                result.gain = gain
                turn = step * K[OMEGA, lane] + wp.float64(ways[2])
                x = K[X, lane] + (step * K[U, lane] + wp.float64(ways[0]))
                y = K[Y, lane] + (step * K[V, lane] + wp.float64(ways[1]))
                result.place = vec3d(x, y, K[THETA, lane] + turn)
                # direction: to the second power of the turn in double precision, higher ones in that of stages
                delta = real(turn)
                z = delta * delta
                _versine, lag = small_turn(delta)
                quartic = z * z * (wp.static(T4) - z * (wp.static(T6) - z * wp.static(T8)))
                half = HALF * turn
                cosine = K[COSINE, lane]
                sine = K[SINE, lane]
                more_cosine = common.per_length * (start_x * quartic + start_y * lag)
                more_sine = common.per_length * (start_y * quartic - start_x * lag)
                result.cosine = (cosine - turn * (sine + half * cosine)) + wp.float64(more_cosine)
                result.sine = (sine + turn * (cosine - half * sine)) + wp.float64(more_sine)
            barrier()
            if wp.static(s == 1):
                before = kept_joint(run, run.before)
                force_before_x = start_force(stage, before.x, before.u)
                force_before_y = start_force(stage, before.y, before.v)
            next_end = read_pair(exchange, wp.static(pairs(s, LEFT)) + run.after)
            end_before = read_pair(exchange, wp.static(pairs(s, RIGHT)) + run.before)
            spin = own.spin + (moved.spin - read_one(exchange, wp.static(turns(s)) + run.after))
            spin_before = before.spin + (read_one(exchange, wp.static(turns(s)) + run.before) - moved.spin)
            if wp.static(s < last):
                left = vec3(
                    force(stage, force_before_x, before.u, moved.left_x, end_before[0]),
                    force(stage, force_before_y, before.v, moved.left_y, end_before[1]),
                    torque_of(stage, friction_before[0], friction_before[1], spin_before),
                )
                right = vec3(
                    force(stage, own_force_x, own.u, next_end[0], moved.right_x),
                    force(stage, own_force_y, own.v, next_end[1], moved.right_y),
                    torque_of(stage, friction[0], friction[1], spin),
                )
                rates[s] = pushed(run, moved.arm_x, moved.arm_y, left, right)
                if wp.static(has_load):
                    rates[s] += load(run, stage.even, h * sums, (h * h) * ways)
                if wp.static(weights[s] != 0.0):
                    next_rate = read_pair(exchange, wp.static(pairs(s, LEFT_RATE)) + run.after)
                    rate_x = own.u + (next_rate[0] - moved.right_u)
                    rate_y = own.v + (next_rate[1] - moved.right_v)
                    result.friction += wp.static(real(weights[s])) * (right[2] * spin)
                    result.damping += wp.static(real(weights[s])) * (rate_x * rate_x + rate_y * rate_y)
            else:
                next_rate = read_pair(exchange, wp.static(pairs(s, LEFT_RATE)) + run.after)
                rate_before = read_pair(exchange, wp.static(pairs(s, RIGHT_RATE)) + run.before)
                opening = get(run, OPENING, lane)
                opening_before = get(run, OPENING, run.before)
                joint = Joint(
                    opening[0] + (h * own.u + (next_end[0] - moved.right_x)),
                    opening[1] + (h * own.v + (next_end[1] - moved.right_y)),
                    own.u + (next_rate[0] - moved.right_u),
                    own.v + (next_rate[1] - moved.right_v),
                    spin,
                )
                joint_before = Joint(
                    opening_before[0] + (h * before.u + (moved.left_x - end_before[0])),
                    opening_before[1] + (h * before.v + (moved.left_y - end_before[1])),
                    before.u + (moved.left_u - rate_before[0]),
                    before.v + (moved.left_v - rate_before[1]),
                    spin_before,
                )
                last_left = pull(run, common.stage, joint_before, run.before)
                last_right = pull(run, common.stage, joint, lane)
                rates[s] = pushed(run, moved.arm_x, moved.arm_y, last_left, last_right)
                result.push = rates[s]
                result.joint = joint
                result.last_friction = last_right[2] * spin
                result.last_damping = joint.u * joint.u + joint.v * joint.v
                if wp.static(weights[s] != 0.0):
                    result.friction += wp.static(real(weights[s])) * result.last_friction
                    result.damping += wp.static(real(weights[s])) * result.last_damping
                if wp.static(has_load):
                    rates[s] += load(run, h, gain, ways)
                result.opening = wp.float32(joint.x * joint.x + joint.y * joint.y)
                e = vec3()
                for j in range(wp.static(stages)):
                    if wp.static(velocity_errors[j] != 0.0):
                        e += wp.static(real(velocity_errors[j])) * rates[j]
                u = real(K[U, lane])
                v = real(K[V, lane])
                k = rates[0]
                error = wp.static(algebra.error_ratio)(
                    stage, e[0], e[1], e[2], u, v, omega, k[0], k[1], k[2], delta, inverse_tolerance
                )
                result.error = order_bits_single(wp.float32(error))
        u += result.gain[0]
        v += result.gain[1]
        w = common.half_length * (omega + result.gain[2])
        result.friction = h * result.friction
        result.damping = h * (common.stage.damping * result.damping)
        result.speed = wp.float32(real(2.0) * (u * u + v * v + w * w))
        return result

    @wp.func
    def accept(run: Run, result: Attempt):
        K = run.K
        lane = run.lane
        # all is read before anything is written, so that threads wait for memory once
        motion = three(K, U, lane) + doubles(result.gain)
        friction = K[layout.BOARD_LOST_FRICTION, lane] + wp.float64(result.friction)
        damping = K[layout.BOARD_LOST_DAMPING, lane] + wp.float64(result.damping)
        geometry.put(K, X, lane, result.place)
        geometry.put(K, U, lane, motion)
        geometry.put(K, COSINE, lane, wp.vec2d(result.cosine, result.sine))
        K[layout.BOARD_LOST_FRICTION, lane] = friction
        K[layout.BOARD_LOST_DAMPING, lane] = damping
        keep(run, result.joint, result.push, result.last_friction, result.last_damping)

    @wp.func
    def renew_direction(run: Run):
        cosine, sine = cos_sin(run.K[THETA, run.lane])
        geometry.put(run.K, COSINE, run.lane, wp.vec2d(cosine, sine))

    @wp.func
    def start_is_finite(run: Run):
        finite = bool(True)
        for row in range(6):
            finite = finite and wp.isfinite(run.K[row, run.lane])
        for part in range(wp.static(PUSH + 1)):
            pair = get(run, part, run.lane)
            finite = finite and wp.isfinite(pair[0]) and wp.isfinite(pair[1])
        return finite

    @wp.func
    def opening(run: Run):
        pair = get(run, OPENING, run.lane)
        return wp.float32(pair[0] * pair[0] + pair[1] * pair[1])

    @wp.func
    def kept_start(run: Run):
        """Where the start lies between launches: in the scratch, in rows of the board that need not be kept."""
        return address_on_board(run.kept, wp.static(layout.MASS) * run.kept.shape[1])

    @wp.func
    def load_start(run: Run):
        if wp.static(is_shared):
            for part in range(wp.static(KEPT)):
                pair = vec2()
                if run.lane < run.links:
                    pair = read_pair(kept_start(run), part * run.kept.shape[1] + run.lane)
                put(run, part, pair[0], pair[1])

    @wp.func
    def store_start(run: Run):
        if wp.static(is_shared):
            for part in range(wp.static(KEPT)):
                pair = get(run, part, run.lane)
                if run.lane < run.links:
                    write_pair(kept_start(run), part * run.kept.shape[1] + run.lane, pair[0], pair[1])

    functions = (take_constants, common_of, begin, attempt, accept, renew_direction, start_is_finite, opening)
    return BlockSteps(*functions, load_start, store_start)
