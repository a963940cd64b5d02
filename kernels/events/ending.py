"""How a walk loses its loop: first contact of the chain with itself, of its strands, and collapse."""

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.layout import BOUNCES, COLLAPSED_AT, SELF_CONTACT_AT, STRANDS_MET_AT
from warpchain.kernels.physics.elementary import HALF, ZERO
from warpchain.kernels.types import Worlds


@wp.func
def note(worlds: Worlds, world: int, first: int, time: wp.float64):
    """Notes an event that is new: its time, the bounces begun so far, and the time [s] since the last floor impulse.

    They stand in this order in ``Worlds.watch`` from row ``first`` on. The last is infinite before the first bounce.
    """
    worlds.watch[world, first] = time
    worlds.watch[world, first + 1] = wp.float64(worlds.counts[world, BOUNCES])
    worlds.watch[world, first + 2] = time - worlds.watch[world, layout.LAST_FLOOR_IMPULSE]


@wp.func
def watch_ending(worlds: Worlds, world: int, time: wp.float64, area: wp.float64, is_first: bool):
    """Notes the first samples with an impulse between links, or strands, before them, and with less than half the area.

    ``area`` is that inside the loop [m²]; a loop that is numbered clockwise has negative areas.
    """
    if is_first:
        worlds.first_area[world] = area
    if worlds.counts[world, layout.SELF_IMPULSES] > wp.int64(0) and worlds.watch[world, SELF_CONTACT_AT] < ZERO:
        note(worlds, world, SELF_CONTACT_AT, time)
    if worlds.counts[world, layout.STRAND_IMPULSES] > wp.int64(0) and worlds.watch[world, STRANDS_MET_AT] < ZERO:
        note(worlds, world, STRANDS_MET_AT, time)
    if area / worlds.first_area[world] < HALF and worlds.watch[world, COLLAPSED_AT] < ZERO:
        note(worlds, world, COLLAPSED_AT, time)
