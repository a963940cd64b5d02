"""The loop over steps in the block form: one block of threads carries one chain, one thread per link.

The same run as in :mod:`cpu.loop`, on the same structs and with the same functions of physics, for devices where a
block of threads is cheap. Stages live in registers, the state on a board in the memory that a block shares, where
neighbours and contacts meet. Everything that decides (error, gap, status …) is known to all threads alike, so that all
take the same branches. What a run gives depends neither on how it is cut into launches nor on the other chains.

An attempt on springs costs two barriers a stage and one for the error; an accepted one three more unless its last stage
is the first of the next step. Contacts cost nothing more while the floor or sprocket is out of reach and the list of
neighbours empty.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.cpu.contacts.neighbour_list import list_layout
from warpchain.kernels.cpu.implicit.joint_switch import QUIET_TIME
from warpchain.kernels.cpu.loop import (
    BOUNCE_PAUSE,
    COMPILER_FLAGS,
    LIST_OVERFLOW,
    NOT_FINITE,
    RUNNING,
    STEP_LIMIT,
    STEP_TOO_SMALL,
    Features,
)
from warpchain.kernels.events.present_chain import has_changed, present_chain
from warpchain.kernels.events.record import record_is_full, write_sample
from warpchain.kernels.events.softening import softened
from warpchain.kernels.events.summary import summarise
from warpchain.kernels.gpu.board import (
    contact_constants,
    link_is_finite,
    load_link,
    note_constants,
    publish,
    store_link,
    store_losses,
    take_place,
)
from warpchain.kernels.gpu.contacts.neighbour_list import block_list
from warpchain.kernels.gpu.contacts.proximity import block_surroundings, raised
from warpchain.kernels.gpu.contacts.self_contacts import block_self_contacts, touch_layout
from warpchain.kernels.gpu.functions import board_rows, shares_board, shares_memory
from warpchain.kernels.gpu.hand_over import block_hand_over, flight_of, list_margins, step_factors, take_turns
from warpchain.kernels.gpu.rigid import FlightMemory
from warpchain.kernels.gpu.sample import block_look, note_bounds
from warpchain.kernels.gpu.stage import Place, Trial, block_stage, error_of, link_on, note_first, vec3d, vec5d
from warpchain.kernels.gpu.threads import barrier, barrier_if_any, block_maxima, clock, tile_address, vec4i
from warpchain.kernels.layout import (
    ACCEPTED,
    BOARD_LOST_DAMPING,
    BOARD_LOST_FRICTION,
    BOARD_LOST_SELF,
    BOARD_NOTES,
    BOUNCES,
    COSINE,
    FLOOR_DEPTH,
    FLOOR_IMPULSES,
    INERTIA,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LAST_FLOOR_IMPULSE,
    LIST_BUILDS,
    MASS,
    NOTE_CLOSING_TIME,
    NOTE_CONTACT_STEP,
    NOTE_DAMPING,
    NOTE_DEADLINE,
    NOTE_FIXED_DEPTH,
    NOTE_LAST_IMPULSE,
    NOTE_NEXT_LOOK,
    NOTE_OPENING,
    NOTE_OTHER_STEP,
    NOTE_STOP_TIME,
    NOTE_TOLERANCE,
    OMEGA,
    OPENING,
    REJECTED,
    SELF_DEPTH,
    SELF_IMPULSES,
    SINE,
    SPROCKET_DEPTH,
    SPROCKET_IMPULSES,
    THETA,
    TIME,
    U,
    V,
    X,
    Y,
)
from warpchain.kernels.methods.controller import LEAST_SHRINKAGE
from warpchain.kernels.methods.method import METHODS
from warpchain.kernels.physics.elementary import ONE, ZERO
from warpchain.kernels.physics.scaled_loads import under_load
from warpchain.kernels.types import Control, Drive, Model, Record, State, read_chain

wp.set_module_options({"enable_backward": False})

REGISTERS_OF_MULTIPROCESSOR = 65536


@functools.cache
def make_advance_block(features: Features, block_dim: int, registers: int | None = None):
    """Kernel with the arguments of :func:`cpu.loop.make_advance`, launched with ``wp.launch_tiled``, one block a world.

    Args:
        features: What the kernel is compiled for.
        block_dim: Threads in a block, at least the number of links of every chain; on a GPU a multiple of 32.
        registers: Greatest number of registers a thread may take on a GPU; None: as many as a block of this size can
            have.

    scratch: (W, ≥ :func:`gpu.functions.block_rows`, columns) float64; lists as for the CPU form.
    """
    available = REGISTERS_OF_MULTIPROCESSOR // block_dim // 8 * 8
    if available < 255:
        registers = min(registers or available, available)
    method = METHODS[features.method]
    columns = features.columns
    lists = list_layout(columns)
    has_floor = features.fixed_body == "floor"
    has_sprocket = features.fixed_body == "sprocket"
    has_fixed = has_floor or has_sprocket
    has_self = features.self_contact
    has_contacts = has_fixed or has_self
    fixed_loss = layout.LOSS_SPROCKET if has_sprocket else layout.LOSS_FLOOR
    fixed_depth = SPROCKET_DEPTH if has_sprocket else FLOOR_DEPTH
    fixed_count = SPROCKET_IMPULSES if has_sprocket else FLOOR_IMPULSES
    reuses_last, needs_first_power = method.reuses_last, method.needs_first_power
    is_shared = shares_board(block_dim)
    width = block_dim + 1
    kept_width = columns if is_shared else width
    board_size = layout.board_size(block_dim) if is_shared else 1
    touch = touch_layout(columns, block_dim, in_lists=not is_shared)
    touch_size = touch.size if is_shared else 1
    has_flight = flight_of(features) is not None
    holds_memory = shares_memory(features.method, block_dim)
    needs_memory = has_flight or method.flight is None
    memory_size = max(method.block_memory(block_dim), 1) if holds_memory and needs_memory else 1
    board_address = tile_address(wp.float64, board_size)
    touch_address = tile_address(wp.int32, touch_size)
    memory_address = tile_address(wp.float64, memory_size)
    ends_address = tile_address(vec5d, block_dim)
    forces_address = tile_address(vec3d, block_dim)
    exchange_ends, stage = block_stage(block_dim)
    greatest, _note, _noted = block_maxima(block_dim)
    maxima_address = tile_address(vec4i, block_dim)
    survey, surveyed, reach_of, meet_fixed_body = block_surroundings(features, block_dim)
    attempt = method.block_attempt(block_dim, survey, surveyed)
    grow, shrink = step_factors(features)
    margins = list_margins(features)
    build_list = block_list(columns, block_dim, features.broad_phase)
    clear_contacts, find_contacts, resolve_contacts = block_self_contacts(columns, block_dim, touch)
    flight = block_hand_over(features, block_dim) if has_flight else None
    take_off, follow, land = (flight.take_off, flight.follow, flight.land) if flight else (None,) * 3
    attempt_flight, longest_step = (flight.attempt, flight.longest_step) if flight else (None,) * 2
    softens = features.softens
    is_driven = features.watch == "steady"
    present = present_chain(softens, is_driven)
    look = block_look(features, touch)

    @wp.func
    def begin_step(forces: wp.tile[vec3d, block_dim], K: wp.array2d(dtype=wp.float64), place: Place, next_end: vec5d):
        """Works out the first stage of the next step; ``next_end``: left end of the next link."""
        column = place.column
        first = stage(
            forces, K, place, next_end, link_on(K, place.lane), K[INVERSE_MASS, column], K[INVERSE_INERTIA, column]
        )
        note_first(K, place.lane, first, wp.static(needs_first_power))

    @wp.func
    def look_around(ends: wp.tile[vec5d, block_dim], K: wp.array2d(dtype=wp.float64), maxima: wp.uint64, place: Place):
        """Left end of the next link and what is known of the whole chain, in the state on the board."""
        link = link_on(K, place.lane)
        next_end = exchange_ends(ends, place, link)
        survey(K, maxima, place, link, next_end)
        barrier()
        return next_end, surveyed(maxima)

    @wp.kernel(
        module="unique",
        enable_backward=False,
        grid_stride=False,
        cuda_max_registers=registers,
        module_options={"cpu_compiler_flags": COMPILER_FLAGS},
    )
    def advance_block(
        worlds: wp.array(dtype=wp.int32),
        model: Model,
        drive: Drive,
        state: State,
        record: Record,
        scratch: wp.array3d(dtype=wp.float64),
        lists_of_worlds: wp.array2d(dtype=wp.int32),
        control: Control,
    ):
        block, lane = wp.tid()
        world = worlds[block]
        ends = wp.tile_empty(shape=(wp.static(block_dim),), dtype=vec5d, storage="shared")
        forces = wp.tile_empty(shape=(wp.static(block_dim),), dtype=vec3d, storage="shared")
        errors = wp.tile_empty(shape=(wp.static(block_dim),), dtype=wp.int32, storage="shared")
        maxima = wp.tile_empty(shape=(wp.static(block_dim),), dtype=vec4i, storage="shared")
        board = wp.tile_empty(shape=(wp.static(board_size),), dtype=wp.float64, storage="shared")
        touches = wp.tile_empty(shape=(wp.static(touch_size),), dtype=wp.int32, storage="shared")
        memory = wp.tile_empty(shape=(wp.static(memory_size),), dtype=wp.float64, storage="shared")
        if state.status[world] != RUNNING:
            return
        kept = wp.array(
            ptr=scratch[world].ptr, shape=(wp.static(layout.BOARD_NOTES), wp.static(kept_width)), dtype=wp.float64
        )
        list_row = lists_of_worlds[world]
        L = wp.array(ptr=list_row.ptr, shape=(wp.static(lists.size),), dtype=wp.int32)
        board_start = board_address(board)
        touch_start = touch_address(touches)
        if wp.static(not is_shared):
            board_start = scratch[world].ptr
            touch_start = list_row.ptr
        K = wp.array(ptr=board_start, shape=(wp.static(layout.BOARD_ROWS), wp.static(width)), dtype=wp.float64)
        T = wp.array(ptr=touch_start, shape=(wp.static(touch.size),), dtype=wp.int32)
        memory_start = memory_address(memory)
        if wp.static(not holds_memory):
            memory_start = scratch[world].ptr + wp.uint64(wp.static(8 * board_rows(block_dim, columns) * columns))
        # what stages hand over is not needed while contacts are resolved
        ends_start = ends_address(ends)
        forces_start = forces_address(forces)
        E = wp.array(ptr=ends_start, shape=(5, wp.static(block_dim)), dtype=wp.float64)
        F = wp.array(ptr=forces_start, shape=(3, wp.static(block_dim)), dtype=wp.float64)
        maxima_start = maxima_address(maxima)
        flight_memory = FlightMemory()
        flight_memory.ends = ends_start
        flight_memory.forces = forces_start
        flight_memory.memory = memory_start

        chain = read_chain(model, world)
        if wp.static(is_driven):
            chain = under_load(chain, state.load_factor[world])
        n = chain.link_count
        place = take_place(chain, lane)
        load_link(K, state, world, lane, n)
        is_fresh = state.is_fresh[world] != 0
        if lane < n:
            inner = lane % 2 == 0
            K[MASS, lane] = wp.where(inner, chain.inner_mass, chain.outer_mass)
            K[INERTIA, lane] = wp.where(inner, chain.inner_inertia, chain.outer_inertia)
            K[INVERSE_MASS, lane] = ONE / K[MASS, lane]
            K[INVERSE_INERTIA, lane] = ONE / K[INERTIA, lane]
            row = int(BOARD_LOST_SELF)
            while row < wp.static(layout.BOARD_NOTES):
                K[row, lane] = wp.where(is_fresh, ZERO, kept[row, lane])
                row += 1
        if lane == 0:
            if wp.static(softens):
                chain = softened(chain, control, state.softness[world])
            note_constants(K, chain)
            note_bounds(K, drive, state, control, world, wp.static(is_driven))
            K[BOARD_NOTES, NOTE_OPENING] = state.extremes[world, OPENING]
            K[BOARD_NOTES, NOTE_FIXED_DEPTH] = state.extremes[world, fixed_depth]
            K[BOARD_NOTES, NOTE_LAST_IMPULSE] = state.watch[world, LAST_FLOOR_IMPULSE]
            K[BOARD_NOTES, NOTE_STOP_TIME] = state.stop_time[world]
            K[BOARD_NOTES, NOTE_NEXT_LOOK] = wp.float64(state.next_sample[world]) * control.sample_interval
            if wp.static(has_flight):
                K[BOARD_NOTES, NOTE_CLOSING_TIME] = state.closing_time[world]
                K[BOARD_NOTES, NOTE_OTHER_STEP] = state.other_step[world]
            T[wp.static(touch.fixed_hits)] = 0
            T[wp.static(touch.self_hits)] = 0
            T[wp.static(touch.deepest)] = 0
            T[wp.static(touch.is_late)] = 0
            T[wp.static(touch.votes)] = 0
            K[BOARD_NOTES, NOTE_DEADLINE] = clock() + control.launch_time
        barrier()  # the chain's constants are on the board
        publish(K, place)
        barrier()
        next_end, around = look_around(ends, K, maxima_start, place)
        opening = around.opening
        status = int(RUNNING)
        pairs = int(0)
        slack = wp.float32(0.5) * wp.float32(control.skin) - opening
        if is_fresh:
            if wp.static(has_self):
                pairs = build_list(K, L, chain, lane, control.skin, raised(opening))
                if pairs > wp.static(lists.capacity):
                    status = int(LIST_OVERFLOW)
        reach = reach_of(control, pairs, around.gap, slack, around.speed)
        if not is_fresh:
            # as the last step left them: worked out anew they could round differently
            reach = wp.float32(state.reach[world])
            if wp.static(has_flight):
                slack = wp.float32(state.slack[world])
            if wp.static(has_self):
                pairs = L[wp.static(lists.count)]
        if is_fresh or state.has_first_stage[world] == 0:
            begin_step(forces, K, place, next_end)
        time = state.time[world]
        step = state.step[world]
        last_error = wp.float32(state.last_error[world])
        attempts_before = state.attempts_before[world] + state.counts[world, ACCEPTED] + state.counts[world, REJECTED]
        attempts_left = int(wp.min(wp.int64(control.attempts), control.step_limit - attempts_before))
        if record_is_full(record, world):
            attempts_left = 0
        is_rigid = int(0)
        if wp.static(has_flight):
            is_rigid = state.is_rigid[world]
        attempts = int(0)
        accepted = int(0)
        barrier()
        while status == RUNNING and attempts < attempts_left:
            if time >= K[BOARD_NOTES, NOTE_NEXT_LOOK]:
                softness = state.softness[world]
                load_factor = state.load_factor[world]
                publish(K, place)
                barrier()
                if lane == 0:
                    look(K, T, model, drive, state, record, control, world, time)
                barrier()
                status = T[wp.static(touch.mailbox)]
                pauses = record_is_full(record, world) or T[wp.static(touch.is_late)] != 0
                barrier()
                if wp.static(softens or is_driven):
                    if has_changed(state, world, softness, load_factor) and is_rigid == 0:
                        next_end = exchange_ends(ends, place, link_on(K, lane))
                        begin_step(forces, K, place, next_end)
                if pauses or status != RUNNING:
                    break
            stop_time = K[BOARD_NOTES, NOTE_STOP_TIME]
            if time >= stop_time:
                status = state.stop_status[world]
                break

            if wp.static(has_flight):
                if is_rigid == 0:
                    if take_off(flight_memory, K, state, world, place, time):
                        is_rigid = int(1)
                        slack = wp.float32(-1.0)  # the next list has the skin of flights
                        last_error = wp.float32(1.0)
                        step = take_turns(K, lane, step)

            h = step
            if wp.static(has_contacts):
                bound = wp.max(K[BOARD_NOTES, NOTE_CONTACT_STEP], wp.float64(reach))
                if wp.static(has_flight):
                    if is_rigid != 0:
                        bound = longest_step(K, L, maxima_start, place, pairs, slack)
                h = wp.min(h, bound)
            lands = time + h >= stop_time
            if lands:
                h = stop_time - time

            tolerance = K[BOARD_NOTES, NOTE_TOLERANCE]
            if wp.static(has_flight):
                trial = Trial()
                if is_rigid == 0:
                    trial = attempt(ends, forces, maxima_start, memory_start, K, place, h, tolerance)
                else:
                    trial = attempt_flight(flight_memory, K, place, h)
                    tolerance = control.flight_tolerance
            else:
                trial = attempt(ends, forces, maxima_start, memory_start, K, place, h, tolerance)
            own_error = int(0)
            if lane < n:
                own_error = error_of(trial, tolerance)
            error = wp.cast(greatest(errors, lane, own_error), wp.float32)
            attempts += 1
            if not (error <= wp.float32(1.0)):
                if wp.isfinite(error):
                    step = h * shrink(error, is_rigid)
                else:
                    step = h * LEAST_SHRINKAGE
                    broken = wp.where(lane >= n or link_is_finite(K, lane), 0, 1)
                    barrier()  # all have read the errors
                    if greatest(errors, lane, broken) > 0:
                        status = int(NOT_FINITE)
                if status == RUNNING and step < control.smallest_step:
                    status = int(STEP_TOO_SMALL)
            else:
                accepted += 1
                if lane < n:
                    K[BOARD_LOST_FRICTION, lane] = K[BOARD_LOST_FRICTION, lane] + h * trial.friction
                    dissipation = K[BOARD_NOTES, NOTE_DAMPING] * trial.damping
                    K[BOARD_LOST_DAMPING, lane] = K[BOARD_LOST_DAMPING, lane] + h * dissipation
                    K[X, lane] = trial.x
                    K[Y, lane] = trial.y
                    K[THETA, lane] = trial.theta
                    K[U, lane] = trial.u
                    K[V, lane] = trial.v
                    K[OMEGA, lane] = trial.omega
                    K[COSINE, lane] = trial.cosine
                    K[SINE, lane] = trial.sine
                    if wp.static(reuses_last):
                        note_first(K, lane, trial.last, wp.static(needs_first_power))
                time = wp.where(lands, stop_time, time + h)
                proposal = h * grow(error, last_error, control.proportional, is_rigid)
                # a step that was cut short says nothing against the proposal that it was cut from
                step = wp.where(h < step, wp.max(step, proposal), proposal)
                last_error = wp.max(error, wp.float32(1e-4))
                around = trial.around
                if wp.static(not reuses_last):
                    next_end, around = look_around(ends, K, maxima_start, place)
                if wp.static(has_flight):
                    are_rigid = bool(True)
                    kinetic = ZERO
                    if is_rigid != 0:
                        are_rigid, is_stiff, kinetic = follow(flight_memory, K, place)
                        next_end, around = look_around(ends, K, maxima_start, place)
                opening = around.opening
                gap = around.gap
                if lane == 0:
                    K[BOARD_NOTES, NOTE_OPENING] = wp.max(K[BOARD_NOTES, NOTE_OPENING], wp.float64(opening))
                is_hit = bool(False)
                is_near = bool(False)
                is_stale = bool(False)
                hits = int(0)
                if wp.static(has_fixed):
                    if gap < wp.float32(0.0):
                        is_near = bool(True)
                        if lane < n:
                            hits = meet_fixed_body(K, place, contact_constants(K, n), drive, world, time)
                        if hits > 0:
                            wp.atomic_add(T, wp.static(touch.fixed_hits), hits)
                if wp.static(has_self):
                    skin, slack, is_stale = margins(control, is_rigid, slack, opening, around.displacement)
                    if is_stale or pairs > 0:
                        is_near = bool(True)
                        publish(K, place)
                        clear_contacts(T, lane, n)
                if is_near:
                    is_hit = barrier_if_any(T, wp.static(touch.votes), hits > 0)
                if wp.static(has_fixed):
                    if gap < wp.float32(0.0) and lane == 0:
                        K[BOARD_NOTES, NOTE_FIXED_DEPTH] = wp.max(K[BOARD_NOTES, NOTE_FIXED_DEPTH], wp.float64(-gap))
                        if wp.static(has_floor):
                            if is_hit:
                                if time - K[BOARD_NOTES, NOTE_LAST_IMPULSE] > BOUNCE_PAUSE:
                                    state.counts[world, BOUNCES] = state.counts[world, BOUNCES] + wp.int64(1)
                                K[BOARD_NOTES, NOTE_LAST_IMPULSE] = time
                if wp.static(has_self):
                    if is_stale:
                        if lane == 0:
                            state.counts[world, LIST_BUILDS] = state.counts[world, LIST_BUILDS] + wp.int64(1)
                        pairs = build_list(K, L, contact_constants(K, n), lane, skin, raised(opening))
                        if pairs > wp.static(lists.capacity):
                            status = int(LIST_OVERFLOW)
                            pairs = int(wp.static(lists.capacity))
                        slack = wp.float32(0.5) * wp.float32(skin) - opening
                    if pairs > 0:
                        touched = contact_constants(K, n)
                        touching = find_contacts(K, L, T, touched, lane, pairs, raised(opening))
                        if touching > 0:
                            hits = resolve_contacts(K, L, T, E, F, touched, lane, touching)
                            if hits > 0:
                                wp.atomic_add(T, wp.static(touch.self_hits), hits)
                            if not is_hit:
                                is_hit = barrier_if_any(T, wp.static(touch.votes), hits > 0)
                if wp.static(has_flight):
                    if is_hit or not are_rigid:
                        if is_rigid != 0:
                            land(flight_memory, K, state, world, place, is_stiff, kinetic)
                            is_rigid = int(0)
                            is_hit = bool(True)
                            last_error = wp.float32(1.0)
                            step = take_turns(K, lane, step)
                        if lane == 0:
                            K[BOARD_NOTES, NOTE_CLOSING_TIME] = time + QUIET_TIME
                reach = reach_of(control, pairs, gap, slack, around.speed)
                if is_hit or wp.static(not reuses_last):
                    if is_hit:
                        next_end = exchange_ends(ends, place, link_on(K, lane))
                    begin_step(forces, K, place, next_end)
        attempts_before = state.attempts_before[world] + state.counts[world, ACCEPTED] + state.counts[world, REJECTED]
        if status == RUNNING and attempts_before + wp.int64(attempts) >= control.step_limit:
            status = int(STEP_LIMIT)
        is_last = status != RUNNING and status != NOT_FINITE and state.last_sample[world, TIME] != time
        publish(K, place)
        barrier()
        if lane < n:
            store_link(K, state, world, lane)
            left = wp.array(
                ptr=scratch[world].ptr, shape=(wp.static(layout.BOARD_NOTES), wp.static(kept_width)), dtype=wp.float64
            )
            row = int(BOARD_LOST_SELF)
            while row < wp.static(layout.BOARD_NOTES):
                left[row, lane] = K[row, lane]
                row += 1
        if lane == 0:
            if is_last:
                # the series ends with the state in which the run ends
                write_sample(state, record, world, time, summarise(K, present(model, state, control, world)))
            store_losses(K, state, world, n, wp.static(fixed_loss))
            counts = state.counts[world]
            counts[ACCEPTED] = counts[ACCEPTED] + wp.int64(accepted)
            counts[REJECTED] = counts[REJECTED] + wp.int64(attempts - accepted)
            counts[fixed_count] = counts[fixed_count] + wp.int64(T[wp.static(touch.fixed_hits)])
            counts[SELF_IMPULSES] = counts[SELF_IMPULSES] + wp.int64(T[wp.static(touch.self_hits)])
            state.extremes[world, OPENING] = K[BOARD_NOTES, NOTE_OPENING]
            state.extremes[world, SELF_DEPTH] = wp.max(
                state.extremes[world, SELF_DEPTH], wp.float64(wp.cast(T[wp.static(touch.deepest)], wp.float32))
            )
            state.extremes[world, fixed_depth] = K[BOARD_NOTES, NOTE_FIXED_DEPTH]
            state.watch[world, LAST_FLOOR_IMPULSE] = K[BOARD_NOTES, NOTE_LAST_IMPULSE]
            if wp.static(has_flight):
                state.is_rigid[world] = is_rigid
                state.closing_time[world] = K[BOARD_NOTES, NOTE_CLOSING_TIME]
                state.other_step[world] = K[BOARD_NOTES, NOTE_OTHER_STEP]
            state.is_fresh[world] = 0
            state.has_first_stage[world] = 1
            state.reach[world] = wp.float64(reach)
            if wp.static(has_flight):
                state.slack[world] = wp.float64(slack)
            state.time[world] = time
            state.step[world] = step
            state.last_error[world] = wp.float64(last_error)
            state.status[world] = status

    return advance_block
