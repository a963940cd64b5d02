"""A block's run: what it loads from the state, the samples that one of its threads takes, what it stores."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.events import summary
from warpchain.kernels.events.present_chain import has_changed, present_chain
from warpchain.kernels.events.record import lacks_last_sample, record_is_full
from warpchain.kernels.events.sample import next_mark, observation, sampling
from warpchain.kernels.events.softening import book_softening, contact_step, spring_tolerance
from warpchain.kernels.events.tallies import add_count, of_fixed_body, raise_extreme, row_total, store_losses
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.board import load_link, publish
from warpchain.kernels.gpu.contacts.self_contacts import TouchLayout
from warpchain.kernels.gpu.increments import BlockSteps
from warpchain.kernels.gpu.stage import Run, constants, write_constants
from warpchain.kernels.gpu.threads import barrier, clock
from warpchain.kernels.gpu.upright import PlaneHooks
from warpchain.kernels.layout import BOARD_LOST_SELF, BOARD_VALUES, SELF_IMPULSES, STRAND_IMPULSES, VALUE_DEADLINE
from warpchain.kernels.physics.elementary import ONE, ZERO
from warpchain.kernels.physics.scaled_loads import drag_link, write_link
from warpchain.kernels.types import Chain, Row, Rows, Worlds

SHARES = 5
"""Doubles of a thread in the memory in which stages exchange ends."""


@wp.func
def write_bounds(run: Run, worlds: Worlds):
    """For one thread: writes on the board what bounds steps, when the next sample or frame is due, and when to stop."""
    K = run.K
    K[BOARD_VALUES, layout.VALUE_CONTACT_STEP] = contact_step(worlds, run.world, run.is_driven)
    tolerance = spring_tolerance(worlds, run.world, run.is_driven)
    K[BOARD_VALUES, layout.VALUE_INVERSE_TOLERANCE] = ONE / tolerance
    K[BOARD_VALUES, layout.VALUE_STOP_TIME] = worlds.stop_time[run.world]
    K[BOARD_VALUES, layout.VALUE_NEXT_SAMPLE] = next_mark(worlds, run.world)


@functools.cache
def hits_booking(touch: TouchLayout):
    """Warp function ``book_hits(run, worlds)``: a block's impulses go to its world's counters; for one thread."""
    _, _, floor_count = of_fixed_body(is_driven=False)
    _, _, sprocket_count = of_fixed_body(is_driven=True)

    @wp.func
    def book_hits(run: Run, worlds: Worlds):
        T = run.T
        world = run.world
        fixed_count = wp.where(run.is_driven, sprocket_count, floor_count)
        add_count(worlds, world, fixed_count, wp.int64(T[wp.static(touch.fixed_hits)]))
        add_count(worlds, world, SELF_IMPULSES, wp.int64(T[wp.static(touch.self_hits)]))
        add_count(worlds, world, STRAND_IMPULSES, wp.int64(T[wp.static(touch.strand_hits)]))
        T[wp.static(touch.fixed_hits)] = 0
        T[wp.static(touch.self_hits)] = 0
        T[wp.static(touch.strand_hits)] = 0

    return book_hits


@wp.func
def write_totals(run: Run):
    """Writes totals over the links on the board, for all threads; ends are published, and a barrier has passed.

    A thread adds a quantity up in the order of the links, as a CPU does, four at a time: it waits for memory. Threads
    without a link change nothing. The last barrier follows.
    """
    K = run.K
    lane = run.lane
    share = summary.share_of(K, constants(K), run.column)
    for first in range(0, wp.static(summary.TOTALS), SHARES):
        nothing = wp.where(first < wp.static(summary.SUMS), ZERO, -wp.float64(wp.inf))
        for k in range(SHARES):
            run.M[SHARES * lane + k] = wp.where(lane < run.links, share[first + k], nothing)
        barrier()
        if lane < SHARES:
            total = nothing
            place = lane
            while place < SHARES * run.links:
                four = wp.vec4d(
                    run.M[place], run.M[place + SHARES], run.M[place + 2 * SHARES], run.M[place + 3 * SHARES]
                )
                for k in range(4):
                    if first < wp.static(summary.SUMS):
                        total += four[k]
                    else:
                        total = summary.greater(total, four[k])
                place += 4 * SHARES
            K[BOARD_VALUES, layout.VALUE_TOTALS + first + lane] = total
        barrier()


@wp.func
def read_totals(K: Rows, chain: Chain, sample: Row):
    """Writes the totals on the board into a sample; returns the area inside the loop [m²]."""
    totals = summary.Totals()
    for k in range(wp.static(summary.TOTALS)):
        totals[k] = K[BOARD_VALUES, layout.VALUE_TOTALS + k]
    return summary.write_summary(totals, chain, sample)


@wp.func
def note_drag(K: Rows, _chain: Chain, left: wp.float64):
    """Lets every thread drag its link after the sample, see :func:`physics.scaled_loads.drag_link`."""
    K[BOARD_VALUES, layout.VALUE_DRAG] = left


@functools.cache
def block_run(features: Features, touch: TouchLayout, plane: PlaneHooks, steps: BlockSteps):
    """Warp functions for all threads of a block that load a chain's run and store it.

    ``load(run, worlds)``, which ends with a barrier, and ``store(run, worlds, time, status, accepted, attempts)``.
    """
    floor_loss, floor_depth, _ = of_fixed_body(is_driven=False)
    sprocket_loss, sprocket_depth, _ = of_fixed_body(is_driven=True)
    book_hits = hits_booking(touch)
    write_sample = observation(features, read_totals)

    @wp.func
    def load(run: Run, worlds: Worlds):
        K = run.K
        lane = run.lane
        world = run.world
        load_link(run, worlds)
        if lane < run.links:
            write_link(K, worlds.model, world, lane, worlds.load_factor[world])
            is_fresh = worlds.is_fresh[world] != 0
            for row in range(BOARD_LOST_SELF, wp.static(BOARD_VALUES)):
                K[row, lane] = wp.where(is_fresh, ZERO, run.kept[row, lane])
        wp.static(steps.load_start)(run)
        wp.static(steps.take_constants)(run)
        if lane == 0:
            write_constants(K, present_chain(worlds, world))
            plane.load(run)
            write_bounds(run, worlds)
            K[BOARD_VALUES, layout.VALUE_OPENING] = worlds.extremes[world, layout.OPENING]
            fixed_depth = wp.where(run.is_driven, sprocket_depth, floor_depth)
            K[BOARD_VALUES, layout.VALUE_FIXED_DEPTH] = worlds.extremes[world, fixed_depth]
            for k in range(wp.static(touch.touching), wp.static(touch.size)):
                run.T[k] = 0
            K[BOARD_VALUES, VALUE_DEADLINE] = clock() + worlds.control.launch_time
        barrier()  # the chain's constants are on the board
        publish(run)
        barrier()

    @wp.func
    def store(run: Run, worlds: Worlds, time: wp.float64, status: int, accepted: int, attempts: int):
        K = run.K
        lane = run.lane
        world = run.world
        is_last = lacks_last_sample(worlds, world, time, status)
        publish(run)
        barrier()
        if is_last:
            write_totals(run)
        if lane < run.links:
            for k in range(6):
                worlds.links[world, layout.X + k, lane] = K[layout.X + k, lane]
            for row in range(layout.COSINE, wp.static(layout.SINE + 1)):
                run.kept[row, lane] = K[row, lane]
            for row in range(BOARD_LOST_SELF, wp.static(BOARD_VALUES)):
                run.kept[row, lane] = K[row, lane]
        wp.static(steps.store_start)(run)
        if lane == 0:
            plane.store(run)
            if is_last:
                write_sample(K, constants(K), worlds, world, time)
            fixed_loss = wp.where(run.is_driven, sprocket_loss, floor_loss)
            store_losses(K, layout.BOARD_LOST_FRICTION, worlds, world, run.links, fixed_loss)
            worlds.losses[world, layout.LOSS_SELF] = row_total(K, BOARD_LOST_SELF, run.links)
            add_count(worlds, world, layout.ACCEPTED, wp.int64(accepted))
            add_count(worlds, world, layout.REJECTED, wp.int64(attempts - accepted))
            book_hits(run, worlds)
            worlds.extremes[world, layout.OPENING] = K[BOARD_VALUES, layout.VALUE_OPENING]
            fixed_depth = wp.where(run.is_driven, sprocket_depth, floor_depth)
            worlds.extremes[world, fixed_depth] = K[BOARD_VALUES, layout.VALUE_FIXED_DEPTH]
            deepest = wp.cast(run.T[wp.static(touch.deepest)], wp.float32)
            raise_extreme(worlds, world, layout.SELF_DEPTH, wp.float64(deepest))
            worlds.is_fresh[world] = 0
            worlds.has_first_stage[world] = 1

    return load, store


@functools.cache
def block_sample(features: Features, touch: TouchLayout, plane: PlaneHooks, steps: BlockSteps):
    """Warp function of a sample, for all threads of a block.

    ``take_sample(run, worlds, time)`` → whether the chain has changed, so that its first stage must be evaluated again;
    whether the launch pauses; status.
    """
    has_drive = features.is_driven or features.has_drive
    sample = sampling(features, read_totals, note_drag)
    book_hits = hits_booking(touch)

    @wp.func
    def take_sample(run: Run, worlds: Worlds, time: wp.float64):
        T = run.T
        world = run.world
        softness = worlds.softness[world]
        load_factor = worlds.load_factor[world]
        K = run.K
        publish(run)
        barrier()
        write_totals(run)
        if run.lane == 0:
            K[BOARD_VALUES, layout.VALUE_DRAG] = ONE
            plane.store(run)
            book_hits(run, worlds)
            chain = constants(K)
            worlds.status[world] = sample(K, chain, worlds, world, time, run.is_driven)
            if has_changed(worlds, world, softness, load_factor):
                after = present_chain(worlds, world)
                book_softening(chain, after, worlds, world)
                write_constants(K, after)
            write_bounds(run, worlds)
            if clock() > K[BOARD_VALUES, VALUE_DEADLINE]:
                T[wp.static(touch.is_late)] = 1
        barrier()
        status = worlds.status[world]
        pauses = record_is_full(worlds, world) or T[wp.static(touch.is_late)] != 0
        barrier()
        changed = has_changed(worlds, world, softness, load_factor)
        if wp.static(has_drive):
            if run.is_driven and run.lane < run.links:
                if K[BOARD_VALUES, layout.VALUE_DRAG] != ONE:
                    drag_link(K, run.lane, run.before, run.after, K[BOARD_VALUES, layout.VALUE_DRAG])
                if changed:
                    write_link(K, worlds.model, world, run.lane, worlds.load_factor[world])
                    wp.static(steps.take_constants)(run)
        return changed, pauses, status

    return take_sample
