"""Where the numbers of a chain's stages lie: rows are quantities, columns links or joints.

They have memory of their own behind the rows of :mod:`layout`: clang then knows that a store of one precision does not
change a number of the other. Rows are whole cache lines, of odd number.
"""

import functools
from typing import Any

import warp as wp

from warpchain.kernels.methods.explicit_tableaus import Tableau
from warpchain.kernels.types import Rows

CACHE_LINE = 64
"""Bytes of a cache line, and of the longest vector."""

# Joints at the start of the step: force, rate of opening, spin; constants.
FORCE_AT_START, RATE, SPIN = 0, 2, 4
VISCOUS, COULOMB = 5, 6
# Links: constants; arm and velocity at the start of the step.
INVERSE_MASS, INVERSE_INERTIA = 7, 8
ARM_X, ARM_Y = 9, 10
U, V, OMEGA = 11, 12, 13
# On a plane that tilts: openings of joints at the start of the step; loads of the links' ends, in the order of
# physics.increments.EndLoad.
OPENING = 14
END_LOAD = 27
# A stage, see physics.increments.Moved; way [m] and change of velocity [m/s] of the links' centres under a load of a
# script, in rows that planes use otherwise. Rows of left ends and of the spin are padded: column n repeats column 0.
LEFT, RIGHT = 16, 18
LEFT_RATE, RIGHT_RATE = 20, 22
STAGE_ARM_X, STAGE_ARM_Y, STAGE_SPIN = 24, 25, 26
WAY, CHANGE = 27, 29
ERROR = 32
# Joint forces and torques, shifted by one: column i + 1 is joint i, column 0 repeats column n. At least 2048 bytes lie
# between them and rows that they are computed from or that are computed from them: closer, clang allows for a load that
# waits for the store of an earlier column, and vectorises by half as many.
FORCE, TORQUE = 35, 37
# Per stage: accelerations of x, y, θ; and if it has a weight in the new state, of each joint the power lost to friction
# and damping and, shifted by one, the force.
STAGES = 41
POWER_ROWS = 4


def needs_power(tableau: Tableau) -> tuple[bool, ...]:
    """Whether a stage has a weight in the new state, or is the next step's first stage, which has one."""
    weights, last = tableau.weights, tableau.stages - 1
    reused = tableau.first_same_as_last and weights[0] != 0
    return tuple(weight != 0 or (reused and stage == last) for stage, weight in enumerate(weights))


def stage_rows(tableau: Tableau) -> tuple[tuple[int, ...], tuple[int, ...], int]:
    """First row of each stage's accelerations, and of its powers, and their end.

    Stages that are used up make room for later ones: fewer rows stay in the cache.
    """
    stages = tableau.stages
    at_end = zip(tableau.velocity_weights, tableau.position_weights, tableau.velocity_errors, strict=True)
    last_use = [stages if any(weights) or stage in (0, stages - 1) else 0 for stage, weights in enumerate(at_end)]
    for stage, rows in enumerate(zip(tableau.velocity, tableau.position, strict=True)):
        for j, weights in enumerate(zip(*rows, strict=True)):
            if any(weights):
                last_use[j] = max(last_use[j], stage)
    busy: list[int] = []  # by slot, the stage from which on it is free
    slots = []
    for stage in range(stages):
        # a pass that finds the accelerations of a stage also reads what the next stage needs
        slot = next((slot for slot, until in enumerate(busy) if until <= stage), len(busy))
        busy[slot : slot + 1] = [last_use[stage]]
        slots.append(slot)
    first_power = STAGES + 3 * len(busy)
    needed = needs_power(tableau)
    powers = tuple(first_power + POWER_ROWS * sum(needed[:stage]) for stage in range(stages))
    return tuple(STAGES + 3 * slot for slot in slots), powers, first_power + POWER_ROWS * sum(needed)


def sums_over(real: Any, velocity: tuple[float, ...], position: tuple[float, ...], rows: tuple[int, ...]):
    """Warp function ``sums(S, i)``: Σ w_j (ẍ, ÿ, θ̈)_j of link i over the stages, for both rows of weights w."""
    # Vectors of two to four singles are passed in vector registers, which keeps clang from vectorising the loop around.
    six = wp.types.vector(length=6, dtype=real)

    @wp.func
    def sums(S: wp.array2d(dtype=real), i: int):
        total = six()
        for j in range(wp.static(len(velocity))):
            if wp.static(velocity[j] != 0.0):
                for k in range(3):
                    total[k] += wp.static(real(velocity[j])) * S[wp.static(rows[j]) + k, i]
            if wp.static(position[j] != 0.0):
                for k in range(3):
                    total[3 + k] += wp.static(real(position[j])) * S[wp.static(rows[j]) + k, i]
        return total

    return sums


def row_width(columns: int, size: int) -> int:
    """Numbers of this size [bytes] in a row, for a chain whose scratch has this many columns."""
    lanes = CACHE_LINE // size
    lines = -(-columns // lanes)
    return lanes * (lines + 1 - lines % 2)


def doubles_of_stages(tableau: Tableau, columns: int, size: int) -> int:
    """Doubles that stages in numbers of this size [bytes] take, with those before the next cache line."""
    return -(-stage_rows(tableau)[2] * row_width(columns, size) * size // 8) + CACHE_LINE // 8


@functools.cache
def rows_of_stages(tableau: Tableau, columns: int, first_row: int, real: Any):
    """Warp function ``rows(K)`` → the numbers, which lie in scratch of this width from a row on."""
    size = 4 if real is wp.float32 else 8
    offset = -(-8 * first_row * columns // CACHE_LINE) * CACHE_LINE

    @wp.func
    def rows(K: Rows):
        return wp.array(
            ptr=K.ptr + wp.uint64(wp.static(offset)),
            shape=(wp.static(stage_rows(tableau)[2]), wp.static(row_width(columns, size))),
            dtype=real,
        )

    return rows
