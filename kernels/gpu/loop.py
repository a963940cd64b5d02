"""The GPU loop over steps: one block of threads carries one chain, one thread per link.

It makes the same run as :mod:`cpu.loop`, in the parts of :mod:`hooks` and with the same functions of physics. Stages
lie in registers, the state on a board in the shared memory of the block. All threads know the values that decide
(error, gap, status …), and take the same branches. The results depend neither on how a run is cut into launches nor on
other chains.

An attempt costs one barrier a stage and one for the error. While nothing is near the floor or sprocket and no pair is
listed, attempts follow one another in an inner loop.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import NOT_FINITE, RUNNING, STEP_LIMIT, STEP_TOO_SMALL
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.events.record import record_is_full
from warpchain.kernels.events.tallies import attempts_made
from warpchain.kernels.features import COMPILER_FLAGS, Features
from warpchain.kernels.gpu import increments
from warpchain.kernels.gpu.block_memory import STARTS, available_registers, board_size, shares_board, starts_offset
from warpchain.kernels.gpu.board import find_link, raise_value
from warpchain.kernels.gpu.contacts.contact_pass import block_contact_pass
from warpchain.kernels.gpu.contacts.proximity import block_proximity
from warpchain.kernels.gpu.contacts.self_contacts import touch_layout
from warpchain.kernels.gpu.increments import EXCHANGED, block_steps, real_of, vec3d
from warpchain.kernels.gpu.run import block_run, block_sample
from warpchain.kernels.gpu.stage import Run, constants
from warpchain.kernels.gpu.threads import address_at, barrier, block_maxima, tile_address, vec4i
from warpchain.kernels.gpu.tilting import tilting_plane
from warpchain.kernels.gpu.upright import upright_plane
from warpchain.kernels.methods.controller import LEAST_SHRINKAGE, next_step, step_controller
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.physics.elementary import TWO
from warpchain.kernels.types import Integers, Worlds, read_ground


@wp.func
def driven_world(world: int):
    """The number by which a world is launched whose chain hangs on a driven sprocket; of that number, the world."""
    return -1 - world


@functools.cache
def make_advance_block(features: Features, block_dim: int, registers: int | None = None):
    """Kernel with the arguments of :func:`cpu.loop.make_advance`, launched with ``wp.launch_tiled``, one block a world.

    If ``features.has_drive``, worlds whose chains hang on a driven sprocket are launched as :func:`driven_world`.
    ``block_dim`` is at least the number of links of every chain: a multiple of 4, on a GPU of 32. ``registers``: most
    of a thread on a GPU; None: as many as a block of this size can have. A world's scratch has at least
    :func:`gpu.block_memory.board_rows` rows; lists are as on a CPU.
    """
    available = available_registers(block_dim)
    if available < 255:
        registers = min(registers or available, available)
    tableau = find_method(features.method).tableau
    columns = features.columns
    tilts = features.tilts
    lists_size = list_layout(columns).size
    has_contacts = features.fixed_body != "none" or features.self_contact
    is_shared = shares_board(block_dim)
    width = block_dim + 1
    kept_width = columns if is_shared else width
    board_doubles = board_size(block_dim) + layout.PLANE_ROWS * tilts if is_shared else 1
    touch = touch_layout(columns, block_dim, in_lists=not is_shared)
    touch_size = touch.size if is_shared else 1
    board_address = tile_address(wp.float64, board_doubles)
    touch_address = tile_address(wp.int32, touch_size)
    real, starts_size = real_of(features), STARTS * block_dim if is_shared else 1
    exchange_address = tile_address(real, EXCHANGED * block_dim)
    starts_address = tile_address(real, starts_size)
    greatest, _write, _read = block_maxima(block_dim)
    maxima_address = tile_address(vec4i, block_dim)
    write_proximity, read_proximity, _ = block_proximity(features, block_dim)
    steps = block_steps(features, block_dim)
    common_of, begin, attempt, accept = steps.common_of, steps.begin, steps.attempt, steps.accept
    renew_direction, start_is_finite, opening_of = steps.renew_direction, steps.start_is_finite, steps.opening
    renewed = increments.RENEWED
    plane = tilting_plane(block_dim, touch.votes) if tilts else upright_plane(features)
    growth, shrinkage = step_controller(tableau.order, tableau.error_order, wp.float32)
    begin_contacts, look, meet = block_contact_pass(features, block_dim, touch, plane)
    load_run, store_run = block_run(features, touch, plane, steps)
    take_sample = block_sample(features, touch, plane, steps)

    @wp.func
    def measure_proximity(run: Run):
        """Proximity of the whole chain in the state on the board, whose start is known, and this link's gap."""
        K = run.K
        lane = run.lane
        turning = constants(K).half_length * K[layout.OMEGA, lane]
        speed = TWO * (
            K[layout.U, lane] * K[layout.U, lane] + K[layout.V, lane] * K[layout.V, lane] + turning * turning
        )
        place = vec3d(K[layout.X, lane], K[layout.Y, lane], K[layout.THETA, lane])
        cosine = K[layout.COSINE, lane]
        write_proximity(run, place, cosine, K[layout.SINE, lane], opening_of(run), wp.float32(speed))
        barrier()
        return read_proximity(run)

    @wp.kernel(
        name="advance",
        module="unique",
        enable_backward=False,
        grid_stride=False,
        cuda_max_registers=registers,
        module_options={"cpu_compiler_flags": COMPILER_FLAGS},
    )
    def advance_block(launched: Integers, worlds: Worlds):
        block, lane = wp.tid()
        world = launched[block]
        is_driven = bool(wp.static(features.is_driven))
        if wp.static(features.has_drive):
            is_driven = world < 0
            if is_driven:
                world = driven_world(world)
        exchange = wp.tile_empty(shape=(wp.static(EXCHANGED * block_dim),), dtype=real, storage="shared")
        starts = wp.tile_empty(shape=(wp.static(starts_size),), dtype=real, storage="shared")
        errors = wp.tile_empty(shape=(wp.static(block_dim),), dtype=wp.int32, storage="shared")
        maxima = wp.tile_empty(shape=(wp.static(block_dim),), dtype=vec4i, storage="shared")
        board = wp.tile_empty(shape=(wp.static(board_doubles),), dtype=wp.float64, storage="shared")
        touches = wp.tile_empty(shape=(wp.static(touch_size),), dtype=wp.int32, storage="shared")
        if worlds.status[world] != RUNNING:
            return
        memory = worlds.scratch[world]
        list_row = worlds.lists[world]
        board_start = board_address(board)
        touch_start = touch_address(touches)
        if wp.static(not is_shared):
            board_start = memory.ptr
            touch_start = list_row.ptr
        K = wp.array(ptr=board_start, shape=(wp.static(layout.BOARD_ROWS), wp.static(width)), dtype=wp.float64)
        stored_plane = worlds.plane[world]
        P = stored_plane
        if wp.static(tilts):
            P = wp.array(
                ptr=address_at(board_start, wp.static(8 * board_size(block_dim))),
                shape=(layout.PLANE_ROWS,),
                dtype=wp.float64,
            )
        run = Run()
        run.ground = read_ground(worlds.model, world)
        run.world = world
        run.is_driven = is_driven
        run.K = K
        run.kept = wp.array(ptr=memory.ptr, shape=(layout.BOARD_VALUES, wp.static(kept_width)), dtype=wp.float64)
        run.L = wp.array(ptr=list_row.ptr, shape=(wp.static(lists_size),), dtype=wp.int32)
        run.T = wp.array(ptr=touch_start, shape=(wp.static(touch.size),), dtype=wp.int32)
        run.P = P
        run.stored_plane = stored_plane
        run.S = starts_address(starts)
        if wp.static(not is_shared):
            run.S = memory.ptr + wp.static(wp.uint64(8 * starts_offset(block_dim)))
        run.exchange = exchange_address(exchange)
        behind = address_at(run.exchange, wp.static(40 * block_dim))
        run.E = wp.array(ptr=run.exchange, shape=(5, wp.static(block_dim)), dtype=wp.float64)
        run.F = wp.array(ptr=behind, shape=(3, wp.static(block_dim)), dtype=wp.float64)
        run.M = wp.array(ptr=run.exchange, shape=(wp.static(5 * block_dim),), dtype=wp.float64)
        run.skin = wp.float32(worlds.control.skin)
        run.maxima = maxima_address(maxima)
        run = find_link(run, worlds.model.chains[world], lane)

        # load
        load_run(run, worlds)
        common = common_of(run)
        if worlds.is_fresh[world] != 0 or worlds.has_first_stage[world] == 0:
            begin(run, common, False)
        proximity = measure_proximity(run)
        pairs, reach, status, spare = begin_contacts(run, worlds, proximity)
        time = worlds.time[world]
        step = wp.float32(worlds.step[world])  # and its length is exact in single precision
        last_error = wp.float32(worlds.last_error[world])
        attempts_before = attempts_made(worlds, world)
        attempts_left = int(wp.min(wp.int64(worlds.control.attempts), worlds.control.step_limit - attempts_before))
        if record_is_full(worlds, world):
            attempts_left = 0
        attempts = int(0)
        accepted = int(0)
        since = int(worlds.counts[world, layout.ACCEPTED] % wp.int64(wp.static(renewed)))
        opening = wp.float32(0.0)
        smallest_step = wp.float32(worlds.control.smallest_step)
        barrier()
        while status == RUNNING and attempts < attempts_left:
            # sample
            if time >= K[wp.static(layout.BOARD_VALUES), layout.VALUE_NEXT_SAMPLE]:
                changed, pauses, status = take_sample(run, worlds, time)
                if changed:
                    barrier()  # drag has changed velocities
                    common = common_of(run)
                    begin(run, common, False)
                if pauses or status != RUNNING:
                    break
            stop_time = K[wp.static(layout.BOARD_VALUES), layout.VALUE_STOP_TIME]
            if time >= stop_time:
                status = worlds.stop_status[world]
                break
            # steps until there is something else to do
            mark = wp.min(stop_time, K[wp.static(layout.BOARD_VALUES), layout.VALUE_NEXT_SAMPLE])
            contact_step = wp.float32(K[wp.static(layout.BOARD_VALUES), layout.VALUE_CONTACT_STEP])
            inverse_tolerance = real(K[wp.static(layout.BOARD_VALUES), layout.VALUE_INVERSE_TOLERANCE])
            error = wp.float32(0.0)
            own_gap = wp.float32(0.0)
            is_near = bool(False)
            goes_on = bool(True)
            while goes_on:
                # length
                length = step
                if wp.static(has_contacts):
                    length = wp.min(length, wp.max(contact_step, reach))
                h = wp.float64(length)
                later = time + h
                if later >= stop_time:
                    h = stop_time - time
                    later = stop_time
                # attempt
                plane.begin_step(run, h)
                result = attempt(run, common, h, inverse_tolerance)
                own_gap = write_proximity(run, result.place, result.cosine, result.sine, result.opening, result.speed)
                error = wp.cast(greatest(errors, lane, wp.where(lane < run.links, result.error, 0)), wp.float32)
                attempts += 1
                # accept or reject
                if error <= wp.float32(1.0):
                    accepted += 1
                    accept(run, result)
                    time = later
                    step = next_step(step, length, growth(error, last_error, worlds.control.proportional))
                    last_error = wp.max(error, wp.float32(1e-4))
                    proximity = read_proximity(run)
                    opening = wp.max(opening, proximity.opening)
                    plane.end_step(run, h)
                    is_near, reach = look(run, proximity, pairs, spare)
                    since += 1
                    goes_on = not (is_near or time >= mark or since == wp.static(renewed))
                elif wp.isfinite(error):
                    step = length * shrinkage(error)
                    goes_on = step >= smallest_step
                else:
                    goes_on = bool(False)
                goes_on = goes_on and attempts < attempts_left
            # contacts, or a run that ends with a rejected attempt
            if error <= wp.float32(1.0):
                renews = since == wp.static(renewed)
                is_hit = bool(False)
                if renews:
                    since = int(0)
                    renew_direction(run)
                if is_near:
                    is_hit, pairs, reach, status, spare = meet(run, worlds, time, proximity, own_gap, pairs, spare)
                if is_hit or renews:
                    if not is_hit:
                        barrier()
                    begin(run, common, not is_hit)
            else:
                if not wp.isfinite(error):
                    broken = wp.where(lane >= run.links or start_is_finite(run), 0, 1)
                    barrier()  # all have read the errors
                    step = step * wp.static(wp.float32(float(LEAST_SHRINKAGE)))
                    if greatest(errors, lane, broken) > 0:
                        status = int(NOT_FINITE)
                if status == RUNNING and step < smallest_step:
                    status = int(STEP_TOO_SMALL)
        if status == RUNNING and attempts_made(worlds, world) + wp.int64(attempts) >= worlds.control.step_limit:
            status = int(STEP_LIMIT)
        # store
        if lane == 0:
            raise_value(K, layout.VALUE_OPENING, opening)
        store_run(run, worlds, time, status, accepted, attempts)
        if lane == 0:
            worlds.time_to_contact[world] = wp.float64(reach)
            worlds.time[world] = time
            worlds.step[world] = wp.float64(step)
            worlds.last_error[world] = wp.float64(last_error)
            worlds.status[world] = status

    return advance_block
