"""A batch of chains in arrays on a device, carried on in bounded launches. No other module launches kernels."""

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import warp as wp
from numpy.typing import NDArray

from warpchain.engine.control import control_of
from warpchain.engine.devices import Gpu, start_device
from warpchain.engine.kernel_choice import block_threads, step_kernel
from warpchain.engine.mirror import Mirror
from warpchain.engine.tallies import COUNTS, EXTREMES, LOSSES
from warpchain.inputs.arrays import Array
from warpchain.inputs.floor import Floor
from warpchain.inputs.link_values import LinkValues, alternating
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene, contact_radius, link_values
from warpchain.inputs.state import Setup
from warpchain.kernels import layout
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.cpu.implicit.rigid_layout import scratch_rows
from warpchain.kernels.features import Features
from warpchain.kernels.gpu.functions import board_rows
from warpchain.kernels.types import LOADING_TIME, Drive, Model, Record, State
from warpchain.status import Status

FIRST_STEP = 1e-7  # s; it may grow fivefold per step
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


def _beginning() -> dict[str, Any]:
    """Fields of :class:`State` of a chain whose clock is at zero."""
    watch, sample = np.full(layout.WATCH_ROWS, -1.0), np.zeros(layout.ALL_COLUMNS)
    watch[layout.GREATEST_LEAN], watch[layout.LAST_FLOOR_IMPULSE], sample[layout.TIME] = 0.0, -np.inf, -1.0
    zeros = ("time", "gap", "time_to_contact", "slack", "next_sample", "counts", "extremes", "losses", "closing_time")
    ones = ("load_factor", "is_fresh", "last_error")
    known = {"step": FIRST_STEP, "other_step": FIRST_STEP, "watch": watch, "last_sample": sample}
    return known | dict.fromkeys((*zeros, "has_first_stage", "is_rigid"), 0) | dict.fromkeys(ones, 1)


_BEGINNING = _beginning()


class Recorded(NamedTuple):
    """What launches have recorded of a chain of n links: t samples and f frames, see :mod:`warpchain.kernels.layout`.

    Samples are (t, SAMPLE_COLUMNS), or ALL_COLUMNS if planes are kept; of the frames there are times [s], (f,), joints
    x, y [m], (f, n, 2), loads: force x, y [N] and moment [N m] of each joint on the link before it, (f, n, 3), and
    planes, (f, PLANE_VALUES). Of loads and planes that are not kept f is 0.
    """

    samples: Array
    times: Array
    frames: Array
    loads: Array
    planes: Array


_STRUCTS: dict[str, Any] = {"model": Model, "drive": Drive, "state": State, "record": Record}


class Batch:
    """W chains on one device, each with its own parameters, state and statistics.

    The host may read and change any world between launches: `host` has the arrays of the structs in
    :mod:`warpchain.kernels.types` by name, such as ``state/time``. So many `threads` carry a chain, `bytes` is the
    memory of all on the device, and `records` says whether samples or frames are kept.
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
    ) -> None:
        """Allocate a batch of so many worlds, which are idle (status FINISHED) until a chain is loaded.

        Chains have at most `longest` links, floors at most so many faces. Kept are the time series, joint positions at
        every so many samples (None: no frames) or, of chains with frame marks of their own, at an interval [s], and
        with each frame force and moment of every joint; if planes tilt, these with samples and frames.
        """
        self.options = options
        self.device = start_device(options.device)
        self.links = [0] * worlds
        self.columns = layout.padded_width(longest)
        self._gpu = self.device if isinstance(self.device, Gpu) else None
        self._stream: Any = self._gpu.stream() if self._gpu else None
        self._done: Any = None
        self._lanes = [self._gpu.stream() for _ in range(LANES)] if self._gpu else []
        self.threads = block_threads(longest) if self._gpu else 1

        self.records = keeps_samples or frame_every is not None
        samples, frames = CAPACITY_SAMPLES * keeps_samples, CAPACITY_FRAMES * (frame_every is not None)
        recorded = {
            "record/samples": (samples, layout.ALL_COLUMNS if tilts else layout.SAMPLE_COLUMNS),
            "record/frames": (frames, 2 * longest + layout.PLANE_VALUES * tilts),
            "record/frame_times": (frames,),
            "record/frame_loads": (frames * keeps_loads, 3 * longest),
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
        for group, struct in _STRUCTS.items():
            for name, field in struct.vars.items():
                fields[f"{group}/{name}"] = (worlds, *shapes.get(f"{group}/{name}", ())), field.type.dtype
        parts = [{name: fields.pop(name) for name in recorded}, fields]
        self._recorded, self._numbers = (Mirror(part, self.device, self._stream) for part in parts)
        self.host, arrays = self._numbers.host | self._recorded.host, self._numbers.arrays | self._recorded.arrays
        self._worlds = arrays.pop("worlds")
        structs = {group: struct() for group, struct in _STRUCTS.items()}
        for path, array in arrays.items():
            group, _, name = path.partition("/")
            setattr(structs[group], name, array)
        self.model, self.drive, self.state, self.record = structs.values()
        self.host["state/status"][:] = int(Status.FINISHED)

        self.control = control_of(options)
        self.control.launch_time = LAUNCH_SECONDS
        self.control.frame_every = frame_every or 1
        self.control.frame_interval = frame_interval

        width = self.columns
        rows = board_rows(self.threads, width) if self._gpu else scratch_rows(options.method, width, options.is_mixed)
        self.scratch = wp.zeros((worlds, rows, width), dtype=wp.float64, device=self.device.warp)
        self.lists = wp.zeros((worlds, list_layout(width).size), dtype=wp.int32, device=self.device.warp)
        self.bytes: int = self._numbers.bytes + self._recorded.bytes + self.scratch.capacity + self.lists.capacity

    def set_up(self, world: int, setup: Setup) -> None:
        """Set chain and floor of a world, which stay the same through a walk."""
        scene, parameters = setup.scene, setup.parameters
        self.set_chain(world, parameters, scene.links, link_values(scene, parameters), scene)
        self.set_floor(world, setup.floor)

    def set_chain(
        self, world: int, parameters: Parameters, links: int, own: LinkValues | None = None, scene: Scene | None = None
    ) -> None:
        """Set a world's chain; without values of its own, links alternate, and without a scene there is no sprocket."""
        own, half, chains = own or alternating(parameters, links), parameters.link_length / 2, self.host["model/chains"]
        values = vars(parameters) | {
            "link_count": links,
            "half_length": half,
            "inverse_square": 1 / (half * half),
            "mass": own.total_mass,
            "circle_radius": own.radius.max(),
            "inverse_smoothing": 1 / parameters.friction_smoothing,
        }
        if scene is not None:
            values["sprocket_radius"] = contact_radius(scene, parameters)
        for name in chains.dtype.names or ():
            chains[name][world] = values.get(name, 0)
        self.links[world] = links
        self.host["model/links"][world, :, :links] = tuple(vars(own).values())  # in the order of the layout

    def set_floor(self, world: int, floor: Floor) -> None:
        """Set the floor of a world whose chain is set."""
        chain = self.host["model/chains"][world]
        cells = floor.cells(2 * chain["half_length"], chain["circle_radius"])
        for name, rows in (("model/faces", floor.faces()), ("model/cells", cells)):
            self.host[name][world, : len(rows)] = rows

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

        Position, (n, 3), is x, y [m], θ [rad], velocity their rates. The run ends exactly at the stop time [s], with
        the stop status. Attempts of earlier phases count towards the option `step_limit`. Softness is that of joints,
        see :mod:`warpchain.kernels.events.softening`. Frames are taken with samples, or at `frame_interval`.
        """
        marks = 0 if has_frame_marks else -1
        self.set_state(world, **_BEGINNING, next_frame=marks, softness=softness, attempts_before=attempts_before)
        self.host["record/sample_count"][world] = self.host["record/frame_count"][world] = 0
        self.place(world, position, velocity)
        self.resume(world, stop_time, stop_status)

    def set_state(self, world: int | Sequence[int], **values: float | Array) -> None:
        """Set fields of :class:`State` of a world, or of several."""
        for name, value in values.items():
            self.host[f"state/{name}"][world] = value

    def set_drive(self, world: int, **values: float | Array) -> None:
        """Set fields of :class:`Drive` of a world."""
        for name, value in values.items():
            self.host[f"drive/{name}"][world] = value

    def place(self, world: int | Sequence[int], position: Array, velocity: Array) -> None:
        """Give a chain of n links another place and rates, (n, 3) each, or w chains, (w, n, 3); losses start anew."""
        rows = np.concatenate([position, velocity], axis=-1).swapaxes(-1, -2)
        self.host["state/links"][world, :, : rows.shape[-1]] = rows
        self.set_state(world, is_fresh=1)

    def motions(self, worlds: Sequence[int], links: int) -> tuple[Array, Array]:
        """Positions and velocities, (w, n, 3) each, of chains that all have n links."""
        rows = self.host["state/links"][worlds, :, :links].transpose(0, 2, 1)
        return rows[..., :3], rows[..., 3:]

    def resume(self, world: int | Sequence[int], stop_time: float, stop_status: Status) -> None:
        """Let worlds that have stopped run on to a later time, as if they had not stopped there."""
        self.set_state(world, stop_time=stop_time, stop_status=int(stop_status), status=int(Status.RUNNING))

    def set_plane(self, world: int, plane: Array) -> None:
        """Set the plane of a world's chain, which tilts: (PLANE_VALUES,), see :mod:`warpchain.kernels.layout`."""
        rows = np.zeros(layout.PLANE_ROWS)
        for first in (0, layout.PLANE_MID):
            rows[first : first + layout.PLANE_VALUES] = plane
        self.set_state(world, plane=rows)

    def plane(self, world: int) -> Array:
        """The plane of a world's chain, if it tilts: (PLANE_VALUES,), see :mod:`warpchain.kernels.layout`."""
        return np.array(self.host["state/plane"][world, : layout.PLANE_VALUES])

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

    def launch(self, worlds: Sequence[int], features: Features, attempts: int | None = None) -> None:
        """Carry worlds on, see :meth:`start`, and wait for the end of the launch."""
        self.start({features: worlds}, attempts)
        self.finish()

    def start(self, groups: Mapping[Features, Sequence[int]], attempts: int | None = None) -> None:
        """Begin to carry on groups of worlds, each with its own features, by at most this many attempts, or `ATTEMPTS`.

        A kernel that is not loaded yet is loaded, and compiled if need be, which takes seconds.
        Until :meth:`finish` the host may not read the worlds. On a GPU this returns at once.
        """
        self.control.attempts = attempts or self.attempts_of_launch
        arrays = [self.model, self.drive, self.state, self.record, self.scratch, self.lists, self.control]
        kernels = [step_kernel(self.device, features, self.threads) for features in groups]
        if self._gpu is None:
            for kernel, worlds in zip(kernels, groups.values(), strict=True):
                numbers = wp.array(np.asarray(worlds, dtype=np.int32), dtype=wp.int32, device=self.device.warp)
                wp.launch(kernel, dim=len(worlds), inputs=[numbers, *arrays], device=self.device.warp)
            return
        order = [world for worlds in groups.values() for world in worlds]
        self.host["worlds"][: len(order)] = order
        self._stream.wait_stream(self._gpu.filling)
        self._numbers.upload()
        ready = self._stream.record_event()
        for lane in self._lanes:
            lane.wait_event(ready)
        first = 0
        for kernel, worlds, lane in zip(kernels, groups.values(), itertools.cycle(self._lanes), strict=False):
            numbers = self._worlds[first : first + len(worlds)]
            self._gpu.launch(kernel, len(worlds), [numbers, *arrays], self.threads, lane)
            first += len(worlds)
        for lane in self._lanes:
            self._stream.wait_event(lane.record_event())
        self._numbers.download()
        if self.records:
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

    def position(self, world: int) -> Array:
        """(n, 3): x, y [m], θ [rad]."""
        return self.host["state/links"][world, :3, : self.links[world]].T.copy()

    def velocity(self, world: int) -> Array:
        """(n, 3): their rates."""
        return self.host["state/links"][world, 3:, : self.links[world]].T.copy()

    def status(self, world: int) -> Status:
        """Status of the world."""
        return Status(int(self.host["state/status"][world]))

    def statuses(self) -> NDArray[np.int32]:
        """Statuses of all worlds, as numbers; a view, not to be changed."""
        return self.host["state/status"]

    def time(self, world: int) -> float:
        """Time [s] since loading."""
        return float(self.host["state/time"][world])

    def counts(self, world: int) -> dict[str, int]:
        """Counters since loading."""
        return dict(zip(COUNTS, self.host["state/counts"][world].tolist(), strict=True))

    def extremes(self, world: int) -> dict[str, float]:
        """Greatest joint opening and depths [m] since loading."""
        return dict(zip(EXTREMES, self.host["state/extremes"][world].tolist(), strict=True))

    def losses(self, world: int) -> dict[str, float]:
        """Energy [J] lost since loading, by cause."""
        return dict(zip(LOSSES, self.host["state/losses"][world].tolist(), strict=True))

    def first_sample(self, world: int) -> Array:
        """The sample taken when the run began: (SAMPLE_COLUMNS,), see :mod:`warpchain.kernels.layout`."""
        return np.array(self.host["state/first_sample"][world])

    def last_sample(self, world: int) -> Array:
        """The chain's latest sample: (SAMPLE_COLUMNS,), that of the final state if its run has ended."""
        return np.array(self.host["state/last_sample"][world])

    def watched(self, world: int, row: int) -> float:
        """An entry of :attr:`State.watch` that is −1 until it is set, and then not negative; NaN while it is not."""
        entry = float(self.host["state/watch"][world, row])
        return entry if entry >= 0 else math.nan

    def unloaded_at(self, world: int) -> float:
        """Time [s] since loading from which a held loop has been under its own loads; NaN if it was not watched."""
        since = self.watched(world, layout.UNLOADED_SINCE) + float(LOADING_TIME)
        return self.watched(world, layout.LOADED_SINCE) if math.isnan(since) else since

    def drain(self, world: int) -> Recorded:
        """Take what launches have recorded since it was last taken."""
        n, names = self.links[world], ("samples", "frame_times", "frames", "frame_loads")
        samples, times, frames, loads = (self.host[f"record/{name}"][world] for name in names)
        taken, count = (int(self.host[f"record/{name}"][world]) for name in ("sample_count", "frame_count"))
        self.host["record/sample_count"][world] = self.host["record/frame_count"][world] = 0
        rows = frames[:count]
        return Recorded(
            samples=samples[:taken].copy(),
            times=times[:count].copy(),
            frames=rows[:, : 2 * n].reshape(-1, 2, n).transpose(0, 2, 1).copy(),
            loads=loads[:count, : 3 * n].reshape(-1, 3, n).transpose(0, 2, 1).copy(),
            planes=rows[:, 2 * self.state.links.shape[2] :].reshape(-1, layout.PLANE_VALUES).copy(),
        )
