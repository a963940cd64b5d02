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
from warpchain.kernels.gpu.board import find_link, raise_value, write_attempt
from warpchain.kernels.gpu.contacts.contact_pass import block_contact_pass
from warpchain.kernels.gpu.contacts.proximity import block_proximity
from warpchain.kernels.gpu.contacts.self_contacts import touch_layout
from warpchain.kernels.gpu.explicit import explicit_attempt
from warpchain.kernels.gpu.functions import board_size, shares_board
from warpchain.kernels.gpu.run import block_run, block_sample
from warpchain.kernels.gpu.stage import Attempt, Run, block_stage, error_of, read_link, vec3d, vec5d
from warpchain.kernels.gpu.threads import barrier, block_maxima, tile_address, vec4i
from warpchain.kernels.gpu.tilting import block_tilting
from warpchain.kernels.gpu.upright import block_upright
from warpchain.kernels.methods.controller import LEAST_SHRINKAGE, next_step, step_controller
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.physics.geometry import link_is_finite, put
from warpchain.kernels.types import Control, Drive, Integers, Model, Record, State, read_ground

REGISTERS_OF_MULTIPROCESSOR = 65536


@functools.cache
def make_advance_block(features: Features, block_dim: int, registers: int | None = None):
    """Kernel with the arguments of :func:`cpu.loop.make_advance`, launched with ``wp.launch_tiled``, one block a world.

    ``block_dim`` is at least the number of links of every chain: a multiple of 4, on a GPU of 32. ``registers``: most
    of a thread on a GPU; None: as many as a block of this size can have. A world's scratch has at least
    :func:`gpu.functions.board_rows` rows; lists are as on a CPU.
    """
    available = REGISTERS_OF_MULTIPROCESSOR // block_dim // 8 * 8
    if available < 255:
        registers = min(registers or available, available)
    tableau = find_method(features.method).tableau
    columns = features.columns
    tilts = features.tilts
    lists_size = list_layout(columns).size
    has_contacts = features.fixed_body != "none" or features.self_contact
    reuses_last = tableau.first_same_as_last
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
    exchange_ends, stage = block_stage(features, block_dim)
    greatest, _write, _read = block_maxima(block_dim)
    maxima_address = tile_address(vec4i, block_dim)
    write_proximity, read_proximity, _ = block_proximity(features, block_dim)
    attempt = explicit_attempt(features, block_dim, write_proximity, read_proximity)
    plane = block_tilting(block_dim, touch.votes) if tilts else block_upright(features.fixed_body)
    growth, shrinkage = step_controller(tableau.order, tableau.error_order, wp.float32)
    begin_contacts, meet = block_contact_pass(features, block_dim, touch, plane)
    load_run, store_run = block_run(features, touch, plane)
    take_sample = block_sample(features, touch, plane)

    @wp.func
    def evaluate_first_stage(forces: wp.tile[vec3d, block_dim], run: Run, next_end: vec5d):
        """Evaluates the first stage of the next step; ``next_end``: left end of the next link."""
        inverse_mass = run.K[layout.INVERSE_MASS, run.column]
        inverse_inertia = run.K[layout.INVERSE_INERTIA, run.column]
        first = stage(forces, run, next_end, read_link(run.K, run.lane), inverse_mass, inverse_inertia)
        put(run.K, layout.BOARD_FIRST, run.lane, first)
        plane.after_first_stage(run)

    @wp.func
    def measure_proximity(ends: wp.tile[vec5d, block_dim], run: Run):
        """Left end of the next link, and the proximity of the whole chain, in the state on the board."""
        link = read_link(run.K, run.lane)
        next_end = exchange_ends(ends, run, link)
        write_proximity(run, link, next_end)
        barrier()
        return next_end, read_proximity(run)

    @wp.func
    def greatest_error(errors: wp.tile[wp.int32, block_dim], run: Run, result: Attempt):
        """Greatest error ratio of all links."""
        own = int(0)
        if run.lane < run.links:
            own = error_of(result, run.K[wp.static(layout.BOARD_VALUES), layout.VALUE_TOLERANCE])
        return wp.cast(greatest(errors, run.lane, own), wp.float32)

    @wp.func
    def reject(errors: wp.tile[wp.int32, block_dim], run: Run, control: Control, h: wp.float64, error: wp.float32):
        """A shorter step [s] after a rejection, and the status."""
        status = int(RUNNING)
        step = h * LEAST_SHRINKAGE
        if wp.isfinite(error):
            step = h * wp.float64(shrinkage(error))
        else:
            broken = wp.where(run.lane >= run.links or link_is_finite(run.K, run.lane, layout.BOARD_FIRST), 0, 1)
            barrier()  # all have read the errors
            if greatest(errors, run.lane, broken) > 0:
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
        memory = scratch[world]
        list_row = lists_of_worlds[world]
        board_start = board_address(board)
        touch_start = touch_address(touches)
        if wp.static(not is_shared):
            board_start = memory.ptr
            touch_start = list_row.ptr
        K = wp.array(ptr=board_start, shape=(wp.static(layout.BOARD_ROWS), wp.static(width)), dtype=wp.float64)
        stored_plane = state.plane[world]
        P = stored_plane
        if wp.static(tilts):
            P = wp.array(ptr=board_start + wp.static(plane_offset), shape=(layout.PLANE_ROWS,), dtype=wp.float64)
        run = Run()
        run.ground = read_ground(model, world)
        run.world = world
        run.K = K
        run.kept = wp.array(ptr=memory.ptr, shape=(layout.BOARD_VALUES, wp.static(kept_width)), dtype=wp.float64)
        run.L = wp.array(ptr=list_row.ptr, shape=(wp.static(lists_size),), dtype=wp.int32)
        run.T = wp.array(ptr=touch_start, shape=(wp.static(touch.size),), dtype=wp.int32)
        run.P = P
        run.stored_plane = stored_plane
        run.E = wp.array(ptr=ends_address(ends), shape=(5, wp.static(block_dim)), dtype=wp.float64)
        run.F = wp.array(ptr=forces_address(forces), shape=(3, wp.static(block_dim)), dtype=wp.float64)
        run.M = wp.array(ptr=ends_address(ends), shape=(wp.static(5 * block_dim),), dtype=wp.float64)
        run.maxima = maxima_address(maxima)
        run = find_link(run, model.chains[world], lane)

        load_run(run, model, drive, state, control)
        next_end, proximity = measure_proximity(ends, run)
        pairs, reach, status = begin_contacts(run, state, control, proximity)
        if state.is_fresh[world] != 0 or state.has_first_stage[world] == 0:
            evaluate_first_stage(forces, run, next_end)
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
                changed, pauses, status = take_sample(run, model, drive, state, record, control, time)
                if changed:
                    next_end = exchange_ends(ends, run, read_link(K, lane))
                    evaluate_first_stage(forces, run, next_end)
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
            plane.begin_step(run, h)
            result = attempt(ends, forces, run, h)
            error = greatest_error(errors, run, result)
            attempts += 1
            if error <= wp.float32(1.0):
                accepted += 1
                write_attempt(run, result, h)
                if wp.static(reuses_last):
                    if lane < run.links:
                        put(K, layout.BOARD_FIRST, lane, result.last)
                time = wp.where(reaches_stop, stop_time, time + h)
                step = next_step(step, h, wp.float64(growth(error, last_error, control.proportional)))
                last_error = wp.max(error, wp.float32(1e-4))
                proximity = result.proximity
                if wp.static(not reuses_last):
                    next_end, proximity = measure_proximity(ends, run)
                if lane == 0:
                    raise_value(K, layout.VALUE_OPENING, proximity.opening)
                plane.end_step(run, h)
                is_hit, pairs, reach, status = meet(run, drive, state, control, time, proximity, pairs)
                if is_hit or wp.static(not reuses_last):
                    if is_hit:
                        next_end = exchange_ends(ends, run, read_link(K, lane))
                    evaluate_first_stage(forces, run, next_end)
            else:
                step, status = reject(errors, run, control, h, error)
        if status == RUNNING and attempts_made(state, world) + wp.int64(attempts) >= control.step_limit:
            status = int(STEP_LIMIT)
        store_run(run, state, record, time, status, accepted, attempts)
        if lane == 0:
            state.time_to_contact[world] = wp.float64(reach)
            state.time[world] = time
            state.step[world] = step
            state.last_error[world] = wp.float64(last_error)
            state.status[world] = status

    return advance_block
