"""The contact pass after an accepted step: first with floor or sprocket, then of the chain with itself."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import LIST_OVERFLOW
from warpchain.kernels.contacts.fixed_body import BODIES
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.cpu.contacts.neighbour_list import list_slack, neighbour_list
from warpchain.kernels.cpu.contacts.proximity import fixed_contacts
from warpchain.kernels.cpu.contacts.self_contacts import self_contacts
from warpchain.kernels.cpu.joints import Joints
from warpchain.kernels.cpu.upright import PlaneHooks
from warpchain.kernels.events.tallies import add_count, book_loss, note_floor_impulse, of_fixed_body, raise_extreme
from warpchain.kernels.features import Features
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.types import Chain, Ground, Integers, Row, Rows, Worlds


@functools.cache
def body_pass(features: Features, plane: PlaneHooks):
    """Warp function of the contacts with the floor or sprocket, and with a sprocket that moves above a floor.

    ``meet_bodies(K, P, chain, felt, ground, still, worlds, world)`` → number of impulses. ``felt``: the chain on
    the plane that it felt in the step; ``still``: the face but for its motion.
    """
    face_at = BODIES[features.fixed_body].motion
    _, depth, count = of_fixed_body(features.is_driven)
    moves = features.moving_sprocket
    if moves:
        sprocket_gap, resolve_sprocket = fixed_contacts("moving sprocket")
        sprocket_at = BODIES["moving sprocket"].motion

    @wp.func
    def meet_bodies(
        K: Rows, P: Row, chain: Chain, felt: Chain, ground: Ground, still: Face, worlds: Worlds, world: int
    ):
        time = worlds.time[world]
        impulses = wp.int64(0)
        gap = plane.gap(K, felt, ground, still)
        if gap < ZERO:
            raise_extreme(worlds, world, depth, -gap)
            impulses = plane.meet(K, P, chain, ground, face_at(still, worlds.drive, world, time))
            add_count(worlds, world, count, impulses)
            if wp.static(features.has_floor):
                if impulses > wp.int64(0):
                    note_floor_impulse(worlds, world, time)
        if wp.static(moves):
            moved = sprocket_at(Face(), worlds.drive, world, time)
            overlap = -sprocket_gap(K, chain, ground, moved)
            if overlap > ZERO:
                raise_extreme(worlds, world, layout.SPROCKET_DEPTH, overlap)
                on_sprocket = resolve_sprocket(K, P, chain, ground, moved)
                add_count(worlds, world, layout.SPROCKET_IMPULSES, on_sprocket)
                impulses += on_sprocket
            gap = wp.min(gap, ZERO)  # the sprocket may come nearer by itself: steps stay short
        worlds.gap[world] = gap
        return impulses

    return meet_bodies


@functools.cache
def link_pass(features: Features, joints: Joints):
    """Warp functions of the contacts of a chain with itself; ``opening``: greatest |C| [m] of the placed links.

    ``make_list(K, L, chain, worlds, world, skin, opening)`` makes the neighbour list, or ends the run if it overflows.
    ``meet_links(K, L, chain, worlds, world, opening)`` → number of impulses.
    """
    has_self = features.self_contact
    build_list = neighbour_list(features.columns)
    resolve = self_contacts(features.columns)
    lists = list_layout(features.columns)

    @wp.func
    def make_list(
        K: Rows, L: Integers, chain: Chain, worlds: Worlds, world: int, skin: wp.float64, opening: wp.float64
    ):
        if wp.static(has_self):
            if not build_list(K, L, chain, skin, opening):
                worlds.status[world] = LIST_OVERFLOW
            worlds.slack[world] = list_slack(K, chain, L[wp.static(lists.nearest)], opening)

    @wp.func
    def meet_links(K: Rows, L: Integers, chain: Chain, worlds: Worlds, world: int, opening: wp.float64):
        impulses = wp.int64(0)
        if wp.static(has_self):
            skin, least_slack = joints.margins(worlds, world)
            if worlds.slack[world] > ZERO:
                worlds.slack[world] = list_slack(K, chain, L[wp.static(lists.nearest)], opening)
            if not worlds.slack[world] > least_slack:
                add_count(worlds, world, layout.LIST_BUILDS, wp.int64(1))
                make_list(K, L, chain, worlds, world, skin, opening)
            if L[wp.static(lists.count)] > 0:
                hits, strands, lost, depth = resolve(K, L, chain, opening)
                add_count(worlds, world, layout.SELF_IMPULSES, hits)
                add_count(worlds, world, layout.STRAND_IMPULSES, strands)
                raise_extreme(worlds, world, layout.SELF_DEPTH, depth)
                book_loss(worlds, world, layout.LOSS_SELF, lost)
                impulses = hits
        return impulses

    return make_list, meet_links
