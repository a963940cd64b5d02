"""Counters, greatest depths and losses of energy of a world's run."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import ACCEPTED, BOUNCES, FLOOR_DEPTH, FLOOR_IMPULSES, LOSS_FLOOR, LOSS_SPROCKET, REJECTED
from warpchain.kernels.types import Rows, Worlds

BOUNCE_PAUSE = wp.constant(wp.float64(0.01))
"""A floor impulse this long [s] after the one before it begins a new bounce."""


def of_fixed_body(is_driven: bool) -> tuple[int, int, int]:
    """Places of the loss, the greatest depth and the counter of impulses of the sprocket or the floor."""
    if is_driven:
        return LOSS_SPROCKET, layout.SPROCKET_DEPTH, layout.SPROCKET_IMPULSES
    return LOSS_FLOOR, FLOOR_DEPTH, FLOOR_IMPULSES


@wp.func
def add_count(worlds: Worlds, world: int, counter: int, number: wp.int64):
    """Adds to a counter of ``Worlds.counts``."""
    worlds.counts[world, counter] = worlds.counts[world, counter] + number


@wp.func
def note_floor_impulse(worlds: Worlds, world: int, time: wp.float64):
    """Notes an impulse on the floor: the first of a new bounce if none has been for a while."""
    if time - worlds.watch[world, layout.LAST_FLOOR_IMPULSE] > BOUNCE_PAUSE:
        add_count(worlds, world, BOUNCES, wp.int64(1))
    worlds.watch[world, layout.LAST_FLOOR_IMPULSE] = time


@wp.func
def raise_extreme(worlds: Worlds, world: int, extreme: int, value: wp.float64):
    """Raises an entry of ``Worlds.extremes`` to a greater value [m]."""
    worlds.extremes[world, extreme] = wp.max(worlds.extremes[world, extreme], value)


@wp.func
def row_total(K: Rows, row: int, n: int):
    """Sum of the first n numbers of a row, in their order."""
    total = wp.float64(0.0)
    for i in range(n):
        total += K[row, i]
    return total


@wp.func
def book_loss(worlds: Worlds, world: int, cause: int, energy: wp.float64):
    """Adds an energy [J] to an entry of ``Worlds.losses``."""
    worlds.losses[world, cause] = worlds.losses[world, cause] + energy


@wp.func
def store_losses(K: Rows, first: int, worlds: Worlds, world: int, n: int, fixed_loss: int):
    """Stores what n joints and links have lost since loading, from three rows: friction, damping, fixed body."""
    worlds.losses[world, layout.LOSS_FRICTION] = row_total(K, first, n)
    worlds.losses[world, layout.LOSS_DAMPING] = row_total(K, first + 1, n)
    worlds.losses[world, fixed_loss] = row_total(K, first + 2, n)


@wp.func
def attempts_made(worlds: Worlds, world: int):
    """Attempts of the walk so far, those of its earlier phases included."""
    return worlds.attempts_before[world] + worlds.counts[world, ACCEPTED] + worlds.counts[world, REJECTED]
