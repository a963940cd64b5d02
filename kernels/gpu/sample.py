"""A look at a chain in the block form: samples, watches, and what follows from them for the steps to come."""

import functools

import warp as wp

from warpchain.kernels.cpu.loop import Features
from warpchain.kernels.events.present_chain import has_changed, present_chain
from warpchain.kernels.events.record import sampling
from warpchain.kernels.events.softening import book_softening, contact_step, spring_tolerance
from warpchain.kernels.gpu.board import note_constants
from warpchain.kernels.gpu.contacts.self_contacts import TouchLayout
from warpchain.kernels.gpu.threads import clock
from warpchain.kernels.layout import (
    BOARD_NOTES,
    NOTE_CONTACT_STEP,
    NOTE_DEADLINE,
    NOTE_NEXT_LOOK,
    NOTE_STOP_TIME,
    NOTE_TOLERANCE,
)
from warpchain.kernels.physics.scaled_loads import lay_inertias
from warpchain.kernels.types import Control, Drive, Model, Record, State

wp.set_module_options({"enable_backward": False})


@wp.func
def note_bounds(
    K: wp.array2d(dtype=wp.float64), drive: Drive, state: State, control: Control, world: int, is_driven: bool
):
    """Puts on the board what bounds steps of the springs after the last look."""
    K[BOARD_NOTES, NOTE_CONTACT_STEP] = contact_step(state, control, world, is_driven)
    K[BOARD_NOTES, NOTE_TOLERANCE] = spring_tolerance(drive, state, control, world, is_driven)


@functools.cache
def block_look(features: Features, touch: TouchLayout):
    """Warp function ``look(K, T, model, drive, state, record, control, world, time)`` for one thread of a block.

    It is called behind a barrier behind the board's rows of ends, and leaves none; it puts the status into the mailbox
    and says when the launch has lasted long enough.
    """
    softens = features.softens
    is_driven = features.watch == "steady"
    look_at_chain = sampling(features.watch, softens)
    present = present_chain(softens, is_driven)

    @wp.func
    def look(
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
        T[wp.static(touch.mailbox)] = look_at_chain(K, chain, drive, state, record, control, world, time)
        if wp.static(softens or is_driven):
            if has_changed(state, world, softness, load_factor):
                after = present(model, state, control, world)
                book_softening(chain, after, state, world)
                note_constants(K, after)
                if wp.static(is_driven):
                    lay_inertias(K, after)
            note_bounds(K, drive, state, control, world, wp.static(is_driven))
        K[BOARD_NOTES, NOTE_STOP_TIME] = state.stop_time[world]
        K[BOARD_NOTES, NOTE_NEXT_LOOK] = wp.float64(state.next_sample[world]) * control.sample_interval
        if clock() > K[BOARD_NOTES, NOTE_DEADLINE]:
            T[wp.static(touch.is_late)] = 1

    return look
