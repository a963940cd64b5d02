"""A block's run: what it loads from the state, the samples that one of its threads takes, what it stores."""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.events.present_chain import has_changed, present_chain
from warpchain.kernels.events.record import lacks_last_sample, record_is_full
from warpchain.kernels.events.sample import VIEWS, next_mark, sampling
from warpchain.kernels.events.softening import book_softening, contact_step, spring_tolerance
from warpchain.kernels.events.tallies import add_count, of_fixed_body, raise_extreme
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.board import load_extremes, load_link, publish, store_extremes, store_link, store_losses
from warpchain.kernels.gpu.contacts.self_contacts import TouchLayout
from warpchain.kernels.gpu.stage import Place, write_constants
from warpchain.kernels.gpu.threads import barrier, clock
from warpchain.kernels.gpu.upright import BlockPlane
from warpchain.kernels.layout import (
    BOARD_LOST_SELF,
    BOARD_VALUES,
    SELF_IMPULSES,
    STRAND_IMPULSES,
    VALUE_CONTACT_STEP,
    VALUE_DEADLINE,
    VALUE_LAST_IMPULSE,
    VALUE_NEXT_SAMPLE,
    VALUE_STOP_TIME,
    VALUE_TOLERANCE,
)
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.physics.scaled_loads import write_link
from warpchain.kernels.types import Control, Drive, Integers, Model, Record, Row, Rows, State

wp.set_module_options({"enable_backward": False})


@wp.func
def write_step_bounds(K: Rows, drive: Drive, state: State, control: Control, world: int, is_driven: bool):
    """Writes the bounds of steps on springs after the last sample on the board."""
    K[BOARD_VALUES, VALUE_CONTACT_STEP] = contact_step(state, control, world, is_driven)
    K[BOARD_VALUES, VALUE_TOLERANCE] = spring_tolerance(drive, state, control, world, is_driven)


@wp.func
def write_marks(K: Rows, state: State, control: Control, world: int):
    """Writes when the run stops and when the next sample or frame is due on the board."""
    K[BOARD_VALUES, VALUE_STOP_TIME] = state.stop_time[world]
    K[BOARD_VALUES, VALUE_NEXT_SAMPLE] = next_mark(state, control, world)


@functools.cache
def block_run(features: Features, touch: TouchLayout, kept_width: int, plane: BlockPlane):
    """Warp functions for all threads of a block that load a chain's run and store it.

    Args:
        features: What the kernel is compiled for.
        touch: Where the block's counters lie.
        kept_width: Width of the rows in the scratch that are kept between launches.
        plane: Hooks of the chain's plane.

    Returns:
        ``load(K, T, P, model, drive, state, scratch, control, place, world)``, which ends with a barrier, and
        ``store(K, T, P, model, state, record, scratch, control, place, world, time, status, accepted, attempts)``.
    """
    is_driven = features.is_driven
    fixed_loss, fixed_depth, fixed_count = of_fixed_body(features.fixed_body)
    present = present_chain(is_driven)
    load_plane, store_plane = plane.load, plane.store
    write_sample, _, _ = VIEWS[features.tilts]

    @wp.func
    def kept_rows(scratch: wp.array3d(dtype=wp.float64), world: int):
        return wp.array(
            ptr=scratch[world].ptr, shape=(wp.static(BOARD_VALUES), wp.static(kept_width)), dtype=wp.float64
        )

    @wp.func
    def load(
        K: Rows,
        T: Integers,
        P: Row,
        model: Model,
        drive: Drive,
        state: State,
        scratch: wp.array3d(dtype=wp.float64),
        control: Control,
        place: Place,
        world: int,
    ):
        lane = place.lane
        load_link(K, state, world, lane, place.links)
        if lane < place.links:
            write_link(K, model, world, lane, state.load_factor[world])
            kept = kept_rows(scratch, world)
            is_fresh = state.is_fresh[world] != 0
            row = int(BOARD_LOST_SELF)
            while row < wp.static(BOARD_VALUES):
                K[row, lane] = wp.where(is_fresh, ZERO, kept[row, lane])
                row += 1
        if lane == 0:
            write_constants(K, present(model, state, control, world))
            load_plane(K, P, state, world)
            write_step_bounds(K, drive, state, control, world, wp.static(is_driven))
            load_extremes(K, state, world, fixed_depth)
            write_marks(K, state, control, world)
            T[wp.static(touch.fixed_hits)] = 0
            T[wp.static(touch.self_hits)] = 0
            T[wp.static(touch.strand_hits)] = 0
            T[wp.static(touch.deepest)] = 0
            T[wp.static(touch.is_late)] = 0
            T[wp.static(touch.votes)] = 0
            K[BOARD_VALUES, VALUE_DEADLINE] = clock() + control.launch_time
        barrier()  # the chain's constants are on the board
        publish(K, place)
        barrier()

    @wp.func
    def store(
        K: Rows,
        T: Integers,
        P: Row,
        model: Model,
        state: State,
        record: Record,
        scratch: wp.array3d(dtype=wp.float64),
        control: Control,
        place: Place,
        world: int,
        time: wp.float64,
        status: int,
        accepted: int,
        attempts: int,
    ):
        lane = place.lane
        is_last = lacks_last_sample(state, world, time, status)
        publish(K, place)
        barrier()
        if lane < place.links:
            store_link(K, state, world, lane)
            kept = kept_rows(scratch, world)
            row = int(BOARD_LOST_SELF)
            while row < wp.static(BOARD_VALUES):
                kept[row, lane] = K[row, lane]
                row += 1
        if lane == 0:
            store_plane(P, state, world)
            if is_last:
                write_sample(K, present(model, state, control, world), state, record, world, time)
            store_losses(K, state, world, place.links, wp.static(fixed_loss))
            add_count(state, world, layout.ACCEPTED, wp.int64(accepted))
            add_count(state, world, layout.REJECTED, wp.int64(attempts - accepted))
            add_count(state, world, fixed_count, wp.int64(T[wp.static(touch.fixed_hits)]))
            add_count(state, world, SELF_IMPULSES, wp.int64(T[wp.static(touch.self_hits)]))
            add_count(state, world, STRAND_IMPULSES, wp.int64(T[wp.static(touch.strand_hits)]))
            store_extremes(K, state, world, fixed_depth)
            deepest = wp.cast(T[wp.static(touch.deepest)], wp.float32)
            raise_extreme(state, world, layout.SELF_DEPTH, wp.float64(deepest))
            state.is_fresh[world] = 0
            state.has_first_stage[world] = 1

    return load, store


@functools.cache
def block_sample(features: Features, touch: TouchLayout, plane: BlockPlane):
    """Warp function of a sample, for all threads of a block.

    ``take_sample(K, T, P, model, drive, state, record, control, place, world, time)`` → whether the chain has changed,
    so that its first stage must be evaluated again; whether the launch pauses; status.
    """
    is_driven = features.is_driven
    sample = sampling(features.fixed_body, features.tilts)
    present = present_chain(is_driven)
    store_plane = plane.store

    @wp.func
    def take_sample(
        K: Rows,
        T: Integers,
        P: Row,
        model: Model,
        drive: Drive,
        state: State,
        record: Record,
        control: Control,
        place: Place,
        world: int,
        time: wp.float64,
    ):
        softness = state.softness[world]
        load_factor = state.load_factor[world]
        publish(K, place)
        barrier()
        if place.lane == 0:
            store_plane(P, state, world)
            chain = present(model, state, control, world)
            touches = state.counts[world, SELF_IMPULSES] + wp.int64(T[wp.static(touch.self_hits)])
            meetings = state.counts[world, STRAND_IMPULSES] + wp.int64(T[wp.static(touch.strand_hits)])
            last_impulse = K[BOARD_VALUES, VALUE_LAST_IMPULSE]
            T[wp.static(touch.mailbox)] = sample(
                K, chain, drive, state, record, control, world, time, touches, meetings, last_impulse
            )
            if has_changed(state, world, softness, load_factor):
                after = present(model, state, control, world)
                book_softening(chain, after, state, world)
                write_constants(K, after)
            write_step_bounds(K, drive, state, control, world, wp.static(is_driven))
            write_marks(K, state, control, world)
            if clock() > K[BOARD_VALUES, VALUE_DEADLINE]:
                T[wp.static(touch.is_late)] = 1
        barrier()
        status = T[wp.static(touch.mailbox)]
        pauses = record_is_full(record, world) or T[wp.static(touch.is_late)] != 0
        barrier()
        changed = has_changed(state, world, softness, load_factor)
        if wp.static(is_driven):
            if changed and place.lane < place.links:
                write_link(K, model, world, place.lane, state.load_factor[world])
        return changed, pauses, status

    return take_sample
