"""The CPU loop over steps: one thread carries one chain through a bounded number of attempts.

A method attempts a step and estimates its error; the step controller (methods/controller.py) accepts or refuses it and
proposes the next step. A contact pass follows each accepted step. Every sample interval the chain is recorded and
watched. A rejected attempt changes nothing but its counter and the step.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import LIST_OVERFLOW, NOT_FINITE, RUNNING, STEP_LIMIT, STEP_TOO_SMALL
from warpchain.kernels.contacts.fixed_body import BODIES
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.cpu.contacts.neighbour_list import list_slack, neighbour_list
from warpchain.kernels.cpu.contacts.proximity import fixed_contacts, greatest_opening
from warpchain.kernels.cpu.contacts.self_contacts import self_contacts
from warpchain.kernels.cpu.contacts.time_to_contact import FLIGHT_SKIN, LEAST_SLACK, step_bound
from warpchain.kernels.cpu.explicit import place_ends
from warpchain.kernels.cpu.functions import cpu_method, rigid_flight
from warpchain.kernels.cpu.implicit.joint_switch import QUIET_TIME
from warpchain.kernels.cpu.rows import scratch_rows
from warpchain.kernels.cpu.tilting import (
    resolve_tilting_floor,
    shift_first_stage,
    tilting_gap,
    write_plane_sums,
)
from warpchain.kernels.events.present_chain import has_changed, present_chain
from warpchain.kernels.events.record import lacks_last_sample, record_is_full, write_sample
from warpchain.kernels.events.sample import next_mark, sampling
from warpchain.kernels.events.softening import book_softening, contact_step, spring_tolerance
from warpchain.kernels.events.summary import summarise
from warpchain.kernels.events.tallies import (
    add_count,
    attempts_made,
    book_loss,
    count_bounce,
    of_fixed_body,
    raise_extreme,
)
from warpchain.kernels.events.tilting import in_room, write_tilting_sample
from warpchain.kernels.features import COMPILER_FLAGS, Features
from warpchain.kernels.methods.controller import LEAST_SHRINKAGE, next_step
from warpchain.kernels.physics.elementary import ONE, ZERO
from warpchain.kernels.physics.geometry import whole_lanes
from warpchain.kernels.physics.plane import begin_plane_step, end_plane_step, on_plane
from warpchain.kernels.physics.scaled_loads import write_links
from warpchain.kernels.types import Chain, Control, Drive, Model, Record, State, read_ground

wp.set_module_options({"enable_backward": False})


@wp.func
def load_state(K: wp.array2d(dtype=wp.float64), model: Model, state: State, chain: Chain, world: int):
    """Fills the rows of the state; rows of losses start at zero, columns behind the links are links without mass."""
    i = int(0)
    while i < chain.link_count:
        row = int(0)
        while row < 6:
            K[row, i] = state.links[world, row, i]
            row += 1
        K[layout.LOST_FRICTION, i] = ZERO
        K[layout.LOST_DAMPING, i] = ZERO
        K[layout.LOST_FIXED, i] = ZERO
        i += 1
    # columns up to whole vectors
    while i < whole_lanes(chain.link_count):
        row = int(0)
        while row < wp.static(layout.STAGES):
            K[row, i] = ZERO
            row += 1
        i += 1
    write_links(K, model, world, state.load_factor[world])


@wp.func
def store_state(K: wp.array2d(dtype=wp.float64), state: State, chain: Chain, world: int, fixed_loss: int):
    """Writes the state and the losses since loading."""
    friction = ZERO
    damping = ZERO
    fixed = ZERO
    i = int(0)
    while i < chain.link_count:
        row = int(0)
        while row < 6:
            state.links[world, row, i] = K[row, i]
            row += 1
        friction += K[layout.LOST_FRICTION, i]
        damping += K[layout.LOST_DAMPING, i]
        fixed += K[layout.LOST_FIXED, i]
        i += 1
    state.losses[world, layout.LOSS_FRICTION] = friction
    state.losses[world, layout.LOSS_DAMPING] = damping
    state.losses[world, fixed_loss] = fixed


@wp.func
def state_is_finite(K: wp.array2d(dtype=wp.float64), chain: Chain):
    """False if the state or its first derivative holds an infinity or a NaN."""
    finite = bool(True)
    i = int(0)
    while i < chain.link_count:
        row = int(0)
        while row < 6:
            finite = finite and wp.isfinite(K[row, i])
            row += 1
        row = int(0)
        while row < 3:
            finite = finite and wp.isfinite(K[layout.STAGES + row, i])
            row += 1
        i += 1
    return finite


@functools.cache
def make_advance(features: Features):
    """Kernel ``advance(worlds, model, drive, state, record, scratch, lists, control)``, one thread per chain.

    worlds: (launched,) int32, the worlds to carry on; those whose status is not RUNNING are left alone. scratch: (W,
    rows, columns) float64, lists: (W, size) int32, see :mod:`layout` and :mod:`contacts.list_layout`; both belong to a
    world until its run ends.
    """
    columns = features.columns
    rows = scratch_rows(features.method, columns)
    tilts = features.tilts
    method = cpu_method(features.method, tilts)
    list_size = list_layout(columns).size
    list_count = list_layout(columns).count
    has_floor = features.has_floor
    has_fixed = features.fixed_body != "none"
    has_self = features.self_contact
    if has_fixed:
        fixed_gap, resolve_fixed = fixed_contacts(features.fixed_body)
        face_of, face_at = BODIES[features.fixed_body].face, BODIES[features.fixed_body].motion
    moves = features.moving_sprocket
    if moves:
        sprocket_gap, resolve_sprocket = fixed_contacts("moving sprocket")
        sprocket_at = BODIES["moving sprocket"].motion
    fixed_loss, fixed_depth, fixed_count = of_fixed_body(features.fixed_body)
    reuses_last = method.reuses_last
    is_driven = features.is_driven
    sample = sampling(features.fixed_body, tilts)
    present = present_chain(is_driven)
    first_stage, attempt, commit = method.first_stage, method.attempt, method.commit
    growth, shrinkage = method.growth, method.shrinkage
    # on the sprocket the pauses between impulses are too short for a flight
    flight = None if is_driven or moves else rigid_flight(features.method, columns)
    has_flight = flight is not None
    if flight is not None:
        attempt_flight, commit_flight = flight.attempt, flight.commit
        close_joints, open_joints = flight.close_joints, flight.open_joints
        flight_growth, flight_shrinkage = flight.growth, flight.shrinkage
    build_list = neighbour_list(columns)
    resolve_self_contacts = self_contacts(columns)
    bound_of_step = step_bound(features, has_flight)

    @wp.kernel(
        name="advance",
        module="unique",
        enable_backward=False,
        module_options={"cpu_compiler_flags": COMPILER_FLAGS},
    )
    def advance(
        worlds: wp.array(dtype=wp.int32),
        model: Model,
        drive: Drive,
        state: State,
        record: Record,
        scratch: wp.array3d(dtype=wp.float64),
        lists: wp.array2d(dtype=wp.int32),
        control: Control,
    ):
        world = worlds[wp.tid()]
        if state.status[world] != RUNNING:
            return
        chain = present(model, state, control, world)
        longest = contact_step(state, control, world, wp.static(is_driven))
        tolerance = spring_tolerance(drive, state, control, world, wp.static(is_driven))
        memory = scratch[world]
        K = wp.array(ptr=memory.ptr, shape=(wp.static(rows), wp.static(columns)), dtype=wp.float64)
        list_memory = lists[world]
        L = wp.array(ptr=list_memory.ptr, shape=(wp.static(list_size),), dtype=wp.int32)
        P = state.plane[world]
        ground = read_ground(model, world)
        still = Face()
        if wp.static(has_fixed):
            still = face_of(ground)
        status = int(RUNNING)
        if state.is_fresh[world] != 0:
            load_state(K, model, state, chain, world)
            place_ends(K, chain)
            if wp.static(tilts):
                write_plane_sums(K, P, chain)
            if wp.static(has_floor and tilts):
                state.gap[world] = tilting_gap(K, on_plane(chain, P, 0))
            elif wp.static(has_fixed):
                state.gap[world] = fixed_gap(K, chain, ground, still)
            if wp.static(has_self):
                if not build_list(K, L, chain, control.skin, greatest_opening(K, chain)):
                    status = int(LIST_OVERFLOW)
                state.slack[world] = list_slack(K, chain, control.skin, greatest_opening(K, chain))
            state.has_first_stage[world] = 0
            state.is_fresh[world] = 0
        gap = state.gap[world]
        slack = state.slack[world]
        has_first_stage = state.has_first_stage[world]
        time = state.time[world]
        step = state.step[world]
        last_error = state.last_error[world]
        is_rigid = state.is_rigid[world]
        closing_time = state.closing_time[world]
        other_step = state.other_step[world]
        attempts = int(0)
        while status == RUNNING and attempts < control.attempts and not record_is_full(record, world):
            if time >= next_mark(state, control, world):
                softness = state.softness[world]
                load_factor = state.load_factor[world]
                touches = state.counts[world, layout.SELF_IMPULSES]
                meetings = state.counts[world, layout.STRAND_IMPULSES]
                last_impulse = state.watch[world, layout.LAST_FLOOR_IMPULSE]
                status = sample(K, chain, drive, state, record, control, world, time, touches, meetings, last_impulse)
                longest = contact_step(state, control, world, wp.static(is_driven))
                tolerance = spring_tolerance(drive, state, control, world, wp.static(is_driven))
                if has_changed(state, world, softness, load_factor):
                    after = present(model, state, control, world)
                    book_softening(chain, after, state, world)
                    chain = after
                    if wp.static(is_driven):
                        write_links(K, model, world, state.load_factor[world])
                    has_first_stage = int(0)
                if status != RUNNING:
                    break
            stop_time = state.stop_time[world]
            if time >= stop_time:
                status = state.stop_status[world]
                break
            if wp.static(has_flight):
                # soft joints are not made rigid: their springs still ring when the next impulse comes
                if is_rigid == 0 and time >= closing_time and state.softness[world] == ZERO:
                    closed, lost = close_joints(K, chain)
                    closing_time = time + QUIET_TIME
                    if closed:
                        is_rigid = int(1)
                        slack = wp.float64(-1.0)  # flights have a greater skin: the list is built anew
                        step, other_step = other_step + ZERO, step + ZERO
                        last_error = ONE
                        place_ends(K, chain)
                        book_loss(state, world, layout.LOSS_JOINT_SWITCH, lost)
            if wp.static(not tilts):
                if is_rigid == 0 and has_first_stage == 0:
                    first_stage(K, chain)
                    has_first_stage = int(1)

            here = chain
            if wp.static(tilts):
                here = on_plane(chain, P, 0)
            h = wp.min(step, bound_of_step(K, L, here, still, control, is_rigid != 0, gap, slack, longest))
            reaches_stop = time + h >= stop_time
            if reaches_stop:
                h = stop_time - time

            felt = chain
            if wp.static(tilts):
                before = on_plane(chain, P, wp.static(layout.PLANE_MID))
                begin_plane_step(P, chain.gravity, h)
                felt = on_plane(chain, P, wp.static(layout.PLANE_MID))
                if has_first_stage == 0:
                    first_stage(K, felt)
                    has_first_stage = int(1)
                else:
                    shift_first_stage(K, before, felt)
            error_bits = wp.int64(0)
            if is_rigid == 0:
                error_bits = attempt(K, felt, h, tolerance)
            if wp.static(has_flight):
                if is_rigid != 0:
                    error_bits = attempt_flight(K, chain, h, control.flight_tolerance)
            error = wp.cast(error_bits, wp.float64)
            attempts += 1
            if not (error <= ONE):
                add_count(state, world, layout.REJECTED, wp.int64(1))
                if wp.isfinite(error):
                    factor = shrinkage(error)
                    if wp.static(has_flight):
                        if is_rigid != 0:
                            factor = flight_shrinkage(error)
                    step = h * factor
                else:
                    step = h * LEAST_SHRINKAGE
                    if not state_is_finite(K, chain):
                        status = int(NOT_FINITE)
                if status == RUNNING and step < control.smallest_step:
                    status = int(STEP_TOO_SMALL)
            else:
                if is_rigid == 0:
                    commit(K, chain, h)
                factor = growth(error, last_error, control.proportional)
                are_stiff = bool(True)
                if wp.static(has_flight):
                    if is_rigid != 0:
                        are_stiff = commit_flight(K, chain, h)
                        factor = flight_growth(error, last_error, control.proportional)
                add_count(state, world, layout.ACCEPTED, wp.int64(1))
                time = wp.where(reaches_stop, stop_time, time + h)
                step = next_step(step, h, factor)
                last_error = wp.max(error, wp.float64(1e-4))
                has_first_stage = int(wp.static(int(reuses_last)))
                place_ends(K, chain)
                opening = greatest_opening(K, chain)
                raise_extreme(state, world, layout.OPENING, opening)
                impulses = wp.int64(0)
                if wp.static(tilts):
                    write_plane_sums(K, P, chain)
                    end_plane_step(P, chain.gravity, h)
                if wp.static(has_fixed):
                    if wp.static(tilts):
                        gap = tilting_gap(K, felt)
                    else:
                        gap = fixed_gap(K, chain, ground, still)
                    if gap < ZERO:
                        raise_extreme(state, world, fixed_depth, -gap)
                        if wp.static(tilts):
                            impulses = resolve_tilting_floor(K, P, chain)
                        else:
                            impulses = resolve_fixed(K, chain, ground, face_at(still, drive, world, time))
                        add_count(state, world, fixed_count, impulses)
                        if wp.static(has_floor):
                            if impulses > wp.int64(0):
                                count_bounce(state, world, time, state.watch[world, layout.LAST_FLOOR_IMPULSE])
                                state.watch[world, layout.LAST_FLOOR_IMPULSE] = time
                if wp.static(moves):
                    moved = sprocket_at(Face(), drive, world, time)
                    overlap = -sprocket_gap(K, chain, ground, moved)
                    if overlap > ZERO:
                        raise_extreme(state, world, layout.SPROCKET_DEPTH, overlap)
                        on_sprocket = resolve_sprocket(K, chain, ground, moved)
                        add_count(state, world, layout.SPROCKET_IMPULSES, on_sprocket)
                        impulses += on_sprocket
                    gap = wp.min(gap, ZERO)  # the sprocket may come nearer by itself: steps stay short
                if wp.static(has_self):
                    skin = control.skin
                    least_slack = ZERO
                    if wp.static(has_flight):
                        if is_rigid != 0:
                            skin = FLIGHT_SKIN * control.skin
                            least_slack = LEAST_SLACK * skin
                    if slack > ZERO:
                        slack = list_slack(K, chain, skin, opening)
                    if not slack > least_slack:
                        add_count(state, world, layout.LIST_BUILDS, wp.int64(1))
                        if not build_list(K, L, chain, skin, opening):
                            status = int(LIST_OVERFLOW)
                        slack = list_slack(K, chain, skin, opening)
                    if L[wp.static(list_count)] > 0:
                        hits, strands, lost, depth = resolve_self_contacts(K, L, chain, opening)
                        add_count(state, world, layout.SELF_IMPULSES, hits)
                        add_count(state, world, layout.STRAND_IMPULSES, strands)
                        raise_extreme(state, world, layout.SELF_DEPTH, depth)
                        book_loss(state, world, layout.LOSS_SELF, lost)
                        impulses += hits
                if impulses > wp.int64(0):
                    has_first_stage = int(0)
                if wp.static(has_flight):
                    if impulses > wp.int64(0) or not are_stiff:
                        closing_time = time + QUIET_TIME
                        has_first_stage = int(0)
                        if is_rigid != 0:
                            lost = open_joints(K, chain)
                            is_rigid = int(0)
                            step, other_step = other_step + ZERO, step + ZERO
                            last_error = ONE
                            place_ends(K, chain)
                            book_loss(state, world, layout.LOSS_JOINT_SWITCH, lost)
            if status == RUNNING and attempts_made(state, world) >= control.step_limit:
                status = int(STEP_LIMIT)
        if lacks_last_sample(state, world, time, status):
            place_ends(K, chain)
            if wp.static(tilts):
                flat = summarise(K, chain)
                write_tilting_sample(P, state, record, world, time, flat, in_room(K, P, chain, flat))
            else:
                write_sample(state, record, world, time, summarise(K, chain))
        store_state(K, state, chain, world, wp.static(fixed_loss))
        state.gap[world] = gap
        state.slack[world] = slack
        state.has_first_stage[world] = has_first_stage
        state.time[world] = time
        state.step[world] = step
        state.last_error[world] = last_error
        state.is_rigid[world] = is_rigid
        state.closing_time[world] = closing_time
        state.other_step[world] = other_step
        state.status[world] = status

    return advance
