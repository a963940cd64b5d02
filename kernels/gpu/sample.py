"""A sample taken by one thread of a block, and its consequences for the following steps."""

import functools

import warp as wp

from warpchain.kernels.events.present_chain import has_changed, present_chain
from warpchain.kernels.events.sample import next_mark, sampling
from warpchain.kernels.events.softening import book_softening, contact_step, spring_tolerance
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.contacts.self_contacts import TouchLayout
from warpchain.kernels.gpu.stage import write_constants
from warpchain.kernels.gpu.threads import clock
from warpchain.kernels.layout import (
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
from warpchain.kernels.types import Control, Drive, Model, Record, State

wp.set_module_options({"enable_backward": False})


@wp.func
def write_step_bounds(
    K: wp.array2d(dtype=wp.float64), drive: Drive, state: State, control: Control, world: int, is_driven: bool
):
    """Writes the bounds of steps on springs after the last sample on the board."""
    K[BOARD_VALUES, VALUE_CONTACT_STEP] = contact_step(state, control, world, is_driven)
    K[BOARD_VALUES, VALUE_TOLERANCE] = spring_tolerance(drive, state, control, world, is_driven)


@wp.func
def write_marks(K: wp.array2d(dtype=wp.float64), state: State, control: Control, world: int):
    """Writes when the run stops and when the next sample or frame is due on the board."""
    K[BOARD_VALUES, VALUE_STOP_TIME] = state.stop_time[world]
    K[BOARD_VALUES, VALUE_NEXT_SAMPLE] = next_mark(state, control, world)


@functools.cache
def block_sample(features: Features, touch: TouchLayout):
    """Warp function ``take_sample(K, T, model, drive, state, record, control, world, time)`` for one thread of a block.

    The board's rows of ends must be written, and a barrier passed; the caller has a barrier afterwards. The status goes
    to the mailbox, and ``is_late`` is set when the launch has lasted long enough. If the loads of a driven chain have
    changed, each thread has to write the constants of its link.
    """
    is_driven = features.is_driven
    sample = sampling(features.fixed_body, features.tilts)
    present = present_chain(is_driven)

    @wp.func
    def take_sample(
        K: wp.array2d(dtype=wp.float64),
        T: wp.array(dtype=wp.int32),
        model: Model,
        drive: Drive,
        state: State,
        record: Record,
        control: Control,
        world: int,
        time: wp.float64,
    ):
        softness = state.softness[world]
        load_factor = state.load_factor[world]
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

    return take_sample
