"""The GPU loop over steps: one block of threads carries one chain, one thread per link.

It makes the same run as :mod:`cpu.loop`, on the same structs and with the same functions of physics. Stages lie in
registers, the state on a board in the shared memory of the block. All threads know the values that decide (error, gap,
status …), and take the same branches. The results depend neither on how a run is cut into launches nor on other chains.

An attempt costs two barriers a stage and one for the error; an accepted one costs three more, except with methods that
reuse the last stage. Contacts cost none while nothing is near the floor or sprocket and no pair is listed.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import LIST_OVERFLOW, NOT_FINITE, RUNNING, STEP_LIMIT, STEP_TOO_SMALL
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.events.present_chain import has_changed, present_chain
from warpchain.kernels.events.record import lacks_last_sample, record_is_full, write_sample
from warpchain.kernels.events.summary import summarise
from warpchain.kernels.events.tallies import add_count, attempts_made, count_bounce, of_fixed_body, raise_extreme
from warpchain.kernels.events.tilting import in_room, write_tilting_sample
from warpchain.kernels.features import COMPILER_FLAGS, Features
from warpchain.kernels.gpu.board import (
    link_is_finite,
    load_extremes,
    load_link,
    place_of,
    publish,
    raise_value,
    store_extremes,
    store_link,
    store_losses,
)
from warpchain.kernels.gpu.contacts.neighbour_list import block_list
from warpchain.kernels.gpu.contacts.proximity import block_proximity, moving_sprocket_contact, upper_bound
from warpchain.kernels.gpu.contacts.self_contacts import block_self_contacts, touch_layout
from warpchain.kernels.gpu.explicit import explicit_attempt
from warpchain.kernels.gpu.functions import board_size, shares_board
from warpchain.kernels.gpu.sample import block_sample, write_marks, write_step_bounds
from warpchain.kernels.gpu.stage import (
    Place,
    block_stage,
    constants,
    error_of,
    read_link,
    vec3d,
    vec5d,
    write_constants,
    write_first_stage,
)
from warpchain.kernels.gpu.threads import barrier, barrier_if_any, block_maxima, clock, tile_address, vec4i
from warpchain.kernels.gpu.tilting import block_tilting, copy_plane, write_felt_plane
from warpchain.kernels.methods.controller import LEAST_SHRINKAGE, next_step, step_controller
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.physics.plane import end_plane_step
from warpchain.kernels.physics.scaled_loads import write_link
from warpchain.kernels.types import Control, Drive, Ground, Model, Record, State, read_ground

wp.set_module_options({"enable_backward": False})

REGISTERS_OF_MULTIPROCESSOR = 65536


@functools.cache
def make_advance_block(features: Features, block_dim: int, registers: int | None = None):
    """Kernel with the arguments of :func:`cpu.loop.make_advance`, launched with ``wp.launch_tiled``, one block a world.

    Args:
        features: What the kernel is compiled for.
        block_dim: Threads in a block, at least the number of links of every chain; on a GPU a multiple of 32.
        registers: Most registers of a thread on a GPU; None: as many as a block of this size can have.

    Arrays of the kernel:
        scratch: (W, ≥ :func:`gpu.functions.board_rows`, columns) float64; lists are as on a CPU.
    """
    available = REGISTERS_OF_MULTIPROCESSOR // block_dim // 8 * 8
    if available < 255:
        registers = min(registers or available, available)
    method = find_method(features.method)
    columns = features.columns
    lists = list_layout(columns)
    has_floor = features.has_floor
    has_fixed = features.fixed_body != "none"
    has_self = features.self_contact
    tilts = features.tilts
    has_contacts = has_fixed or has_self
    meet_sprocket = moving_sprocket_contact()
    fixed_loss, fixed_depth, fixed_count = of_fixed_body(features.fixed_body)
    reuses_last = method.reuses_last
    needs_first_power = TABLEAUS[method.tableau].velocity_weights[0] != 0.0
    is_shared = shares_board(block_dim)
    width = block_dim + 1
    kept_width = columns if is_shared else width
    plane_offset = wp.uint64(8 * board_size(block_dim))
    board_doubles = board_size(block_dim) + layout.PLANE_ROWS * tilts if is_shared else 1
    touch = touch_layout(columns, block_dim, in_lists=not is_shared)
    touch_size = touch.size if is_shared else 1
    board_address = tile_address(wp.float64, board_doubles)
    touch_address = tile_address(wp.int32, touch_size)
    ends_address = tile_address(vec5d, block_dim)
    forces_address = tile_address(vec3d, block_dim)
    exchange_ends, stage = block_stage(block_dim, tilts)
    greatest, _write, _read = block_maxima(block_dim)
    maxima_address = tile_address(vec4i, block_dim)
    write_proximity, read_proximity, time_to_contact, meet_fixed_body = block_proximity(features, block_dim)
    attempt = explicit_attempt(method.tableau, block_dim, write_proximity, read_proximity, tilts)
    begin_step, sum_up, meet_tilting_floor = block_tilting(block_dim)
    growth, shrinkage = step_controller(method.order, method.error_order, wp.float32)
    build_list = block_list(columns, block_dim)
    clear_contacts, find_contacts, resolve_contacts = block_self_contacts(columns, block_dim, touch)
    chain_values = layout.BOARD_VALUES
    is_driven = features.is_driven
    present = present_chain(is_driven)
    take_sample = block_sample(features, touch)

    @wp.func
    def evaluate_first_stage(
        forces: wp.tile[vec3d, block_dim], K: wp.array2d(dtype=wp.float64), place: Place, next_end: vec5d
    ):
        """Evaluates the first stage of the next step; ``next_end``: left end of the next link."""
        column = place.column
        first = stage(
            forces,
            K,
            place,
            next_end,
            read_link(K, place.lane),
            K[layout.INVERSE_MASS, column],
            K[layout.INVERSE_INERTIA, column],
        )
        write_first_stage(K, place.lane, first, wp.static(needs_first_power))

    @wp.func
    def measure_proximity(
        ends: wp.tile[vec5d, block_dim],
        K: wp.array2d(dtype=wp.float64),
        maxima: wp.uint64,
        place: Place,
        ground: Ground,
    ):
        """Left end of the next link, and the proximity of the whole chain, in the state on the board."""
        link = read_link(K, place.lane)
        next_end = exchange_ends(ends, place, link)
        write_proximity(K, maxima, place, ground, link, next_end)
        barrier()
        return next_end, read_proximity(maxima)

    @wp.kernel(
        name="advance",
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
        board = wp.tile_empty(shape=(wp.static(board_doubles),), dtype=wp.float64, storage="shared")
        touches = wp.tile_empty(shape=(wp.static(touch_size),), dtype=wp.int32, storage="shared")
        if state.status[world] != RUNNING:
            return
        kept = wp.array(
            ptr=scratch[world].ptr, shape=(wp.static(layout.BOARD_VALUES), wp.static(kept_width)), dtype=wp.float64
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
        # contacts use the memory in which stages exchange ends and forces
        ends_start = ends_address(ends)
        forces_start = forces_address(forces)
        E = wp.array(ptr=ends_start, shape=(5, wp.static(block_dim)), dtype=wp.float64)
        F = wp.array(ptr=forces_start, shape=(3, wp.static(block_dim)), dtype=wp.float64)
        maxima_start = maxima_address(maxima)
        # so do the sums for a plane that tilts
        M = wp.array(ptr=ends_start, shape=(wp.static(5 * block_dim),), dtype=wp.float64)
        P = state.plane[world]
        if wp.static(tilts and is_shared):
            P = wp.array(ptr=board_start + wp.static(plane_offset), shape=(layout.PLANE_ROWS,), dtype=wp.float64)

        chain = model.chains[world]
        n = chain.link_count
        place = place_of(chain, lane)
        ground = read_ground(model, world)
        load_link(K, state, world, lane, n)
        is_fresh = state.is_fresh[world] != 0
        if lane < n:
            write_link(K, model, world, lane, state.load_factor[world])
            row = int(layout.BOARD_LOST_SELF)
            while row < wp.static(layout.BOARD_VALUES):
                K[row, lane] = wp.where(is_fresh, ZERO, kept[row, lane])
                row += 1
        if lane == 0:
            write_constants(K, present(model, state, control, world))
            if wp.static(tilts):
                copy_plane(P, state.plane[world])
                write_felt_plane(K, P)
            write_step_bounds(K, drive, state, control, world, wp.static(is_driven))
            load_extremes(K, state, world, fixed_depth)
            write_marks(K, state, control, world)
            T[wp.static(touch.fixed_hits)] = 0
            T[wp.static(touch.self_hits)] = 0
            T[wp.static(touch.strand_hits)] = 0
            T[wp.static(touch.deepest)] = 0
            T[wp.static(touch.is_late)] = 0
            T[wp.static(touch.votes)] = 0
            K[chain_values, layout.VALUE_DEADLINE] = clock() + control.launch_time
        barrier()  # the chain's constants are on the board
        publish(K, place)
        barrier()
        next_end, proximity = measure_proximity(ends, K, maxima_start, place, ground)
        opening = proximity.opening
        status = int(RUNNING)
        pairs = int(0)
        slack = wp.float32(0.5) * wp.float32(control.skin) - opening
        if is_fresh:
            if wp.static(has_self):
                pairs = build_list(K, L, chain, lane, control.skin, upper_bound(opening))
                if pairs > wp.static(lists.capacity):
                    status = int(LIST_OVERFLOW)
            if wp.static(tilts):
                if lane == 0:
                    P[layout.SUM_MASS] = chain.mass
                barrier()  # all have read the ends
                sum_up(K, P, M, place)
        reach = time_to_contact(control, pairs, proximity.gap, slack, proximity.speed)
        if not is_fresh:
            # Kept from the last launch, since recomputing could round differently.
            reach = wp.float32(state.time_to_contact[world])
            if wp.static(has_self):
                pairs = L[wp.static(lists.count)]
        if is_fresh or state.has_first_stage[world] == 0:
            evaluate_first_stage(forces, K, place, next_end)
        time = state.time[world]
        step = state.step[world]
        last_error = wp.float32(state.last_error[world])
        attempts_before = attempts_made(state, world)
        attempts_left = int(wp.min(wp.int64(control.attempts), control.step_limit - attempts_before))
        if record_is_full(record, world):
            attempts_left = 0
        attempts = int(0)
        accepted = int(0)
        barrier()
        while status == RUNNING and attempts < attempts_left:
            if time >= K[chain_values, layout.VALUE_NEXT_SAMPLE]:
                softness = state.softness[world]
                load_factor = state.load_factor[world]
                publish(K, place)
                barrier()
                if lane == 0:
                    if wp.static(tilts):
                        copy_plane(state.plane[world], P)
                    take_sample(K, T, model, drive, state, record, control, world, time)
                barrier()
                status = T[wp.static(touch.mailbox)]
                pauses = record_is_full(record, world) or T[wp.static(touch.is_late)] != 0
                barrier()
                if has_changed(state, world, softness, load_factor):
                    if wp.static(is_driven) and lane < n:
                        write_link(K, model, world, lane, state.load_factor[world])
                    next_end = exchange_ends(ends, place, read_link(K, lane))
                    evaluate_first_stage(forces, K, place, next_end)
                if pauses or status != RUNNING:
                    break
            stop_time = K[chain_values, layout.VALUE_STOP_TIME]
            if time >= stop_time:
                status = state.stop_status[world]
                break

            h = step
            if wp.static(has_contacts):
                h = wp.min(h, wp.max(K[chain_values, layout.VALUE_CONTACT_STEP], wp.float64(reach)))
            reaches_stop = time + h >= stop_time
            if reaches_stop:
                h = stop_time - time

            if wp.static(tilts):
                begin_step(K, P, place, h)
            tolerance = K[chain_values, layout.VALUE_TOLERANCE]
            result = attempt(ends, forces, maxima_start, K, place, ground, h)
            own_error = int(0)
            if lane < n:
                own_error = error_of(result, tolerance)
            error = wp.cast(greatest(errors, lane, own_error), wp.float32)
            attempts += 1
            if not (error <= wp.float32(1.0)):
                if wp.isfinite(error):
                    step = h * wp.float64(shrinkage(error))
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
                    K[layout.BOARD_LOST_FRICTION, lane] = K[layout.BOARD_LOST_FRICTION, lane] + h * result.friction
                    dissipation = constants(K).joint_damping * result.damping
                    K[layout.BOARD_LOST_DAMPING, lane] = K[layout.BOARD_LOST_DAMPING, lane] + h * dissipation
                    K[layout.X, lane] = result.x
                    K[layout.Y, lane] = result.y
                    K[layout.THETA, lane] = result.theta
                    K[layout.U, lane] = result.u
                    K[layout.V, lane] = result.v
                    K[layout.OMEGA, lane] = result.omega
                    K[layout.COSINE, lane] = result.cosine
                    K[layout.SINE, lane] = result.sine
                    if wp.static(reuses_last):
                        write_first_stage(K, lane, result.last, wp.static(needs_first_power))
                time = wp.where(reaches_stop, stop_time, time + h)
                step = next_step(step, h, wp.float64(growth(error, last_error, control.proportional)))
                last_error = wp.max(error, wp.float32(1e-4))
                proximity = result.proximity
                if wp.static(not reuses_last):
                    next_end, proximity = measure_proximity(ends, K, maxima_start, place, ground)
                opening = proximity.opening
                gap = proximity.gap
                if lane == 0:
                    raise_value(K, layout.VALUE_OPENING, opening)
                if wp.static(tilts):
                    sum_up(K, P, M, place)
                    if lane == 0:
                        end_plane_step(P, constants(K).gravity, h)
                is_hit = bool(False)
                is_near = bool(False)
                is_stale = bool(False)
                hits = int(0)
                if wp.static(has_fixed):
                    if gap < wp.float32(0.0):
                        is_near = bool(True)
                        if wp.static(tilts):
                            hits = meet_tilting_floor(K, P, M, constants(K), place)
                        elif lane < n:
                            hits = meet_fixed_body(K, place, ground, constants(K), drive, world, time)
                        if hits > 0:
                            wp.atomic_add(T, wp.static(touch.fixed_hits), hits)
                if wp.static(features.moving_sprocket):
                    is_near = bool(True)
                    if lane < n:
                        hits += meet_sprocket(K, place, ground, constants(K), drive, state, world, time)
                if wp.static(has_self):
                    slack = wp.float32(0.5) * wp.float32(control.skin) - opening - proximity.displacement
                    is_stale = not slack > wp.float32(0.0)
                    if is_stale or pairs > 0:
                        is_near = bool(True)
                        publish(K, place)
                        clear_contacts(T, lane, n)
                if is_near:
                    is_hit = barrier_if_any(T, wp.static(touch.votes), hits > 0)
                if wp.static(has_fixed):
                    if gap < wp.float32(0.0) and lane == 0:
                        raise_value(K, layout.VALUE_FIXED_DEPTH, -gap)
                        if wp.static(has_floor):
                            if is_hit:
                                count_bounce(state, world, time, K[chain_values, layout.VALUE_LAST_IMPULSE])
                                K[chain_values, layout.VALUE_LAST_IMPULSE] = time
                if wp.static(has_self):
                    if is_stale:
                        if lane == 0:
                            add_count(state, world, layout.LIST_BUILDS, wp.int64(1))
                        pairs = build_list(K, L, constants(K), lane, control.skin, upper_bound(opening))
                        if pairs > wp.static(lists.capacity):
                            status = int(LIST_OVERFLOW)
                            pairs = int(wp.static(lists.capacity))
                        slack = wp.float32(0.5) * wp.float32(control.skin) - opening
                    if pairs > 0:
                        touched = constants(K)
                        touching = find_contacts(K, L, T, touched, lane, pairs, upper_bound(opening))
                        if touching > 0:
                            hits = resolve_contacts(K, L, T, E, F, touched, lane, touching)
                            if hits > 0:
                                wp.atomic_add(T, wp.static(touch.self_hits), hits)
                            if not is_hit:
                                is_hit = barrier_if_any(T, wp.static(touch.votes), hits > 0)
                reach = time_to_contact(control, pairs, gap, slack, proximity.speed)
                if is_hit or wp.static(not reuses_last):
                    if is_hit:
                        next_end = exchange_ends(ends, place, read_link(K, lane))
                    evaluate_first_stage(forces, K, place, next_end)
                    if wp.static(tilts):
                        barrier()  # all have read the plane that they feel
        if status == RUNNING and attempts_made(state, world) + wp.int64(attempts) >= control.step_limit:
            status = int(STEP_LIMIT)
        is_last = lacks_last_sample(state, world, time, status)
        publish(K, place)
        barrier()
        if lane < n:
            store_link(K, state, world, lane)
            left = wp.array(
                ptr=scratch[world].ptr, shape=(wp.static(layout.BOARD_VALUES), wp.static(kept_width)), dtype=wp.float64
            )
            row = int(layout.BOARD_LOST_SELF)
            while row < wp.static(layout.BOARD_VALUES):
                left[row, lane] = K[row, lane]
                row += 1
        if lane == 0:
            if is_last:
                last = present(model, state, control, world)
                flat = summarise(K, last)
                if wp.static(tilts):
                    write_tilting_sample(P, state, record, world, time, flat, in_room(K, P, last, flat))
                else:
                    write_sample(state, record, world, time, flat)
            if wp.static(tilts):
                copy_plane(state.plane[world], P)
            store_losses(K, state, world, n, wp.static(fixed_loss))
            add_count(state, world, layout.ACCEPTED, wp.int64(accepted))
            add_count(state, world, layout.REJECTED, wp.int64(attempts - accepted))
            add_count(state, world, fixed_count, wp.int64(T[wp.static(touch.fixed_hits)]))
            add_count(state, world, layout.SELF_IMPULSES, wp.int64(T[wp.static(touch.self_hits)]))
            add_count(state, world, layout.STRAND_IMPULSES, wp.int64(T[wp.static(touch.strand_hits)]))
            store_extremes(K, state, world, fixed_depth)
            deepest = wp.cast(T[wp.static(touch.deepest)], wp.float32)
            raise_extreme(state, world, layout.SELF_DEPTH, wp.float64(deepest))
            state.is_fresh[world] = 0
            state.has_first_stage[world] = 1
            state.time_to_contact[world] = wp.float64(reach)
            state.time[world] = time
            state.step[world] = step
            state.last_error[world] = wp.float64(last_error)
            state.status[world] = status

    return advance_block
