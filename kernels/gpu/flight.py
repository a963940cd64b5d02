"""Flight on rigid joints in the block form: the stages of :mod:`cpu.implicit.rigid_flight`, one thread per link.

A link's numbers in the system of the stages are (cos, sin) times a, 1/m, I and g f'(w) of its right joint.
"""

import functools

import warp as wp

from warpchain.kernels.cpu.implicit.rosenbrock import GREATEST_TURN
from warpchain.kernels.cpu.implicit.solver import block_type
from warpchain.kernels.gpu.rigid import FRICTION_NUMBERS, FlightLayout, FlightMemory, block_rigid_joints
from warpchain.kernels.gpu.solver import block_solver
from warpchain.kernels.gpu.stage import Place, Trial, first_on, greatest_error, joint_constants, link_on, vec3d
from warpchain.kernels.gpu.threads import barrier, constant_table, exchange, read, write
from warpchain.kernels.layout import INERTIA, INVERSE_MASS, THETA
from warpchain.kernels.methods.w_tableaus import ROS34PW2
from warpchain.kernels.physics.elementary import ZERO, cos_sin
from warpchain.kernels.physics.joint import smoothed_torque
from warpchain.kernels.physics.rigid_joint import steepness, switch_smoothing

wp.set_module_options({"enable_backward": False})

mat33d = block_type(3)

COSINE, SINE, SHARE, TURNING, SLOPE = range(FRICTION_NUMBERS)


def _padded(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    return tuple((*row, *(0.0,) * (ROS34PW2.stages - len(row))) for row in rows)


NODES, COUPLINGS, WEIGHTS, ERRORS = 0, ROS34PW2.stages, 2 * ROS34PW2.stages, 2 * ROS34PW2.stages + 1
"""First rows of the coefficients."""
COEFFICIENTS = (*_padded(ROS34PW2.nodes), *_padded(ROS34PW2.couplings), ROS34PW2.weights, ROS34PW2.errors)


@functools.cache
def flight_attempt(block_dim: int):
    """Warp function that attempts a step on rigid joints in blocks of this size.

    Returns:
        ``attempt(M, K, place, h)`` → Trial, from the state and the accelerations on the board.
    """
    memory = FlightLayout(block_dim)
    kept, friction_start = memory.stages, memory.forces.size
    stages, gamma = ROS34PW2.stages, ROS34PW2.gamma
    coefficient = constant_table(COEFFICIENTS)
    hand, handed = exchange(block_dim)
    rigid = block_rigid_joints(block_dim)
    factorise, accelerate = rigid.factorise, rigid.accelerate

    @wp.func
    def couplings_of(S: wp.uint64, n: int, link: int, constant: wp.float64):
        before = wp.where(link == 0, n - 1, link - 1)
        after = wp.where(link == n - 1, 0, link + 1)
        tx = -read(S, wp.static(SINE * block_dim) + link)
        ty = read(S, wp.static(COSINE * block_dim) + link)
        left = read(S, wp.static(SHARE * block_dim) + link)
        right = read(S, wp.static(SHARE * block_dim) + after)
        lower = mat33d(-left, ZERO, ZERO, ZERO, -left, ZERO, -tx, -ty, -read(S, wp.static(SLOPE * block_dim) + before))
        upper = mat33d(
            -right,
            ZERO,
            -read(S, wp.static(SINE * block_dim) + after),
            ZERO,
            -right,
            read(S, wp.static(COSINE * block_dim) + after),
            ZERO,
            ZERO,
            -read(S, wp.static(SLOPE * block_dim) + link),
        )
        return lower, upper

    @wp.func
    def diagonal_of(S: wp.uint64, n: int, link: int, constant: wp.float64):
        before = wp.where(link == 0, n - 1, link - 1)
        after = wp.where(link == n - 1, 0, link + 1)
        tx = -read(S, wp.static(SINE * block_dim) + link)
        ty = read(S, wp.static(COSINE * block_dim) + link)
        both = read(S, wp.static(SHARE * block_dim) + link) + read(S, wp.static(SHARE * block_dim) + after)
        turning = read(S, wp.static(TURNING * block_dim) + link)
        turning += read(S, wp.static(SLOPE * block_dim) + before) + read(S, wp.static(SLOPE * block_dim) + link)
        return mat33d(both, ZERO, tx, ZERO, both, ty, -tx, -ty, turning)

    factor, solve = block_solver(memory.friction, couplings_of, diagonal_of)

    @wp.func
    def change(S: wp.uint64, lane: int, row: int, count: int, component: int):
        """Σ of a row of coefficients from the first stages' changes of one component."""
        total = ZERO
        j = int(0)
        while j < count:
            place = wp.static(kept) + (6 * j + component) * wp.static(block_dim) + lane
            total += coefficient(row, j) * read(S, place)
            j += 1
        return total

    @wp.func
    def attempt(
        M: FlightMemory,
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        h: wp.float64,
    ):
        lane = place.lane
        column = place.column
        S = M.memory
        Q = S + wp.uint64(wp.static(8 * friction_start))
        chain = joint_constants(K)
        # smoothing and slopes of friction for this step, and the matrix of its stages
        link = link_on(K, lane)
        first = first_on(K, lane)
        hand(M.forces, 0, lane, first.theta)
        hand(M.forces, 1, lane, link.omega)
        barrier()
        smoothing = switch_smoothing(chain, h, first.theta - handed(M.forces, 0, place.after))
        spin = link.omega - handed(M.forces, 1, place.after)
        slope = wp.static(wp.float64(gamma)) * h * steepness(chain, spin, smoothing)
        write(Q, wp.static(COSINE * block_dim) + lane, link.arm_x)
        write(Q, wp.static(SINE * block_dim) + lane, link.arm_y)
        write(Q, wp.static(SHARE * block_dim) + lane, K[INVERSE_MASS, column])
        write(Q, wp.static(TURNING * block_dim) + lane, K[INERTIA, column])
        write(Q, wp.static(SLOPE * block_dim) + lane, slope)
        barrier()
        factor(Q, place.links, lane, ZERO)
        barrier()
        power = ZERO
        i = int(0)
        while i < wp.static(stages):
            # directions and rates of the stage, Σ γ_ij k_j of the rates
            theta = K[THETA, lane] + change(S, lane, wp.static(NODES) + i, i, 2)
            u = link.u + change(S, lane, wp.static(NODES) + i, i, 3)
            v = link.v + change(S, lane, wp.static(NODES) + i, i, 4)
            omega = link.omega + change(S, lane, wp.static(NODES) + i, i, 5)
            coupled_u = change(S, lane, wp.static(COUPLINGS) + i, i, 3)
            coupled_v = change(S, lane, wp.static(COUPLINGS) + i, i, 4)
            coupled_omega = change(S, lane, wp.static(COUPLINGS) + i, i, 5)
            cosine, sine = cos_sin(theta)
            factorise(S, K, place, cosine, sine)
            hand(M.forces, 0, lane, omega)
            barrier()
            spin = omega - handed(M.forces, 0, place.after)
            torque = smoothed_torque(chain, spin, smoothing)
            power += coefficient(WEIGHTS, i) * torque * spin
            _force, ax, ay, at = accelerate(M, K, place, cosine, sine, omega, torque)
            # (λ, y) of the stage
            target = h * at + wp.static(wp.float64(1.0 / gamma)) * coupled_omega
            hand(M.forces, 0, lane, target)
            barrier()
            drag = slope * (target - handed(M.forces, 0, place.after))
            hand(M.ends, 0, lane, drag)
            barrier()
            pull = solve(Q, place.links, lane, ZERO, vec3d(ZERO, ZERO, handed(M.ends, 0, place.before) - drag))
            hand(M.forces, 0, lane, pull[0])
            hand(M.forces, 1, lane, pull[1])
            barrier()
            share = K[INVERSE_MASS, column]
            ku = h * ax + share * (pull[0] - handed(M.forces, 0, place.before))
            kv = h * ay + share * (pull[1] - handed(M.forces, 1, place.before))
            kw = h * at + pull[2]
            row = wp.static(kept) + 6 * i * wp.static(block_dim) + lane
            write(S, row, h * (u + coupled_u + wp.static(wp.float64(gamma)) * ku))
            write(S, row + wp.static(block_dim), h * (v + coupled_v + wp.static(wp.float64(gamma)) * kv))
            write(S, row + wp.static(2 * block_dim), h * (omega + coupled_omega + wp.static(wp.float64(gamma)) * kw))
            write(S, row + wp.static(3 * block_dim), ku)
            write(S, row + wp.static(4 * block_dim), kv)
            write(S, row + wp.static(5 * block_dim), kw)
            i += 1
        trial = Trial()
        theta = K[THETA, lane]
        turn = change(S, lane, WEIGHTS, wp.static(stages), 2)
        trial.x = link.x + change(S, lane, WEIGHTS, wp.static(stages), 0)
        trial.y = link.y + change(S, lane, WEIGHTS, wp.static(stages), 1)
        trial.theta = theta + turn
        trial.u = link.u + change(S, lane, WEIGHTS, wp.static(stages), 3)
        trial.v = link.v + change(S, lane, WEIGHTS, wp.static(stages), 4)
        trial.omega = link.omega + change(S, lane, WEIGHTS, wp.static(stages), 5)
        trial.turns_far = wp.abs(turn) > GREATEST_TURN
        new_cosine, new_sine = cos_sin(trial.theta)
        trial.cosine = new_cosine
        trial.sine = new_sine
        trial.friction = power
        error, scale = greatest_error(
            link,
            theta,
            first,
            h,
            change(S, lane, ERRORS, wp.static(stages), 0),
            change(S, lane, ERRORS, wp.static(stages), 1),
            change(S, lane, ERRORS, wp.static(stages), 2),
            change(S, lane, ERRORS, wp.static(stages), 3),
            change(S, lane, ERRORS, wp.static(stages), 4),
            change(S, lane, ERRORS, wp.static(stages), 5),
        )
        trial.error = error
        trial.scale = scale
        return trial

    return attempt
