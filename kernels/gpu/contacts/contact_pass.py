"""The contact pass after an accepted step: first with floor or sprocket, then of the chain with itself."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import LIST_OVERFLOW, RUNNING
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.events.tallies import add_count, note_floor_impulse
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.board import publish, raise_value
from warpchain.kernels.gpu.contacts.neighbour_list import block_list
from warpchain.kernels.gpu.contacts.proximity import block_contact, block_proximity, upper_bound
from warpchain.kernels.gpu.contacts.self_contacts import TouchLayout, block_self_contacts
from warpchain.kernels.gpu.stage import Proximity, Run, constants
from warpchain.kernels.gpu.threads import barrier_count
from warpchain.kernels.gpu.upright import PlaneHooks
from warpchain.kernels.types import Worlds

MARGIN = wp.constant(wp.float32(1.0 + 2e-6))
"""More than the roundings of lengths in single precision."""


@functools.cache
def block_contact_pass(features: Features, block_dim: int, touch: TouchLayout, plane: PlaneHooks):
    """Warp functions (begin, look, meet) of the contacts, for all threads of a block.

    ``begin(run, worlds, proximity)`` → number of listed pairs, longest step [s] that cannot miss a contact (see
    ``time_to_contact`` of :mod:`gpu.contacts.proximity`), status, how far joints may move before the list may be stale
    if none is open [m]. The board is written, and a barrier passed. ``look(run, proximity, pairs, spare)`` → whether
    there is anything to do for ``meet``, and that longest step. ``meet(run, worlds, time, proximity, own gap, pairs,
    spare)`` → whether anything was hit, then the four of ``begin`` anew.
    """
    lists = list_layout(features.columns)
    has_fixed = features.fixed_body != "none"
    has_self = features.self_contact
    _, _, time_to_contact = block_proximity(features, block_dim)
    build_list = block_list(features.columns, block_dim)
    clear_contacts, find_contacts, resolve_contacts = block_self_contacts(features.columns, block_dim, touch)
    meet_sprocket = block_contact("moving sprocket")

    @wp.func
    def list_pairs(run: Run, worlds: Worlds, opening: wp.float32, is_far: bool):
        """Builds the neighbour list; the number of its pairs, and the status."""
        pairs = build_list(run, worlds.control.skin, upper_bound(opening), is_far)
        status = wp.where(pairs > wp.static(lists.capacity), LIST_OVERFLOW, RUNNING)
        return wp.min(pairs, wp.static(lists.capacity)), status

    @wp.func
    def spare_of(run: Run):
        """How far joints may move [m] before the list may be stale, if none is open: :func:`pair_list.slack_of`."""
        nearest = wp.cast(run.L[wp.static(lists.nearest)], wp.float32)
        return wp.float32(0.5) * nearest - wp.float32(constants(run.K).circle_radius)

    @wp.func
    def slack(spare: wp.float32, opening: wp.float32, displacement: wp.float32):
        """How far joints may still move [m]; rounding never makes it longer."""
        return spare - MARGIN * (wp.abs(spare) * wp.static(wp.float32(1e-6)) + opening + displacement)

    @wp.func
    def begin(run: Run, worlds: Worlds, proximity: Proximity):
        status = int(RUNNING)
        pairs = int(0)
        # kept from the last launch, since recomputing could round differently
        reach = wp.float32(worlds.time_to_contact[run.world])
        spare = wp.float32(0.0)
        if worlds.is_fresh[run.world] == 0:
            if wp.static(has_self):
                pairs = run.L[wp.static(lists.count)]
        else:
            if wp.static(has_self):
                pairs, status = list_pairs(run, worlds, proximity.opening, True)
            plane.begin_run(run)
            if wp.static(has_self):
                spare = spare_of(run)
            still = slack(spare, proximity.opening, wp.float32(0.0))
            reach = time_to_contact(run, pairs, proximity.gap, still, proximity.speed)
        if wp.static(has_self):
            spare = spare_of(run)
        return pairs, reach, status, spare

    @wp.func
    def look(run: Run, proximity: Proximity, pairs: int, spare: wp.float32):
        still = slack(spare, proximity.opening, proximity.displacement)
        is_near = wp.static(features.moving_sprocket)
        if wp.static(has_fixed):
            is_near = is_near or proximity.gap < wp.float32(0.0)
        if wp.static(has_self):
            is_near = is_near or pairs > 0 or not still > wp.float32(0.0)
        return is_near, time_to_contact(run, pairs, proximity.gap, still, proximity.speed)

    @wp.func
    def meet(
        run: Run,
        worlds: Worlds,
        time: wp.float64,
        proximity: Proximity,
        own_gap: wp.float32,
        listed: int,
        listed_spare: wp.float32,
    ):
        T = run.T
        lane = run.lane
        gap = proximity.gap
        opening = proximity.opening
        pairs = listed
        spare = listed_spare
        still = slack(spare, opening, proximity.displacement)
        status = int(RUNNING)
        is_hit = bool(False)
        is_near = bool(False)
        is_stale = bool(False)
        hits = int(0)
        if wp.static(has_fixed):
            if gap < wp.float32(0.0):
                is_near = bool(True)
                hits = plane.meet(run, worlds, time, own_gap)
                if hits > 0:
                    wp.atomic_add(T, wp.static(touch.fixed_hits), hits)
        if wp.static(features.moving_sprocket):
            is_near = bool(True)
            if lane < run.links:
                struck = meet_sprocket(run, worlds, time)
                hits += struck
                if struck > 0:
                    wp.atomic_add(worlds.counts, run.world, wp.static(layout.SPROCKET_IMPULSES), wp.int64(struck))
        if wp.static(has_self):
            is_stale = not still > wp.float32(0.0)
            if is_stale or pairs > 0:
                is_near = bool(True)
                publish(run)
                clear_contacts(run)
        if is_near:
            is_hit = barrier_count(T, wp.static(touch.votes), hits > 0) > 0
        if wp.static(has_fixed):
            if gap < wp.float32(0.0) and lane == 0:
                raise_value(run.K, layout.VALUE_FIXED_DEPTH, -gap)
                if wp.static(features.has_floor):
                    if is_hit and not run.is_driven:
                        note_floor_impulse(worlds, run.world, time)
        if wp.static(has_self):
            if is_stale:
                if lane == 0:
                    add_count(worlds, run.world, layout.LIST_BUILDS, wp.int64(1))
                pairs, status = list_pairs(run, worlds, opening, pairs == 0)
                spare = spare_of(run)
                still = slack(spare, opening, wp.float32(0.0))
            if pairs > 0:
                touched = constants(run.K)
                touching = find_contacts(run, touched, pairs, upper_bound(opening))
                if touching > 0:
                    hits = resolve_contacts(run, touched, touching)
                    if hits > 0:
                        wp.atomic_add(T, wp.static(touch.self_hits), hits)
                    if not is_hit:
                        is_hit = barrier_count(T, wp.static(touch.votes), hits > 0) > 0
        return is_hit, pairs, time_to_contact(run, pairs, gap, still, proximity.speed), status, spare

    return begin, look, meet
