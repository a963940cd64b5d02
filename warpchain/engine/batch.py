"""A batch of chains in arrays on a device, carried on in bounded launches. No other module launches kernels."""

import itertools
import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from warpchain.engine.constants import constants_of, rows_of
from warpchain.engine.control import control_of
from warpchain.engine.devices import Gpu, start_device
from warpchain.engine.ground import cells_of, faces_of
from warpchain.engine.kernel_choice import block_threads, features_of, load_kernels, step_kernel
from warpchain.engine.memory import CAPACITY_FRAMES, CAPACITY_SAMPLES, scratch_rows
from warpchain.engine.mirror import Mirror
from warpchain.engine.tallies import COUNTS, EXTREMES, LOSSES
from warpchain.inputs.link_values import LinkValues, alternating
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.kernels import layout
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.features import Features
from warpchain.kernels.types import LOADING_TIME, Drive, Model, Record, State
from warpchain.status import Status

Array = NDArray[np.float64]

FIRST_STEP = 1e-7  # s; it may grow fivefold per step
LANES = 3
"""Streams on which kernels for different chain lengths run side by side: chains of one length do not fill a GPU."""
LAUNCH_SECONDS = 0.1  # s, wanted duration of a launch, after which progress is shown and Ctrl-C noticed
UNSET_WATCHES = (
    *(layout.WINDOW_START, layout.STEADY_SINCE, layout.LOADED_SINCE, layout.UNLOADED_SINCE, layout.DRIFT),
    *(layout.REST_SINCE, layout.SOFTENED_AT, layout.FELL_AT),
    *(layout.SELF_CONTACT_AT, layout.SELF_CONTACT_BOUNCES, layout.SELF_CONTACT_FLIGHT),
    *(layout.COLLAPSED_AT, layout.COLLAPSE_BOUNCES, layout.COLLAPSE_FLIGHT),
    *(layout.STRANDS_MET_AT, layout.STRANDS_MET_BOUNCES, layout.STRANDS_MET_FLIGHT),
)
"""Entries of :attr:`State.watch` that are −1 until set."""


class Batch:
    """W chains on one device, each with its own parameters, state and statistics.

    Arrays are written and read through the methods. The host may read any world between launches.
    """

    def __init__(
        self,
        worlds: int,
        longest: int,
        options: Options,
        *,
        keeps_samples: bool = False,
        frame_every: int | None = None,
        frame_interval: float = 0.0,
        keeps_loads: bool = False,
        tilts: bool = False,
        faces: int = 1,
        threads: int | None = None,
    ) -> None:
        """Allocate a batch. All worlds are idle (status FINISHED) until a chain is loaded.

        Args:
            worlds: Number of chains W.
            longest: Greatest number of links of a chain that will be loaded.
            options: Shared by all worlds.
            keeps_samples: Keep the time series.
            frame_every: Keep all joint positions at every so many samples; None keeps none.
            frame_interval: Time [s] between the frames of chains that are loaded with frame marks of their own.
            keeps_loads: Keep force and moment of every joint with each frame.
            tilts: Keep the plane of the chain with samples and frames.
            faces: Most faces of a floor that is not flat.
            threads: Threads of every block on a GPU, at least as many as links; None: as many as each chain needs.
        """
        self.options = options
        self._threads = threads
        self.device = start_device(options.device)
        self.links = [0] * worlds
        self._mirrors: dict[int, Mirror] = {}
        self._gpu = self.device if isinstance(self.device, Gpu) else None
        self._stream: Any = self._gpu.stream() if self._gpu else None
        self._done: Any = None
        self._lanes = [self._gpu.stream() for _ in range(LANES)] if self._gpu else []
        self.columns = layout.padded_width(longest)
        rows = scratch_rows(options, longest, self.device, threads)

        cells = (layout.GROUND_CELLS + 1) * (faces > 1)
        shapes = {"faces": (faces, layout.FACE_VALUES), "cells": (cells, layout.CELL_VALUES)}
        self.model = self._arrays(Model, links=(layout.LINK_ROWS, longest), **shapes)
        self.drive = self._arrays(Drive, motion=(layout.MOTION_ROWS, layout.MOTION_VALUES))
        self._constant = set(self._mirrors)
        if self._gpu:
            self._order = Mirror((worlds,), wp.int32, self._gpu, self._stream)
        self.state = self._arrays(
            State,
            links=(6, longest),
            watch=(layout.WATCH_ROWS,),
            plane=(layout.PLANE_ROWS,),
            first_sample=(layout.ALL_COLUMNS,),
            last_sample=(layout.ALL_COLUMNS,),
            counts=(layout.COUNT_ROWS,),
            extremes=(layout.EXTREME_ROWS,),
            losses=(layout.LOSS_ROWS,),
        )
        self._edit(self.state.status)[:] = int(Status.FINISHED)
        samples, frames = CAPACITY_SAMPLES * keeps_samples, CAPACITY_FRAMES * (frame_every is not None)
        self.record = self._arrays(
            Record,
            samples=(samples, layout.ALL_COLUMNS if tilts else layout.SAMPLE_COLUMNS),
            frames=(frames, 2 * longest + layout.PLANE_VALUES * tilts),
            frame_times=(frames,),
            frame_loads=(frames * keeps_loads, 3 * longest),
        )

        self.control = control_of(options)
        self.control.launch_time = LAUNCH_SECONDS
        self.control.frame_every = frame_every or 1
        self.control.frame_interval = frame_interval

        self._attempts = 500
        self.scratch = wp.zeros((worlds, rows, self.columns), dtype=wp.float64, device=self.device.warp)
        self.lists = wp.zeros((worlds, list_layout(self.columns).size), dtype=wp.int32, device=self.device.warp)

    def _arrays(self, struct: Any, **shapes: tuple[int, ...]) -> Any:
        """A struct of arrays of zeros; ``shapes``: further axes of an array, after that of the worlds."""
        filled = struct()
        for name, field in struct.vars.items():
            setattr(filled, name, self._array((len(self.links), *shapes.get(name, ())), field.type.dtype))
        return filled

    def _array(self, shape: tuple[int, ...], dtype: Any) -> wp.array:
        """An array of zeros on the device that the host will read or write."""
        if self._gpu is None or math.prod(shape) == 0:
            return wp.zeros(shape, dtype=dtype, device=self.device.warp)
        mirror = Mirror(shape, dtype, self._gpu, self._stream)
        self._mirrors[mirror.array.ptr] = mirror
        return mirror.array

    def _view(self, array: wp.array) -> NDArray[Any]:
        """The elements of an array, to be read between launches."""
        values: NDArray[Any] = self._mirrors[array.ptr].view() if array.ptr in self._mirrors else array.numpy()
        return values

    def _edit(self, array: wp.array) -> NDArray[Any]:
        """The elements of an array, to be changed between launches."""
        values: NDArray[Any] = self._mirrors[array.ptr].edit() if array.ptr in self._mirrors else array.numpy()
        return values

    def set_chain(
        self, world: int, parameters: Parameters, links: int, radius: float | None = None, own: LinkValues | None = None
    ) -> None:
        """Set parameters and number of links of a world's chain.

        Args:
            world: Index.
            parameters: The chain's parameters.
            links: Number of links.
            radius: Radius [m] at which circles touch the sprocket; None: the parameter's.
            own: What each link and joint has of its own; None: inner and outer links alternate.
        """
        own = own or alternating(parameters, links)
        self.links[world] = links
        self._edit(self.model.chains)[world] = constants_of(parameters, own, radius)
        self._edit(self.model.links)[world, :, :links] = rows_of(own)

    def set_floor(self, world: int, points: Array, parameters: Parameters) -> None:
        """Set the floor of a world's chain, by the points of its profile (p, 2), if it is not flat."""
        self._edit(self.model.faces)[world, : len(points) - 1] = faces_of(points)
        if len(points) > 2:
            self._edit(self.model.cells)[world] = cells_of(points, parameters.link_length, parameters.circle_radius)

    def load(
        self,
        world: int,
        position: Array,
        velocity: Array,
        *,
        stop_time: float,
        stop_status: Status,
        attempts_before: int = 0,
        softness: float = 0.0,
        has_frame_marks: bool = False,
    ) -> None:
        """Set the state of a world's chain and start its clock at zero; its statistics and watches start anew.

        Args:
            world: Index.
            position: (n, 3): x, y [m], θ [rad].
            velocity: (n, 3), their rates.
            stop_time: Time [s] at which the run ends, exactly.
            stop_status: Status it ends with.
            attempts_before: Attempts of earlier phases, which count towards the option `step_limit`.
            softness: Softness of the joints, see :mod:`warpchain.kernels.events.softening`.
            has_frame_marks: Whether frames are `frame_interval` apart, instead of taken with samples.
        """
        state = self.state
        n = self.links[world]
        self._edit(state.links)[world, :3, :n] = position.T
        self._edit(state.links)[world, 3:, :n] = velocity.T
        clocks = (state.time, state.gap, state.time_to_contact, state.slack, state.next_sample)
        for array in (*clocks, state.counts, state.extremes, state.losses):
            self._edit(array)[world] = 0
        self._edit(state.next_frame)[world] = 0 if has_frame_marks else -1
        self._edit(state.watch)[world] = 0
        self._edit(state.watch)[world, list(UNSET_WATCHES)] = -1.0
        self._edit(state.softness)[world] = softness
        self._edit(state.load_factor)[world] = 1.0
        self._edit(state.last_sample)[world, layout.TIME] = -1.0
        self._edit(state.watch)[world, layout.LAST_FLOOR_IMPULSE] = -np.inf
        self._edit(state.attempts_before)[world] = attempts_before
        self._edit(state.has_first_stage)[world] = 0
        self._edit(state.is_fresh)[world] = 1
        self._edit(state.step)[world] = FIRST_STEP
        self._edit(state.other_step)[world] = FIRST_STEP
        self._edit(state.is_rigid)[world] = 0
        self._edit(state.closing_time)[world] = 0.0
        self._edit(state.last_error)[world] = 1.0
        self._edit(self.record.sample_count)[world] = 0
        self._edit(self.record.frame_count)[world] = 0
        self.resume(world, stop_time, stop_status)

    def set_velocities(self, worlds: Sequence[int], velocity: Array) -> None:
        """Give chains of n links that have stopped other velocities, (w, n, 3); their losses of energy start anew."""
        self._edit(self.state.links)[worlds, 3:, : velocity.shape[1]] = velocity.transpose(0, 2, 1)
        self._edit(self.state.is_fresh)[worlds] = 1

    def motions(self, worlds: Sequence[int], links: int) -> tuple[Array, Array]:
        """Positions and velocities, (w, n, 3) each, of chains that all have n links."""
        rows = self._view(self.state.links)[worlds, :, :links].transpose(0, 2, 1)
        return rows[..., :3], rows[..., 3:]

    def resume(self, world: int | Sequence[int], stop_time: float, stop_status: Status) -> None:
        """Let worlds that have stopped run on to a later time, as if they had not stopped there."""
        self._edit(self.state.stop_time)[world] = stop_time
        self._edit(self.state.stop_status)[world] = int(stop_status)
        self._edit(self.state.status)[world] = int(Status.RUNNING)

    def set_plane(self, world: int, plane: Array) -> None:
        """Set the plane of a world's chain, which tilts: (PLANE_VALUES,), see :mod:`warpchain.kernels.layout`."""
        self._edit(self.state.plane)[world] = 0.0
        for first in (0, layout.PLANE_MID):
            self._edit(self.state.plane)[world, first : first + layout.PLANE_VALUES] = plane

    def plane(self, world: int) -> Array:
        """The plane of a world's chain, if it tilts: (PLANE_VALUES,), see :mod:`warpchain.kernels.layout`."""
        return np.array(self._view(self.state.plane)[world, : layout.PLANE_VALUES])

    def set_drive(self, world: int, **values: float | Array) -> None:
        """Set fields of :class:`Drive` of a world."""
        for name, value in values.items():
            self._edit(getattr(self.drive, name))[world] = value

    def features(self, **wanted: Any) -> Features:
        """Kernel features for these worlds, see `features_of`."""
        return features_of(self.options, self.columns, **wanted)

    def run(self, worlds: Sequence[int], features: Features, after_launch: Callable[[], None] | None = None) -> None:
        """Carry worlds on until none of them is running. Results do not depend on how a run is cut into launches.

        Args:
            worlds: Indices.
            features: What the kernel is compiled for.
            after_launch: Called after each launch, to drain the record.
        """
        self.compile(features, [self.links[world] for world in worlds])
        while True:
            status = self.statuses()
            active = [world for world in worlds if status[world] == Status.RUNNING]
            if not active:
                return
            seconds = self.launch(active, features, self._attempts)
            if seconds < LAUNCH_SECONDS / 2:
                self._attempts = min(2 * self._attempts, 1_000_000)
            elif seconds > 2 * LAUNCH_SECONDS:
                self._attempts = max(self._attempts // 2, 1)
            if after_launch is not None:
                after_launch()

    def compile(self, features: Features, links: Iterable[int] = ()) -> None:
        """Compile the kernels for these features, which takes seconds the first time on a machine.

        Args:
            features: What they are compiled for.
            links: Numbers of links; on a GPU each may need its own kernel.
        """
        sizes = set(map(self.block_size, links)) if self._gpu else {1}
        load_kernels((self.device, features, size) for size in sizes)

    def block_size(self, links: int) -> int:
        """Threads of the block that carries a chain of this many links on a GPU."""
        return self._threads or block_threads(links)

    def launch(self, worlds: Sequence[int], features: Features, attempts: int) -> float:
        """Carry worlds on by at most this many attempts each; returns the wall time [s]."""
        before = time.perf_counter()
        self.start({features: worlds}, attempts)
        self.finish()
        return time.perf_counter() - before

    def start(self, groups: Mapping[Features, Sequence[int]], attempts: int) -> None:
        """Begin to carry on groups of worlds, each with its own features, by at most this many attempts.

        Until :meth:`finish` the host may not read the worlds. On a GPU this returns at once.
        """
        self.control.attempts = attempts
        arrays = [self.model, self.drive, self.state, self.record, self.scratch, self.lists, self.control]
        if self._gpu is None:
            for features, worlds in groups.items():
                numbers = wp.array(np.asarray(worlds, dtype=np.int32), dtype=wp.int32, device=self.device.warp)
                kernel = step_kernel(self.device, features, 1)
                wp.launch(kernel, dim=len(worlds), inputs=[numbers, *arrays], device=self.device.warp)
            return
        blocks: dict[tuple[Features, int], list[int]] = defaultdict(list)
        for features, worlds in groups.items():
            for world in worlds:
                blocks[features, self.block_size(self.links[world])].append(world)
        order = np.array([world for worlds in blocks.values() for world in worlds], dtype=np.int32)
        if not np.array_equal(self._order.view()[: len(order)], order):
            self._order.edit()[: len(order)] = order
        self._stream.wait_stream(self._gpu.filling)
        for mirror in (self._order, *self._mirrors.values()):
            mirror.upload()
        ready = self._stream.record_event()
        for lane in self._lanes:
            lane.wait_event(ready)
        first = 0
        for ((features, threads), worlds), lane in zip(blocks.items(), itertools.cycle(self._lanes), strict=False):
            inputs = [self._order.array[first : first + len(worlds)], *arrays]
            self._gpu.launch(step_kernel(self.device, features, threads), len(worlds), inputs, threads, lane)
            first += len(worlds)
        for lane in self._lanes:
            self._stream.wait_event(lane.record_event())
        for mirror in self._mirrors.values():
            if mirror.array.ptr not in self._constant:
                mirror.download()
        self._done = self._stream.record_event()

    def is_done(self) -> bool:
        """Whether :meth:`finish` would return at once."""
        return self._done is None or bool(self._done.is_complete)

    def finish(self) -> None:
        """Wait for the launch that was begun, if there is one."""
        if self._gpu and self._done is not None:
            self._gpu.wait(self._done)
            self._done = None

    def position(self, world: int) -> Array:
        """(n, 3): x, y [m], θ [rad]."""
        return self._view(self.state.links)[world, :3, : self.links[world]].T.copy()

    def velocity(self, world: int) -> Array:
        """(n, 3): their rates."""
        return self._view(self.state.links)[world, 3:, : self.links[world]].T.copy()

    def status(self, world: int) -> Status:
        """Status of the world."""
        return Status(int(self._view(self.state.status)[world]))

    def statuses(self) -> NDArray[np.int32]:
        """Statuses of all worlds, as numbers; a view, not to be changed."""
        return self._view(self.state.status)

    def time(self, world: int) -> float:
        """Time [s] since loading."""
        return float(self._view(self.state.time)[world])

    def counts(self, world: int) -> dict[str, int]:
        """Counters since loading."""
        row = self._view(self.state.counts)[world]
        return {name: int(value) for name, value in zip(COUNTS, row, strict=True)}

    def attempts(self, world: int) -> int:
        """Attempted steps since loading, accepted or not."""
        counts = self.counts(world)
        return counts["accepted"] + counts["rejected"]

    def extremes(self, world: int) -> dict[str, float]:
        """Greatest joint opening and depths [m] since loading."""
        row = self._view(self.state.extremes)[world]
        return {name: float(value) for name, value in zip(EXTREMES, row, strict=True)}

    def losses(self, world: int) -> dict[str, float]:
        """Energy [J] lost since loading, by cause."""
        row = self._view(self.state.losses)[world]
        return {name: float(value) for name, value in zip(LOSSES, row, strict=True)}

    def first_sample(self, world: int) -> Array:
        """The sample taken when the run began: (SAMPLE_COLUMNS,), see :mod:`warpchain.kernels.layout`."""
        return np.array(self._view(self.state.first_sample)[world])

    def last_sample(self, world: int) -> Array:
        """The chain's latest sample: (SAMPLE_COLUMNS,), that of the final state if its run has ended."""
        return np.array(self._view(self.state.last_sample)[world])

    def watched(self, world: int, row: int) -> float:
        """An entry of :attr:`State.watch` that is −1 until it is set, and then not negative; NaN while it is not."""
        entry = float(self._view(self.state.watch)[world, row])
        return entry if entry >= 0 else math.nan

    def unloaded_at(self, world: int) -> float:
        """Time [s] since loading from which a held loop has been under its own loads; −∞ if it was not watched."""
        watch = self._view(self.state.watch)[world]
        if watch[layout.UNLOADED_SINCE] >= 0:
            return float(watch[layout.UNLOADED_SINCE]) + float(LOADING_TIME)
        since = float(watch[layout.LOADED_SINCE])  # of the last hold, under a factor of 1
        return since if since >= 0 else -math.inf

    def drain_samples(self, world: int) -> Array:
        """Take the time series kept so far: (t, SAMPLE_COLUMNS), see :mod:`warpchain.kernels.layout`."""
        count = int(self._view(self.record.sample_count)[world])
        self._edit(self.record.sample_count)[world] = 0
        return self._view(self.record.samples)[world, :count].copy()

    def frame_loads(self, world: int) -> Array:
        """Force x, y [N] and moment [N m] of each joint on the link before it, in the frames kept so far: (f, n, 3).

        No frames, if loads are not kept.
        """
        n, kept = self.links[world], self.record.frame_loads.shape[1] > 0
        count = int(self._view(self.record.frame_count)[world]) if kept else 0
        rows = self._view(self.record.frame_loads)[world, :count, : 3 * n].reshape(count, 3, n)
        return rows.transpose(0, 2, 1).copy()

    def frame_planes(self, world: int) -> Array:
        """The plane in the frames kept so far: (f, PLANE_VALUES); (f, 0) if the batch does not keep planes."""
        count, first = int(self._view(self.record.frame_count)[world]), 2 * self.state.links.shape[2]
        return self._view(self.record.frames)[world, :count, first:].copy()

    def greatest_tilt(self, world: int) -> float:
        """Greatest size of the tilt [rad] of a plane since loading."""
        return math.asin(min(1.0, float(self._view(self.state.watch)[world, layout.GREATEST_LEAN])))

    def drain_frames(self, world: int) -> tuple[Array, Array]:
        """Take the frames kept so far: times (f,) [s], joint positions (f, n, 2) [m]."""
        count = int(self._view(self.record.frame_count)[world])
        self._edit(self.record.frame_count)[world] = 0
        n = self.links[world]
        rows = self._view(self.record.frames)[world, :count, : 2 * n].reshape(count, 2, n)
        return self._view(self.record.frame_times)[world, :count].copy(), rows.transpose(0, 2, 1).copy()
