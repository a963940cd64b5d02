"""A batch of chains in arrays on a device, carried on in bounded launches. No other module launches kernels."""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp
from numpy.typing import NDArray

from warpchain.chain.keep import NOTHING, Keep
from warpchain.engine.control import control_of
from warpchain.engine.devices import Gpu, start_device
from warpchain.engine.kernel_choice import block_threads, step_kernel
from warpchain.engine.mirror import Mirror
from warpchain.engine.world import World
from warpchain.inputs.options import Options
from warpchain.kernels import layout
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.cpu.implicit.rigid_layout import scratch_rows
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.block_memory import board_rows
from warpchain.kernels.types import STATE, Drive, Model, Record, Worlds
from warpchain.status import Status

LANES = 3
"""Streams on which kernels for different chain lengths run side by side: chains of one length do not fill a GPU."""
LAUNCH_SECONDS = 0.05  # s, after which a launch on a GPU ends, progress is shown and Ctrl-C noticed
ATTEMPTS = {"cpu": 5_000, "gpu": 200_000}
"""Most attempts of each chain per launch, by kind of device; what a walk gives does not depend on it.

On a CPU 5000 take 6 to 110 ms, which is the grain of progress and of Ctrl-C. On a GPU a launch is cut by its time:
attempts in a pile take three times as long as in flight, and with equal numbers of attempts every chain would wait for
the slowest of its batch.
"""
CAPACITY_SAMPLES = 512
"""Samples of a chain that a device can hold between two launches, if the time series is kept."""
CAPACITY_FRAMES = 64
"""Frames of a chain that a device can hold between two launches, if frames are kept."""


_GROUPS: dict[str, tuple[Any, Iterable[str]]] = {
    "model": (Model, Model.vars),  # type: ignore[attr-defined, unused-ignore]
    "drive": (Drive, Drive.vars),  # type: ignore[attr-defined, unused-ignore]
    "state": (Worlds, STATE),
    "record": (Record, Record.vars),  # type: ignore[attr-defined, unused-ignore]
}
"""Structs and those of their arrays that have a copy on the host, by the first part of the names of the copies."""


class Batch:
    """W chains on one device, each with its own parameters, state and statistics.

    The host may read and change its `worlds` between launches. So many `threads` carry a chain, and `bytes` is the
    memory of all on the device.
    """

    def __init__(
        self,
        worlds: int,
        longest: int,
        options: Options,
        keep: Keep = NOTHING,
        *,
        tilts: bool = False,
        faces: int = 1,
    ) -> None:
        """Allocate a batch of so many worlds, which are idle (status FINISHED) until a chain is loaded.

        Chains have at most `longest` links, floors at most so many faces. Samples and frames are taken as `keep` says,
        at its interval those of chains with frame marks of their own; if planes tilt, planes with them.
        """
        self.options = options
        self.device = start_device(options.device)
        self.columns = layout.padded_width(longest)
        self._gpu = self.device if isinstance(self.device, Gpu) else None
        self._stream: Any = self._gpu.stream() if self._gpu else None
        self._done: Any = None
        self._lanes = [self._gpu.stream() for _ in range(LANES)] if self._gpu else []
        self.threads = block_threads(longest) if self._gpu else 1

        samples = 0 if keep.series_every is None else CAPACITY_SAMPLES
        frames = 0 if keep.frame_every is None else CAPACITY_FRAMES
        recorded = {
            "record/samples": (samples, layout.ALL_COLUMNS if tilts else layout.SAMPLE_COLUMNS),
            "record/frames": (frames, 2 * longest + layout.PLANE_VALUES * tilts),
            "record/frame_times": (frames,),
            "record/frame_loads": (frames if keep.loads else 0, 3 * longest),
        }
        shapes = {
            **recorded,
            "model/links": (layout.LINK_ROWS, longest),
            "model/faces": (faces, layout.FACE_VALUES),
            "model/cells": ((layout.GROUND_CELLS + 1) * (faces > 1), layout.CELL_VALUES),
            "drive/motion": (layout.MOTION_ROWS, layout.MOTION_VALUES),
            "state/links": (6, longest),
            "state/watch": (layout.WATCH_ROWS,),
            "state/plane": (layout.PLANE_ROWS,),
            "state/first_sample": (layout.ALL_COLUMNS,),
            "state/last_sample": (layout.ALL_COLUMNS,),
            "state/counts": (layout.COUNT_ROWS,),
            "state/extremes": (layout.EXTREME_ROWS,),
            "state/losses": (layout.LOSS_ROWS,),
        }
        fields: dict[str, tuple[tuple[int, ...], Any]] = {"worlds": ((worlds,), wp.int32)}  # of a launch, by groups
        for group, (struct, names) in _GROUPS.items():
            for name in names:
                dtype = struct.vars[name].type.dtype
                fields[f"{group}/{name}"] = (worlds, *shapes.get(f"{group}/{name}", ())), dtype
        parts = [{name: fields.pop(name) for name in recorded}, fields]
        self._recorded, self._numbers = (Mirror(part, self.device, self._stream) for part in parts)
        self._host, arrays = self._numbers.host | self._recorded.host, self._numbers.arrays | self._recorded.arrays
        self._launched = arrays.pop("worlds")
        self.state = Worlds()
        self.model, self.drive, self.record = self.state.model, self.state.drive, self.state.record
        for path, array in arrays.items():
            group, _, name = path.partition("/")
            setattr(getattr(self, group), name, array)
        self._host["state/status"][:] = int(Status.FINISHED)

        self.control = self.state.control
        self.control.assign(control_of(options))  # type: ignore[attr-defined, unused-ignore] # Warp adds it
        self.control.launch_time = LAUNCH_SECONDS
        self.control.frame_every = keep.frame_every or 1
        self.control.frame_interval = keep.frame_interval

        width = self.columns
        rows = board_rows(self.threads, width) if self._gpu else scratch_rows(options.method, width, options.is_mixed)
        self.scratch = wp.zeros((worlds, rows, width), dtype=wp.float64, device=self.device.warp)
        self.lists = wp.zeros((worlds, list_layout(width).size), dtype=wp.int32, device=self.device.warp)
        self.state.scratch, self.state.lists = self.scratch, self.lists
        self.bytes: int = self._numbers.bytes + self._recorded.bytes + self.scratch.capacity + self.lists.capacity
        self._caches = {"scratch": self.scratch, "lists": self.lists}
        self.worlds = [World(number, self._host, self._caches) for number in range(worlds)]

    def several(self, worlds: Sequence[int]) -> World:
        """Worlds by their numbers as one, to set and read them together."""
        return World(worlds, self._host, self._caches)

    def features(self, **wanted: Any) -> Features:
        """What the kernel of these worlds is compiled for; ``wanted``: what the options do not say."""
        options = self.options
        own = {"self_contact": options.self_contact, "is_mixed": options.is_mixed}
        return Features(options.method, self.columns, **own | wanted)

    @property
    def attempts_of_launch(self) -> int:
        """Attempts of each world in a launch, unless it is told another number."""
        return ATTEMPTS["cpu" if self._gpu is None else "gpu"]

    def run(self, worlds: Sequence[int], features: Features) -> None:
        """Carry worlds on until none of them is running.

        Results do not depend on how a run is cut into launches.
        """
        while active := [world for world in worlds if self.statuses()[world] == Status.RUNNING]:
            self.launch(active, features)

    def launch(
        self,
        worlds: Sequence[int],
        features: Features,
        attempts: int | None = None,
        driven: NDArray[np.bool_] | None = None,
    ) -> None:
        """Carry worlds on, see :meth:`start`, and wait for the end of the launch."""
        self.start({features: worlds}, attempts, driven)
        self.finish()

    def start(
        self,
        groups: Mapping[Features, Sequence[int] | NDArray[np.integer[Any]]],
        attempts: int | None = None,
        driven: NDArray[np.bool_] | None = None,
    ) -> None:
        """Begin to carry on groups of worlds, each with its own features, by at most this many attempts, or `ATTEMPTS`.

        `driven`, (W,): whether the chain of each world hangs on a driven sprocket, for features with `has_drive`.

        A kernel that is not loaded yet is loaded, and compiled if need be, which takes seconds.
        Until :meth:`finish` the host may not read the worlds. On a GPU this returns at once.
        """
        self.control.attempts = attempts or self.attempts_of_launch
        kernels = [step_kernel(self.device, features, self.threads) for features in groups]
        if self._gpu is None:
            for kernel, worlds in zip(kernels, groups.values(), strict=True):
                numbers = wp.array(np.asarray(worlds, dtype=np.int32), dtype=wp.int32, device=self.device.warp)
                wp.launch(kernel, dim=(len(worlds), 1), inputs=[numbers, self.state], device=self.device.warp)
            return
        order = np.concatenate([*groups.values()])
        if driven is not None:
            has_drive = np.repeat([features.has_drive for features in groups], [*map(len, groups.values())])
            order = np.where(has_drive & driven[order], -1 - order, order)  # see `gpu.loop.driven_world`
        self._host["worlds"][: len(order)] = order
        self._stream.wait_stream(self._gpu.filling)
        self._numbers.upload()
        ready = self._stream.record_event()
        for lane in self._lanes:
            lane.wait_event(ready)
        first = 0
        for kernel, worlds, lane in zip(kernels, groups.values(), itertools.cycle(self._lanes), strict=False):
            numbers = self._launched[first : first + len(worlds)]
            self._gpu.launch(kernel, len(worlds), [numbers, self.state], self.threads, lane)
            first += len(worlds)
        for lane in self._lanes:
            self._stream.wait_event(lane.record_event())
        self._numbers.download()
        if self.worlds[0].records:
            self._recorded.download()
        self._done = self._stream.record_event()

    def is_done(self) -> bool:
        """Whether :meth:`finish` would return at once."""
        return self._done is None or bool(self._done.is_complete)

    def finish(self) -> None:
        """Wait for the launch that was begun, if there is one."""
        if self._gpu and self._done is not None:
            self._gpu.wait(self._done)
            self._done = None

    def statuses(self) -> NDArray[np.int32]:
        """Statuses of all worlds, as numbers; a view, not to be changed."""
        return self._host["state/status"]
