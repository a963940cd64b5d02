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
from warpchain.kernels.codes import NOT_FINITE, RUNNING, STEP_LIMIT, STEP_TOO_SMALL
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.events.record import record_is_full
from warpchain.kernels.events.tallies import attempts_made
from warpchain.kernels.features import COMPILER_FLAGS, Features
from warpchain.kernels.gpu.board import link_is_finite, place_of, raise_value, write_attempt
from warpchain.kernels.gpu.contacts.contact_pass import block_contact_pass
from warpchain.kernels.gpu.contacts.proximity import block_proximity
from warpchain.kernels.gpu.contacts.self_contacts import touch_layout
from warpchain.kernels.gpu.explicit import explicit_attempt
from warpchain.kernels.gpu.functions import board_size, shares_board
from warpchain.kernels.gpu.run import block_run, block_sample
from warpchain.kernels.gpu.stage import (
    Attempt,
    Place,
    block_stage,
    error_of,
    read_link,
    vec3d,
    vec5d,
    write_first_stage,
)
from warpchain.kernels.gpu.threads import barrier, block_maxima, tile_address, vec4i
from warpchain.kernels.gpu.tilting import block_tilting
from warpchain.kernels.gpu.upright import block_upright
from warpchain.kernels.methods.controller import LEAST_SHRINKAGE, next_step, step_controller
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.types import Control, Drive, Ground, Integers, Model, Record, Rows, State, read_ground

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
    tilts = features.tilts
    lists_size = list_layout(columns).size
    has_contacts = features.fixed_body != "none" or features.self_contact
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
    write_proximity, read_proximity, _ = block_proximity(features, block_dim)
    attempt = explicit_attempt(method.tableau, block_dim, write_proximity, read_proximity, tilts)
    plane = block_tilting(block_dim) if tilts else block_upright(features.fixed_body)
    begin_step, end_step, after_first_stage = plane.begin_step, plane.end_step, plane.after_first_stage
    growth, shrinkage = step_controller(method.order, method.error_order, wp.float32)
    begin_contacts, meet = block_contact_pass(features, block_dim, touch, plane)
    load_run, store_run = block_run(features, touch, kept_width, plane)
    take_sample = block_sample(features, touch, plane)

    @wp.func
    def evaluate_first_stage(forces: wp.tile[vec3d, block_dim], K: Rows, place: Place, next_end: vec5d):
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
        after_first_stage()

    @wp.func
    def measure_proximity(ends: wp.tile[vec5d, block_dim], K: Rows, maxima: wp.uint64, place: Place, ground: Ground):
        """Left end of the next link, and the proximity of the whole chain, in the state on the board."""
        link = read_link(K, place.lane)
        next_end = exchange_ends(ends, place, link)
        write_proximity(K, maxima, place, ground, link, next_end)
        barrier()
        return next_end, read_proximity(maxima)

    @wp.func
    def greatest_error(errors: wp.tile[wp.int32, block_dim], K: Rows, place: Place, result: Attempt):
        """Greatest error ratio of all links."""
        own = int(0)
        if place.lane < place.links:
            own = error_of(result, K[wp.static(layout.BOARD_VALUES), layout.VALUE_TOLERANCE])
        return wp.cast(greatest(errors, place.lane, own), wp.float32)

    @wp.func
    def reject(
        errors: wp.tile[wp.int32, block_dim], K: Rows, control: Control, place: Place, h: wp.float64, error: wp.float32
    ):
        """A shorter step [s] after a rejection, and the status."""
        status = int(RUNNING)
        step = h * LEAST_SHRINKAGE
        if wp.isfinite(error):
            step = h * wp.float64(shrinkage(error))
        else:
            broken = wp.where(place.lane >= place.links or link_is_finite(K, place.lane), 0, 1)
            barrier()  # all have read the errors
            if greatest(errors, place.lane, broken) > 0:
                status = int(NOT_FINITE)
        if status == RUNNING and step < control.smallest_step:
            status = int(STEP_TOO_SMALL)
        return step, status

    @wp.kernel(
        name="advance",
        module="unique",
        enable_backward=False,
        grid_stride=False,
        cuda_max_registers=registers,
        module_options={"cpu_compiler_flags": COMPILER_FLAGS},
    )
    def advance_block(
        worlds: Integers,
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
        list_row = lists_of_worlds[world]
        L = wp.array(ptr=list_row.ptr, shape=(wp.static(lists_size),), dtype=wp.int32)
        board_start = board_address(board)
        touch_start = touch_address(touches)
        if wp.static(not is_shared):
            board_start = scratch[world].ptr
            touch_start = list_row.ptr
        K = wp.array(ptr=board_start, shape=(wp.static(layout.BOARD_ROWS), wp.static(width)), dtype=wp.float64)
        T = wp.array(ptr=touch_start, shape=(wp.static(touch.size),), dtype=wp.int32)
        # contacts use the memory in which stages exchange ends and forces
        E = wp.array(ptr=ends_address(ends), shape=(5, wp.static(block_dim)), dtype=wp.float64)
        F = wp.array(ptr=forces_address(forces), shape=(3, wp.static(block_dim)), dtype=wp.float64)
        # so do the sums for a plane that tilts
        M = wp.array(ptr=ends_address(ends), shape=(wp.static(5 * block_dim),), dtype=wp.float64)
        P = state.plane[world]
        if wp.static(tilts and is_shared):
            P = wp.array(ptr=board_start + wp.static(plane_offset), shape=(layout.PLANE_ROWS,), dtype=wp.float64)
        maxima_start = maxima_address(maxima)

        place = place_of(model.chains[world], lane)
        ground = read_ground(model, world)
        load_run(K, T, P, model, drive, state, scratch, control, place, world)
        next_end, proximity = measure_proximity(ends, K, maxima_start, place, ground)
        pairs, reach, status = begin_contacts(K, L, P, M, state, control, place, world, proximity)
        if state.is_fresh[world] != 0 or state.has_first_stage[world] == 0:
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
            if time >= K[wp.static(layout.BOARD_VALUES), layout.VALUE_NEXT_SAMPLE]:
                changed, pauses, status = take_sample(K, T, P, model, drive, state, record, control, place, world, time)
                if changed:
                    next_end = exchange_ends(ends, place, read_link(K, lane))
                    evaluate_first_stage(forces, K, place, next_end)
                if pauses or status != RUNNING:
                    break
            stop_time = K[wp.static(layout.BOARD_VALUES), layout.VALUE_STOP_TIME]
            if time >= stop_time:
                status = state.stop_status[world]
                break

            h = step
            if wp.static(has_contacts):
                h = wp.min(h, wp.max(K[wp.static(layout.BOARD_VALUES), layout.VALUE_CONTACT_STEP], wp.float64(reach)))
            reaches_stop = time + h >= stop_time
            if reaches_stop:
                h = stop_time - time
            begin_step(K, P, place, h)
            result = attempt(ends, forces, maxima_start, K, place, ground, h)
            error = greatest_error(errors, K, place, result)
            attempts += 1
            if error <= wp.float32(1.0):
                accepted += 1
                write_attempt(K, place, result, h)
                if wp.static(reuses_last):
                    if lane < place.links:
                        write_first_stage(K, lane, result.last, wp.static(needs_first_power))
                time = wp.where(reaches_stop, stop_time, time + h)
                step = next_step(step, h, wp.float64(growth(error, last_error, control.proportional)))
                last_error = wp.max(error, wp.float32(1e-4))
                proximity = result.proximity
                if wp.static(not reuses_last):
                    next_end, proximity = measure_proximity(ends, K, maxima_start, place, ground)
                if lane == 0:
                    raise_value(K, layout.VALUE_OPENING, proximity.opening)
                end_step(K, P, M, place, h)
                is_hit, pairs, reach, status = meet(
                    K, L, T, E, F, P, M, drive, state, control, place, ground, world, time, proximity, pairs
                )
                if is_hit or wp.static(not reuses_last):
                    if is_hit:
                        next_end = exchange_ends(ends, place, read_link(K, lane))
                    evaluate_first_stage(forces, K, place, next_end)
            else:
                step, status = reject(errors, K, control, place, h, error)
        if status == RUNNING and attempts_made(state, world) + wp.int64(attempts) >= control.step_limit:
            status = int(STEP_LIMIT)
        store_run(K, T, P, model, state, record, scratch, control, place, world, time, status, accepted, attempts)
        if lane == 0:
            state.time_to_contact[world] = wp.float64(reach)
            state.time[world] = time
            state.step[world] = step
            state.last_error[world] = wp.float64(last_error)
            state.status[world] = status

    return advance_block
