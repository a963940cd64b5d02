"""How a walk loses its loop: first contact of the chain with itself, of its strands, and collapse."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import BOUNCES, COLLAPSED_AT, SELF_CONTACT_AT, STRANDS_MET_AT
from warpchain.kernels.physics.elementary import HALF, ZERO
from warpchain.kernels.types import State


@wp.func
def note(state: State, world: int, first: int, time: wp.float64):
    """Notes an event that is new: its time, the bounces begun so far, and the time [s] since the last floor impulse.

    They stand in this order in ``State.watch`` from row ``first`` on. The last is infinite before the first bounce.
    """
    state.watch[world, first] = time
    state.watch[world, first + 1] = wp.float64(state.counts[world, BOUNCES])
    state.watch[world, first + 2] = time - state.watch[world, layout.LAST_FLOOR_IMPULSE]


@wp.func
def watch_ending(state: State, world: int, time: wp.float64, area: wp.float64, is_first: bool):
    """Notes the first samples with an impulse between links, or strands, before them, and with less than half the area.

    ``area`` is that inside the loop [m²]; a loop that is numbered clockwise has negative areas.
    """
    if is_first:
        state.first_area[world] = area
    if state.counts[world, layout.SELF_IMPULSES] > wp.int64(0) and state.watch[world, SELF_CONTACT_AT] < ZERO:
        note(state, world, SELF_CONTACT_AT, time)
    if state.counts[world, layout.STRAND_IMPULSES] > wp.int64(0) and state.watch[world, STRANDS_MET_AT] < ZERO:
        note(state, world, STRANDS_MET_AT, time)
    if area / state.first_area[world] < HALF and state.watch[world, COLLAPSED_AT] < ZERO:
        note(state, world, COLLAPSED_AT, time)
