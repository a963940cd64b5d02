"""The loop over steps in the block form: one block of threads carries one chain, one thread per link.

The same run as in :mod:`driver`, on the same structs and with the same functions of physics, for devices where a block
of threads is cheap. State and stages live in registers; neighbours and contacts meet on a board in the memory that a
block shares. Everything that decides (error, gap, status …) is known to all threads alike, so that all take the same
branches. What a run gives depends neither on how it is cut into launches nor on the other chains.

A try costs two barriers a stage and one for the error; an accepted one two more. Contacts cost nothing more while the
floor or sprocket is out of reach and the neighbour list is empty.
"""

import functools

import warp as wp

from . import layout
from .block_contact import block_self_contacts, touch_layout
from .block_list import block_list
from .block_memory import barrier, block_maxima, tile_address, vec4l
from .block_step import Link, Place, Rates, block_method, error_of, vec3d, vec5d
from .broadphase import list_layout
from .contact import meet_floor, meet_sprocket
from .controller import LEAST_SHRINKAGE, step_controller
from .driver import (
    BOUNCE_PAUSE,
    COMPILER_FLAGS,
    LIST_OVERFLOW,
    NOT_FINITE,
    RUNNING,
    STEP_LIMIT,
    STEP_TOO_SMALL,
    Features,
    sprocket_turning,
)
from .elementary import HALF, ONE, TWO, ZERO, cos_sin, from_order_key, order_bits, order_key
from .geometry import end_positions
from .layout import (
    ACCEPTED,
    BOARD_LISTED_X,
    BOARD_LISTED_Y,
    BOARD_LOST_DAMPING,
    BOARD_LOST_FIXED,
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
    KEPT_STAGE,
    LAST_FLOOR_IMPULSE,
    LEFT_X,
    LEFT_Y,
    LIST_BUILDS,
    LOSS_DAMPING,
    LOSS_FRICTION,
    LOSS_SELF,
    MASS,
    NOTE_FIXED_DEPTH,
    NOTE_LAST_IMPULSE,
    NOTE_OPENING,
    OMEGA,
    OPENING,
    REJECTED,
    RIGHT_X,
    RIGHT_Y,
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
from .record import record_is_full, sampling, summarise, write_sample
from .tableaus import TABLEAUS
from .types import Chain, Control, Model, Program, Record, State, read_chain

wp.set_module_options({"enable_backward": False})

LARGEST_SHARED_BLOCK = 512
"""Longer chains keep their board in the scratch block: it would not fit into the memory that a block shares."""


@wp.func
def take_place(chain: Chain, lane: int) -> Place:
    """Neighbours and constants of a thread's link."""
    n = chain.link_count
    place = Place()
    place.lane = lane
    place.before = lane
    place.after = lane
    if lane < n:
        place.before = wp.where(lane == 0, n - 1, lane - 1)
        place.after = wp.where(lane == n - 1, 0, lane + 1)
    place.inverse_mass = ONE / wp.where(lane % 2 == 0, chain.inner_mass, chain.outer_mass)
    place.inverse_inertia = ONE / wp.where(lane % 2 == 0, chain.inner_inertia, chain.outer_inertia)
    return place


@wp.func
def load_link(state: State, world: int, lane: int, n: int) -> Link:
    """State of a thread's link; threads beyond the last hold one at the origin."""
    link = Link()
    link.cosine = ONE
    if lane < n:
        link.x = state.links[world, X, lane]
        link.y = state.links[world, Y, lane]
        link.theta = state.links[world, THETA, lane]
        link.u = state.links[world, U, lane]
        link.v = state.links[world, V, lane]
        link.omega = state.links[world, OMEGA, lane]
        cosine, sine = cos_sin(link.theta)
        link.cosine = cosine
        link.sine = sine
    return link


@wp.func
def publish(K: wp.array2d(dtype=wp.float64), chain: Chain, link: Link, lane: int):
    """Fills the board's rows of state, directions and ends, with no barrier."""
    n = chain.link_count
    if lane < n:
        K[X, lane] = link.x
        K[Y, lane] = link.y
        K[U, lane] = link.u
        K[V, lane] = link.v
        K[OMEGA, lane] = link.omega
        K[COSINE, lane] = link.cosine
        K[SINE, lane] = link.sine
        left_x, left_y, right_x, right_y = end_positions(chain, link.x, link.y, link.cosine, link.sine)
        K[LEFT_X, lane] = left_x
        K[LEFT_Y, lane] = left_y
        K[RIGHT_X, lane] = right_x
        K[RIGHT_Y, lane] = right_y
        if lane == 0:
            K[LEFT_X, n] = left_x
            K[LEFT_Y, n] = left_y


@wp.func
def link_is_finite(link: Link, first: Rates):
    """False if the state or its first derivative holds an infinity or a NaN."""
    finite = wp.isfinite(link.x) and wp.isfinite(link.y) and wp.isfinite(link.theta)
    finite = finite and wp.isfinite(link.u) and wp.isfinite(link.v) and wp.isfinite(link.omega)
    return finite and wp.isfinite(first.x) and wp.isfinite(first.y) and wp.isfinite(first.theta)


@functools.cache
def make_advance_block(features: Features, block_dim: int, registers: int | None = None):
    """Kernel with the arguments of :func:`driver.make_advance`, launched with ``wp.launch_tiled``, one block a world.

    Args:
        features: What the kernel is compiled for.
        block_dim: Threads in a block, at least the number of links of every chain; on a GPU a multiple of 32.
        registers: Greatest number of registers a thread may take on a GPU; None: as many as it likes.

    scratch: (W, ≥ layout.BLOCK_ROWS, columns) float64; lists as for the CPU form.
    """
    tableau = TABLEAUS[features.method]
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
    reuses_last = tableau.first_same_as_last
    is_shared = block_dim <= LARGEST_SHARED_BLOCK
    width = block_dim + 1 if is_shared else columns
    board_size = layout.BOARD_ROWS * width if is_shared else 1
    touch = touch_layout(columns, in_lists=not is_shared)
    touch_size = touch.size if is_shared else 1
    board_address = tile_address(wp.float64, board_size)
    touch_address = tile_address(wp.int32, touch_size)
    hand_over, stage, attempt = block_method(features.method, block_dim)
    greatest, greatest_of_four = block_maxima(block_dim)
    growth, shrinkage = step_controller(tableau.order, tableau.error_order, wp.float32)
    build_list = block_list(columns, block_dim, features.broad_phase)
    clear_contacts, find_contacts, resolve_contacts = block_self_contacts(columns, block_dim, touch)
    look = sampling(features.watch)

    @wp.func
    def measure(
        K: wp.array2d(dtype=wp.float64),
        maxima: wp.tile[vec4l, block_dim],
        place: Place,
        chain: Chain,
        link: Link,
        next_end: vec5d,
    ):
        """Greatest opening, least gap, greatest displacement since listing, greatest speed: [m], [m/s]."""
        left_x, left_y, right_x, right_y = end_positions(chain, link.x, link.y, link.cosine, link.sine)
        least = order_key(wp.float64(-wp.inf))
        values = vec4l(wp.int64(0), least, wp.int64(0), wp.int64(0))
        if place.lane < chain.link_count:
            cx = next_end[0] - right_x
            cy = next_end[1] - right_y
            values[0] = order_bits(cx * cx + cy * cy)
            if wp.static(has_floor):
                values[1] = wp.max(order_key(-left_y), order_key(-right_y))
            if wp.static(has_sprocket):
                left = left_x * left_x + left_y * left_y
                right = right_x * right_x + right_y * right_y
                values[1] = wp.max(order_key(-left), order_key(-right))
            if wp.static(has_self):
                dx = right_x - K[BOARD_LISTED_X, place.lane]
                dy = right_y - K[BOARD_LISTED_Y, place.lane]
                values[2] = order_bits(dx * dx + dy * dy)
            if wp.static(has_contacts):
                turn = chain.half_length * link.omega
                values[3] = order_bits(TWO * (link.u * link.u + link.v * link.v + turn * turn))
        values = greatest_of_four(maxima, place.lane, values)
        gap = -from_order_key(values[1])
        if wp.static(has_floor):
            gap = gap - chain.circle_radius
        if wp.static(has_sprocket):
            gap = wp.sqrt(gap) - chain.sprocket_radius - chain.circle_radius
        return (
            wp.sqrt(wp.cast(values[0], wp.float64)),
            gap,
            wp.sqrt(wp.cast(values[2], wp.float64)),
            wp.sqrt(wp.cast(values[3], wp.float64)),
        )

    @wp.func
    def meet_fixed_body(
        K: wp.array2d(dtype=wp.float64),
        place: Place,
        chain: Chain,
        program: Program,
        world: int,
        time: wp.float64,
        link: Link,
    ):
        """This link after floor or sprocket, and the number of impulses."""
        left_x, left_y, right_x, right_y = end_positions(chain, link.x, link.y, link.cosine, link.sine)
        u = link.u
        v = link.v
        omega = link.omega
        lost_left = ZERO
        lost_right = ZERO
        hits = wp.int64(0)
        if wp.static(has_floor):
            u, v, omega, lost_left, lost_right, hits = meet_floor(
                chain,
                left_x,
                left_y,
                right_x,
                right_y,
                link.x,
                link.y,
                place.inverse_mass,
                place.inverse_inertia,
                link.u,
                link.v,
                link.omega,
            )
        if wp.static(has_sprocket):
            u, v, omega, lost_left, lost_right, hits = meet_sprocket(
                chain,
                sprocket_turning(program, world, time),
                left_x,
                left_y,
                right_x,
                right_y,
                link.x,
                link.y,
                place.inverse_mass,
                place.inverse_inertia,
                link.u,
                link.v,
                link.omega,
            )
        after = link
        after.u = u
        after.v = v
        after.omega = omega
        K[BOARD_LOST_FIXED, place.lane] = K[BOARD_LOST_FIXED, place.lane] + lost_left + lost_right
        return after, int(hits)

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
        program: Program,
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
        votes = wp.tile_empty(shape=(wp.static(block_dim),), dtype=wp.int32, storage="shared")
        maxima = wp.tile_empty(shape=(wp.static(block_dim),), dtype=vec4l, storage="shared")
        board = wp.tile_empty(shape=(wp.static(board_size),), dtype=wp.float64, storage="shared")
        touches = wp.tile_empty(shape=(wp.static(touch_size),), dtype=wp.int32, storage="shared")
        if state.status[world] != RUNNING:
            return
        kept_block = scratch[world]
        kept = wp.array(ptr=kept_block.ptr, shape=(wp.static(layout.BLOCK_ROWS), wp.static(columns)), dtype=wp.float64)
        list_row = lists_of_worlds[world]
        L = wp.array(ptr=list_row.ptr, shape=(wp.static(lists.size),), dtype=wp.int32)
        board_start = board_address(board)
        touch_start = touch_address(touches)
        if wp.static(not is_shared):
            board_start = kept_block.ptr
            touch_start = list_row.ptr
        K = wp.array(ptr=board_start, shape=(wp.static(layout.BOARD_ROWS), wp.static(width)), dtype=wp.float64)
        T = wp.array(ptr=touch_start, shape=(wp.static(touch.size),), dtype=wp.int32)

        chain = read_chain(model, world)
        n = chain.link_count
        place = take_place(chain, lane)
        link = load_link(state, world, lane, n)
        first = Rates()
        is_fresh = state.is_fresh[world] != 0
        if lane < n:
            inner = lane % 2 == 0
            K[MASS, lane] = wp.where(inner, chain.inner_mass, chain.outer_mass)
            K[INERTIA, lane] = wp.where(inner, chain.inner_inertia, chain.outer_inertia)
            K[INVERSE_MASS, lane] = place.inverse_mass
            K[INVERSE_INERTIA, lane] = place.inverse_inertia
            row = int(BOARD_LOST_SELF)
            while row < wp.static(layout.BOARD_NOTES):
                K[row, lane] = wp.where(is_fresh, ZERO, kept[row, lane])
                row += 1
        publish(K, chain, link, lane)
        barrier()
        next_end = hand_over(ends, place, chain, link.x, link.y, link.u, link.v, link.omega, link.cosine, link.sine)
        opening, gap, displacement, speed = measure(K, maxima, place, chain, link, next_end)
        status = int(RUNNING)
        pairs = int(0)
        slack = HALF * control.skin - opening - displacement
        if is_fresh:
            slack = HALF * control.skin - opening
            if wp.static(has_self):
                pairs = build_list(K, L, chain, lane, control.skin, opening)
                if pairs > wp.static(lists.capacity):
                    status = int(LIST_OVERFLOW)
        else:
            if wp.static(has_self):
                pairs = L[wp.static(lists.count)]
        if is_fresh or state.has_first_stage[world] == 0:
            first = stage(
                forces, place, chain, next_end, link.x, link.y, link.u, link.v, link.omega, link.cosine, link.sine
            )
        elif lane < n:
            first.x = kept[KEPT_STAGE, lane]
            first.y = kept[KEPT_STAGE + 1, lane]
            first.theta = kept[KEPT_STAGE + 2, lane]
            first.friction = kept[KEPT_STAGE + 3, lane]
            first.damping = kept[KEPT_STAGE + 4, lane]
        time = state.time[world]
        step = state.step[world]
        last_error = wp.float32(state.last_error[world])
        tries_before = state.counts[world, ACCEPTED] + state.counts[world, REJECTED]
        tries_left = int(wp.min(wp.int64(control.tries), control.step_limit - tries_before))
        if lane == 0:
            K[BOARD_NOTES, NOTE_OPENING] = state.extremes[world, OPENING]
            K[BOARD_NOTES, NOTE_FIXED_DEPTH] = state.extremes[world, fixed_depth]
            K[BOARD_NOTES, NOTE_LAST_IMPULSE] = state.watch[world, LAST_FLOOR_IMPULSE]
            T[wp.static(touch.fixed_hits)] = 0
            T[wp.static(touch.self_hits)] = 0
        stop_time = state.stop_time[world]
        next_look = wp.float64(state.next_sample[world]) * control.sample_interval
        is_full = record_is_full(record, world)
        deepest_self = ZERO
        tries = int(0)
        accepted = int(0)
        barrier()
        while status == RUNNING and tries < tries_left and not is_full:
            if time >= next_look:
                publish(K, chain, link, lane)
                barrier()
                if lane == 0:
                    T[wp.static(touch.mailbox)] = look(
                        K, read_chain(model, world), program, state, record, control, world, time
                    )
                barrier()
                status = T[wp.static(touch.mailbox)]
                stop_time = state.stop_time[world]
                next_look = wp.float64(state.next_sample[world]) * control.sample_interval
                is_full = record_is_full(record, world)
                barrier()
                if status != RUNNING:
                    break
            if time >= stop_time:
                status = state.stop_status[world]
                break

            # near contacts the step is bounded; far from them nothing may come through the skin unseen
            h = step
            if wp.static(has_contacts):
                near = pairs > 0
                room = control.skin
                if wp.static(has_fixed):
                    near = near or gap < control.skin
                    room = HALF * gap
                if wp.static(has_self):
                    room = wp.min(room, slack)
                if near:
                    h = wp.min(h, control.contact_step)
                else:
                    h = wp.min(h, wp.max(control.contact_step, room / speed))
            lands = time + h >= stop_time
            if lands:
                h = stop_time - time

            trial = attempt(ends, forces, place, chain, link, first, h)
            own_error = int(0)
            if lane < n:
                own_error = error_of(trial, link, control.tolerance)
            error = wp.cast(greatest(errors, lane, own_error), wp.float32)
            tries += 1
            if not (error <= wp.float32(1.0)):
                if wp.isfinite(error):
                    step = h * wp.float64(shrinkage(error))
                else:
                    step = h * LEAST_SHRINKAGE
                    broken = wp.where(lane >= n or link_is_finite(link, first), 0, 1)
                    if greatest(votes, lane, broken) > 0:
                        status = int(NOT_FINITE)
                if status == RUNNING and step < control.smallest_step:
                    status = int(STEP_TOO_SMALL)
            else:
                accepted += 1
                if lane < n:
                    K[BOARD_LOST_FRICTION, lane] = K[BOARD_LOST_FRICTION, lane] + h * trial.friction
                    K[BOARD_LOST_DAMPING, lane] = K[BOARD_LOST_DAMPING, lane] + h * trial.damping
                    link.x = trial.x
                    link.y = trial.y
                    link.theta = trial.theta
                    link.u = trial.u
                    link.v = trial.v
                    link.omega = trial.omega
                    cosine, sine = cos_sin(link.theta)
                    link.cosine = cosine
                    link.sine = sine
                time = wp.where(lands, stop_time, time + h)
                proposal = h * wp.float64(growth(error, last_error, control.proportional))
                # a step that was cut short says nothing against the proposal that it was cut from
                step = wp.where(h < step, wp.max(step, proposal), proposal)
                last_error = wp.max(error, wp.float32(1e-4))
                next_end = hand_over(
                    ends, place, chain, link.x, link.y, link.u, link.v, link.omega, link.cosine, link.sine
                )
                opening, gap, displacement, speed = measure(K, maxima, place, read_chain(model, world), link, next_end)
                if lane == 0:
                    K[BOARD_NOTES, NOTE_OPENING] = wp.max(K[BOARD_NOTES, NOTE_OPENING], opening)
                is_hit = bool(False)
                if wp.static(has_fixed):
                    if gap < ZERO:
                        hits = int(0)
                        if lane < n:
                            link, hits = meet_fixed_body(K, place, read_chain(model, world), program, world, time, link)
                        if hits > 0:
                            wp.atomic_add(T, wp.static(touch.fixed_hits), hits)
                        if greatest(votes, lane, hits) > 0:
                            is_hit = bool(True)
                        if lane == 0:
                            K[BOARD_NOTES, NOTE_FIXED_DEPTH] = wp.max(K[BOARD_NOTES, NOTE_FIXED_DEPTH], -gap)
                            if wp.static(has_floor):
                                if is_hit:
                                    if time - K[BOARD_NOTES, NOTE_LAST_IMPULSE] > BOUNCE_PAUSE:
                                        state.counts[world, BOUNCES] = state.counts[world, BOUNCES] + wp.int64(1)
                                    K[BOARD_NOTES, NOTE_LAST_IMPULSE] = time
                if wp.static(has_self):
                    slack = HALF * control.skin - opening - displacement
                    is_stale = not slack > ZERO
                    if is_stale or pairs > 0:
                        publish(K, chain, link, lane)
                        clear_contacts(T, lane, n)
                        barrier()
                        if is_stale:
                            if lane == 0:
                                state.counts[world, LIST_BUILDS] = state.counts[world, LIST_BUILDS] + wp.int64(1)
                            pairs = build_list(K, L, read_chain(model, world), lane, control.skin, opening)
                            if pairs > wp.static(lists.capacity):
                                status = int(LIST_OVERFLOW)
                                pairs = int(wp.static(lists.capacity))
                            slack = HALF * control.skin - opening
                        cold = read_chain(model, world)
                        touching = find_contacts(K, L, T, cold, lane, pairs, opening)
                        if touching > 0:
                            hits, depth = resolve_contacts(K, T, cold, lane, touching)
                            if hits > 0:
                                wp.atomic_add(T, wp.static(touch.self_hits), hits)
                            deepest_self = wp.max(deepest_self, depth)
                            if greatest(votes, lane, hits) > 0:
                                is_hit = bool(True)
                                if lane < n:
                                    link.u = K[U, lane]
                                    link.v = K[V, lane]
                                    link.omega = K[OMEGA, lane]
                if wp.static(reuses_last):
                    first = trial.last
                if is_hit:
                    next_end = hand_over(
                        ends, place, chain, link.x, link.y, link.u, link.v, link.omega, link.cosine, link.sine
                    )
                if is_hit or wp.static(not reuses_last):
                    first = stage(
                        forces,
                        place,
                        chain,
                        next_end,
                        link.x,
                        link.y,
                        link.u,
                        link.v,
                        link.omega,
                        link.cosine,
                        link.sine,
                    )
        if status == RUNNING and tries_before + wp.int64(tries) >= control.step_limit:
            status = int(STEP_LIMIT)
        is_last = status != RUNNING and status != NOT_FINITE and state.last_look[world, TIME] != time
        publish(K, chain, link, lane)
        barrier()
        if lane < n:
            state.links[world, X, lane] = link.x
            state.links[world, Y, lane] = link.y
            state.links[world, THETA, lane] = link.theta
            state.links[world, U, lane] = link.u
            state.links[world, V, lane] = link.v
            state.links[world, OMEGA, lane] = link.omega
            row = int(BOARD_LOST_SELF)
            while row < wp.static(layout.BOARD_NOTES):
                kept[row, lane] = K[row, lane]
                row += 1
            kept[KEPT_STAGE, lane] = first.x
            kept[KEPT_STAGE + 1, lane] = first.y
            kept[KEPT_STAGE + 2, lane] = first.theta
            kept[KEPT_STAGE + 3, lane] = first.friction
            kept[KEPT_STAGE + 4, lane] = first.damping
            wp.atomic_max(state.extremes, world, SELF_DEPTH, deepest_self)
        if lane == 0:
            if is_last:
                # the series ends with the state in which the run ends
                write_sample(state, record, world, time, summarise(K, read_chain(model, world)))
            friction = ZERO
            damping = ZERO
            fixed = ZERO
            between = ZERO
            i = int(0)
            while i < n:
                friction += K[BOARD_LOST_FRICTION, i]
                damping += K[BOARD_LOST_DAMPING, i]
                fixed += K[BOARD_LOST_FIXED, i]
                between += K[BOARD_LOST_SELF, i]
                i += 1
            state.losses[world, LOSS_FRICTION] = friction
            state.losses[world, LOSS_DAMPING] = damping
            state.losses[world, wp.static(fixed_loss)] = fixed
            state.losses[world, LOSS_SELF] = between
            counts = state.counts[world]
            counts[ACCEPTED] = counts[ACCEPTED] + wp.int64(accepted)
            counts[REJECTED] = counts[REJECTED] + wp.int64(tries - accepted)
            counts[fixed_count] = counts[fixed_count] + wp.int64(T[wp.static(touch.fixed_hits)])
            counts[SELF_IMPULSES] = counts[SELF_IMPULSES] + wp.int64(T[wp.static(touch.self_hits)])
            state.extremes[world, OPENING] = K[BOARD_NOTES, NOTE_OPENING]
            state.extremes[world, fixed_depth] = K[BOARD_NOTES, NOTE_FIXED_DEPTH]
            state.watch[world, LAST_FLOOR_IMPULSE] = K[BOARD_NOTES, NOTE_LAST_IMPULSE]
            state.is_fresh[world] = 0
            state.has_first_stage[world] = 1
            state.gap[world] = gap
            state.slack[world] = slack
            state.time[world] = time
            state.step[world] = step
            state.last_error[world] = wp.float64(last_error)
            state.status[world] = status

    return advance_block
