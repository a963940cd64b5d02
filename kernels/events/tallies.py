"""Counters, greatest depths and losses of energy of a world's run."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import ACCEPTED, BOUNCES, FLOOR_DEPTH, FLOOR_IMPULSES, LOSS_FLOOR, LOSS_SPROCKET, REJECTED
from warpchain.kernels.types import Rows, State

BOUNCE_PAUSE = wp.constant(wp.float64(0.01))
"""A floor impulse this long [s] after the one before it begins a new bounce."""


def of_fixed_body(is_driven: bool) -> tuple[int, int, int]:
    """Places of the loss, the greatest depth and the counter of impulses of the sprocket or the floor."""
    if is_driven:
        return LOSS_SPROCKET, layout.SPROCKET_DEPTH, layout.SPROCKET_IMPULSES
    return LOSS_FLOOR, FLOOR_DEPTH, FLOOR_IMPULSES


@wp.func
def add_count(state: State, world: int, counter: int, number: wp.int64):
    """Adds to a counter of ``State.counts``."""
    state.counts[world, counter] = state.counts[world, counter] + number


@wp.func
def note_floor_impulse(state: State, world: int, time: wp.float64):
    """Notes an impulse on the floor: the first of a new bounce if none has been for a while."""
    if time - state.watch[world, layout.LAST_FLOOR_IMPULSE] > BOUNCE_PAUSE:
        add_count(state, world, BOUNCES, wp.int64(1))
    state.watch[world, layout.LAST_FLOOR_IMPULSE] = time


@wp.func
def raise_extreme(state: State, world: int, extreme: int, value: wp.float64):
    """Raises an entry of ``State.extremes`` to a greater value [m]."""
    state.extremes[world, extreme] = wp.max(state.extremes[world, extreme], value)


@wp.func
def row_total(K: Rows, row: int, n: int):
    """Sum of the first n numbers of a row, in their order."""
    total = wp.float64(0.0)
    for i in range(n):
        total += K[row, i]
    return total


@wp.func
def book_loss(state: State, world: int, cause: int, energy: wp.float64):
    """Adds an energy [J] to an entry of ``State.losses``."""
    state.losses[world, cause] = state.losses[world, cause] + energy


@wp.func
def store_losses(K: Rows, first: int, state: State, world: int, n: int, fixed_loss: int):
    """Stores what n joints and links have lost since loading, from three rows: friction, damping, fixed body."""
    state.losses[world, layout.LOSS_FRICTION] = row_total(K, first, n)
    state.losses[world, layout.LOSS_DAMPING] = row_total(K, first + 1, n)
    state.losses[world, fixed_loss] = row_total(K, first + 2, n)


@wp.func
def attempts_made(state: State, world: int):
    """Attempts of the walk so far, those of its earlier phases included."""
    return state.attempts_before[world] + state.counts[world, ACCEPTED] + state.counts[world, REJECTED]
