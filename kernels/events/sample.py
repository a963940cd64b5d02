"""One sample of a chain: record it, then evaluate every watch. Frames may have closer marks of their own."""

import functools
from typing import Any

import warp as wp

from warpchain.kernels.codes import RUNNING
from warpchain.kernels.events.ending import watch_ending
from warpchain.kernels.events.record import keep_sample, write_frame
from warpchain.kernels.events.release import drag_rate, load_at, watch_steadiness
from warpchain.kernels.events.rest import watch_rest
from warpchain.kernels.events.softening import watch_collapse, watch_drive, watch_stiffening
from warpchain.kernels.events.summary import summarise
from warpchain.kernels.events.tilting import move_into_room, watch_fall, write_frame_in_room
from warpchain.kernels.features import Features
from warpchain.kernels.layout import GRAVITATIONAL, HEIGHT, TIME
from warpchain.kernels.physics.elementary import ZERO
from warpchain.kernels.physics.geometry import read_link
from warpchain.kernels.physics.load import LOADS, no_energy
from warpchain.kernels.physics.scaled_loads import drag_shape
from warpchain.kernels.types import Chain, Rows, Worlds


@wp.func
def next_mark(worlds: Worlds, world: int):
    """Time [s] from which the next sample or frame is due."""
    due = wp.float64(worlds.next_sample[world]) * worlds.control.sample_interval
    if worlds.next_frame[world] >= wp.int64(0):
        due = wp.min(due, wp.float64(worlds.next_frame[world]) * worlds.control.frame_interval)
    return due


@functools.cache
def observation(features: Features, summarise: Any = summarise):
    """Warp function that writes a sample of a chain whose ends are placed; it returns the area inside the loop [m²].

    ``summarise(K, chain, sample)`` → that area: writes the totals over all links into a sample.
    """
    energy = LOADS[features.load].energy
    has_energy = energy is not no_energy

    @wp.func
    def observe(K: Rows, chain: Chain, worlds: Worlds, world: int, time: wp.float64):
        area = summarise(K, chain, worlds.last_sample[world])
        if wp.static(has_energy):
            for i in range(chain.link_count):
                worlds.last_sample[world, GRAVITATIONAL] += energy(chain, i, read_link(K, chain, i))
        if wp.static(features.tilts):
            move_into_room(K, worlds.plane[world], chain, worlds.last_sample[world])
        keep_sample(worlds, world, time)
        return area

    return observe


@functools.cache
def sampling(features: Features, summarise: Any = summarise, drag_shape: Any = drag_shape):
    """Warp function of a sample of a chain whose ends are placed: time series, frame, watches.

    ``sample(K, chain, worlds, world, time, is_driven)`` → status; ``is_driven``: whether the chain hangs on a driven
    sprocket. It is called at or after
    :func:`next_mark`. If only a frame is due, nothing but the record changes. It may also change the softness of the
    joints, and on a sprocket the chain's loads and the velocities of its links.

    On a sprocket it watches until the loop is stationary, on a floor until the chain rests or is far. The sums of a
    plane that tilts must be those of the present state. ``drag_shape(K, chain, left)`` drags all links.
    """
    has_floor, may_be_free = features.has_floor, not features.is_driven
    may_be_driven = features.is_driven or features.has_drive
    write = observation(features, summarise)
    append_frame = write_frame_in_room if features.tilts else write_frame

    @wp.func
    def sample(K: Rows, chain: Chain, worlds: Worlds, world: int, time: wp.float64, is_driven: bool):
        frame_mark = worlds.next_frame[world]
        if frame_mark >= wp.int64(0) and time >= wp.float64(frame_mark) * worlds.control.frame_interval:
            append_frame(K, chain, worlds, world, time)
            frames_passed = wp.int64(wp.floor(time / worlds.control.frame_interval))
            worlds.next_frame[world] = wp.max(frame_mark, frames_passed) + wp.int64(1)
        mark = worlds.next_sample[world]
        if time < wp.float64(mark) * worlds.control.sample_interval:
            return RUNNING
        last_time = worlds.last_sample[world, TIME]
        is_first = last_time < ZERO
        area = write(K, chain, worlds, world, time)
        if frame_mark < wp.int64(0) and mark % worlds.control.frame_every == wp.int64(0):
            append_frame(K, chain, worlds, world, time)
        passed = wp.int64(wp.floor(time / worlds.control.sample_interval))
        worlds.next_sample[world] = wp.max(mark, passed) + wp.int64(1)
        status = int(RUNNING)
        if wp.static(may_be_free):
            if not is_driven:
                watch_ending(worlds, world, time, area, is_first)
                if wp.static(has_floor):
                    watch_stiffening(worlds, world, time)
                    watch_collapse(chain, worlds, world, time, area, is_first)
                if wp.static(features.tilts):
                    watch_fall(worlds, world, time)
                if wp.static(has_floor):
                    status = watch_rest(worlds, world, worlds.last_sample[world])
        if wp.static(may_be_driven):
            if is_driven:
                if worlds.load_factor[world] > wp.float64(1.0):
                    rate = drag_rate(chain, worlds, world, worlds.last_sample[world, HEIGHT])
                    drag_shape(K, chain, wp.exp(-rate * (time - last_time)))
                watch_steadiness(chain, worlds, world, worlds.last_sample[world])
                worlds.load_factor[world] = load_at(worlds, world, time)
                watch_drive(worlds, world, time)
        return status

    return sample
