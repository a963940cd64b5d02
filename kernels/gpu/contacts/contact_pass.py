"""The contact pass after an accepted step: first with floor or sprocket, then of the chain with itself."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import LIST_OVERFLOW, RUNNING
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.events.tallies import add_count, count_bounce
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.board import publish, raise_value
from warpchain.kernels.gpu.contacts.neighbour_list import block_list
from warpchain.kernels.gpu.contacts.proximity import block_proximity, moving_sprocket_contact, upper_bound
from warpchain.kernels.gpu.contacts.self_contacts import TouchLayout, block_self_contacts
from warpchain.kernels.gpu.stage import Place, Proximity, constants
from warpchain.kernels.gpu.threads import barrier_if_any
from warpchain.kernels.gpu.upright import BlockPlane
from warpchain.kernels.types import Control, Drive, Ground, Integers, Row, Rows, State

wp.set_module_options({"enable_backward": False})

HALF = wp.constant(wp.float32(0.5))


@functools.cache
def block_contact_pass(features: Features, block_dim: int, touch: TouchLayout, plane: BlockPlane):
    """Warp functions (begin, meet) of the contacts, for all threads of a block.

    Returns:
        ``begin(K, L, P, M, state, control, place, world, proximity)`` → number of listed pairs, longest step [s] that
        cannot miss a contact (see :func:`gpu.contacts.proximity.block_proximity`), status. The board is written, and a
        barrier passed.
        ``meet(K, L, T, E, F, P, M, drive, state, control, place, ground, world, time, proximity, pairs)`` → whether
        anything was hit, and the same three after the step.
    """
    lists = list_layout(features.columns)
    has_floor = features.has_floor
    has_fixed = features.fixed_body != "none"
    has_self = features.self_contact
    moves = features.moving_sprocket
    _, _, time_to_contact = block_proximity(features, block_dim)
    build_list = block_list(features.columns, block_dim)
    clear_contacts, find_contacts, resolve_contacts = block_self_contacts(features.columns, block_dim, touch)
    meet_sprocket = moving_sprocket_contact()
    begin_run, meet_fixed = plane.begin_run, plane.meet
    values = layout.BOARD_VALUES

    @wp.func
    def begin(
        K: Rows,
        L: Integers,
        P: Row,
        M: Row,
        state: State,
        control: Control,
        place: Place,
        world: int,
        proximity: Proximity,
    ):
        status = int(RUNNING)
        pairs = int(0)
        # kept from the last launch, since recomputing could round differently
        reach = wp.float32(state.time_to_contact[world])
        if state.is_fresh[world] == 0:
            if wp.static(has_self):
                pairs = L[wp.static(lists.count)]
        else:
            if wp.static(has_self):
                pairs = build_list(K, L, constants(K), place.lane, control.skin, upper_bound(proximity.opening))
                if pairs > wp.static(lists.capacity):
                    status = int(LIST_OVERFLOW)
            begin_run(K, P, M, place)
            slack = HALF * wp.float32(control.skin) - proximity.opening
            reach = time_to_contact(control, pairs, proximity.gap, slack, proximity.speed)
        return pairs, reach, status

    @wp.func
    def meet(
        K: Rows,
        L: Integers,
        T: Integers,
        E: Rows,
        F: Rows,
        P: Row,
        M: Row,
        drive: Drive,
        state: State,
        control: Control,
        place: Place,
        ground: Ground,
        world: int,
        time: wp.float64,
        proximity: Proximity,
        pairs_before: int,
    ):
        lane = place.lane
        gap = proximity.gap
        opening = proximity.opening
        pairs = pairs_before
        slack = HALF * wp.float32(control.skin) - opening - proximity.displacement
        status = int(RUNNING)
        is_hit = bool(False)
        is_near = bool(False)
        is_stale = bool(False)
        hits = int(0)
        if wp.static(has_fixed):
            if gap < wp.float32(0.0):
                is_near = bool(True)
                hits = meet_fixed(K, P, M, place, ground, drive, world, time)
                if hits > 0:
                    wp.atomic_add(T, wp.static(touch.fixed_hits), hits)
        if wp.static(moves):
            is_near = bool(True)
            if lane < place.links:
                hits += meet_sprocket(K, place, ground, drive, state, world, time)
        if wp.static(has_self):
            is_stale = not slack > wp.float32(0.0)
            if is_stale or pairs > 0:
                is_near = bool(True)
                publish(K, place)
                clear_contacts(T, lane, place.links)
        if is_near:
            is_hit = barrier_if_any(T, wp.static(touch.votes), hits > 0)
        if wp.static(has_fixed):
            if gap < wp.float32(0.0) and lane == 0:
                raise_value(K, layout.VALUE_FIXED_DEPTH, -gap)
                if wp.static(has_floor):
                    if is_hit:
                        count_bounce(state, world, time, K[wp.static(values), layout.VALUE_LAST_IMPULSE])
                        K[wp.static(values), layout.VALUE_LAST_IMPULSE] = time
        if wp.static(has_self):
            if is_stale:
                if lane == 0:
                    add_count(state, world, layout.LIST_BUILDS, wp.int64(1))
                pairs = build_list(K, L, constants(K), lane, control.skin, upper_bound(opening))
                if pairs > wp.static(lists.capacity):
                    status = int(LIST_OVERFLOW)
                    pairs = int(wp.static(lists.capacity))
                slack = HALF * wp.float32(control.skin) - opening
            if pairs > 0:
                touched = constants(K)
                touching = find_contacts(K, L, T, touched, lane, pairs, upper_bound(opening))
                if touching > 0:
                    hits = resolve_contacts(K, L, T, E, F, touched, lane, touching)
                    if hits > 0:
                        wp.atomic_add(T, wp.static(touch.self_hits), hits)
                    if not is_hit:
                        is_hit = barrier_if_any(T, wp.static(touch.votes), hits > 0)
        return is_hit, pairs, time_to_contact(control, pairs, gap, slack, proximity.speed), status

    return begin, meet
