"""The phases of one walk on a world: drive, release, walk.

The drive (settle, spin-up, hold until steady) needs a sprocket and no floor, the walk a floor and no sprocket. The
equations of the drive do not contain the floor, so the chain is driven about the origin and raised to its clearance at
the release. `warpchain.walks.outcome` reads the numbers of a walk, `warpchain.walks.restart` its states.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from warpchain.chain.floor import circles_of
from warpchain.chain.keep import NOTHING, Keep
from warpchain.chain.setup import Setup, State
from warpchain.chain.sprocket_motion import motion_rows
from warpchain.chain.starts import Motion, first_motions
from warpchain.engine.world import CACHES, World
from warpchain.inputs.arrays import Array
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.status import Status
from warpchain.walks.drive import drive_of
from warpchain.walks.moving_plane import released_plane, state_of_plane
from warpchain.walks.outcome import Driven, Outcome, along_floor, datum, outcome_of
from warpchain.walks.recorder import Recorder


@dataclass(frozen=True)
class Progress:
    """Where a walk is.

    Attributes:
        phase: ``"compile"``, ``"settle"``, ``"spin up"``, ``"hold"`` or ``"walk"``.
        time: Simulated time [s] since the start, in phase ``"walk"`` since the release.
        speed: Speed [m/s] along the loop, in phase ``"walk"`` of the centre of mass.
        attempts: Attempted steps so far.
        frame_time: Times [s] since the release of the frames recorded since the last call, shape (f,).
        frame_joints: Joints in the room [m] of these frames, as in `WalkResult`: x, y, shape (f, n, 2), and z, shape
            (f, n, 3), if the plane tilts.
        sprocket_height: Height [m] of the sprocket's centre at the release; NaN before it, and without a sprocket.
    """

    phase: str
    time: float
    speed: float
    attempts: int
    frame_time: Array = field(default_factory=lambda: np.empty(0), compare=False)
    frame_joints: Array = field(default_factory=lambda: np.empty((0, 0, 2)), compare=False)
    sprocket_height: float = math.nan


def phase_features(setup: Setup) -> dict[str, Features]:
    """What kernels are compiled for in those phases that a walk has: `driven`, `moving` (beside a sprocket), `free`."""
    scene, options = setup.scene, setup.options
    columns = layout.padded_width(scene.links)
    features = partial(Features, options.method, columns, self_contact=options.self_contact, is_mixed=options.is_mixed)
    body, tilts = setup.floor.body, scene.plane == "tilting"
    found = {"free": features(body, tilts=tilts)}
    if setup.has_drive:
        found["driven"] = features("sprocket")
        if scene.release is not None:
            found["moving"] = features(body, tilts=tilts, moving_sprocket=True)
    return found


class WalkRun:
    """One walk on a world, which :meth:`phases` takes from one phase to the next.

    Attributes:
        world: Where it runs, set up and read between launches.
        setup: What it is.
        driven: What is known of the time before the release.
        status: RUNNING until the run is over.
        is_released: Whether the chain walks, with or without a sprocket that moves.
        is_free: Whether the chain walks without a sprocket, and all that its start brings has been done.
    """

    def __init__(self, world: World, setup: Setup, keep: Keep = NOTHING, motion: Motion | None = None) -> None:
        """Prepare a walk; the batch of the world has its options, and records what is to be kept.

        ``motion``: how the chain lies at first, of `first_motions`, if many walks begin at once.
        """
        scene = setup.scene
        self.world, self.setup = world, setup
        self._first_motion = first_motions([setup])[0] if motion is None else motion
        self.recorder = Recorder(world, keep, setup)
        self.driven = Driven(has_sprocket=setup.has_drive)
        self.status = Status.RUNNING
        self.is_free = self.is_released = False
        self._hold_softness = 0.0
        self._tilts = scene.plane == "tilting"
        self._walk_end = min(scene.walk_limit, scene.stop_time or math.inf)  # since the release, if it is not at rest
        self._farthest = (scene.distance_limit or 0.0) * along_floor(setup)  # along x

    def phases(self) -> Iterator[Features]:
        """Set the world up for one phase after the other, and yield what its kernel must be compiled for.

        The world is then to be carried on until it stops. At the end the walk has its `status`.
        """
        yield from self._phases()
        status, scene = self.world.status, self.setup.scene
        is_planned = scene.stop_time is not None and scene.stop_time <= scene.walk_limit
        self.status = Status.FINISHED if status == Status.TIME_LIMIT and is_planned else status

    def _phases(self) -> Iterator[Features]:
        world, setup, driven, features = self.world, self.setup, self.driven, phase_features(self.setup)
        world.set_up(setup)
        if setup.start is not None:
            area = self._go_on(setup.start)
            if area is not None:
                yield features["free"]
                if self._has_failed():
                    return
                world.set_state(first_area=area)
                world.resume(self._walk_end, Status.TIME_LIMIT)
        elif not setup.has_drive:
            assert self._first_motion is not None
            self._release(*self._first_motion)
        else:
            assert self._first_motion is not None
            hanging, drive = math.nan, drive_of(setup)
            driven.full_speed_at, self._hold_softness = drive["hold_start"], drive["hold_softness"]
            world.set_drive(**drive)
            load = partial(world.load, *self._first_motion, softness=self._hold_softness)
            load(stop_time=setup.settling_time, stop_status=Status.FINISHED)
            if setup.scene.start == "rest":
                yield features["driven"]
                if self._has_failed():
                    return
                hanging = self._raise(world.position, setup.scene.clearance)
            world.resume(driven.full_speed_at + setup.scene.hold_limit, Status.NOT_STEADY)
            yield features["driven"]
            driven.drift = world.watched(layout.DRIFT)
            if self._has_failed():
                return
            driven.drive_time = world.time
            driven.counts, driven.extremes = np.array([*world.counts.values()]), np.array([*world.extremes.values()])
            free_since = float(np.fmax(driven.full_speed_at, world.unloaded_at))
            self._release(world.position, world.velocity, hanging)
            self.recorder.release(driven.drive_time, driven.raised, free_since)
            if setup.scene.release is not None:
                moving = motion_rows(setup.scene.release, setup.scene.frequency, driven.raised)
                world.set_drive(motion=moving)
                world.resume(min(setup.scene.release[-1][0], self._walk_end), Status.FINISHED)
                yield features["moving"]
                if self._has_failed():
                    return
                world.resume(self._walk_end, Status.TIME_LIMIT)
        self.is_free = True
        yield features["free"]

    def _has_failed(self) -> bool:
        """Whether the phase that is over ended otherwise than planned."""
        return self.world.status != Status.FINISHED

    def outcome(self) -> Outcome:
        """The numbers of the walk, which is over."""
        return outcome_of(self.world, self.setup, self.status, self.driven, self.is_released)

    def motion(self) -> dict[str, Any]:
        """What was kept of its motion, by the names of the arrays of `WalkResult`."""
        return self.recorder.motion(datum(self.world, self.setup))

    @property
    def _attempts_before(self) -> int:
        """Attempts before the release, if it has come."""
        return int(self.driven.counts[[layout.ACCEPTED, layout.REJECTED]].sum())

    def progress(self) -> Progress:
        """Where the walk is."""
        now, sample = self.world.time, self.world.last_sample
        counts = self.world.counts
        attempts = self._attempts_before + counts["accepted"] + counts["rejected"]
        if self.is_released:
            speed = math.hypot(sample[layout.CENTER_U], sample[layout.CENTER_V])
            height = self.driven.raised if self.driven.has_sprocket else math.nan
            return Progress(
                "walk", now or self.driven.drive_time, speed, attempts, *self.recorder.latest_frames(), height
            )
        phase = "settle" if now < self.setup.settling_time else "spin up" if now < self.driven.full_speed_at else "hold"
        return Progress(phase, now, float(sample[layout.LOOP_SPEED]), attempts)

    def drain(self) -> None:
        """Take what a launch has recorded; to be called after each launch, before the next phase."""
        self.recorder.drain(self.is_released)

    def _go_on(self, start: State) -> float | None:
        """Place a chain as a state has it; if that was taken from a walk, go on with the walk.

        If the state was changed, the world is to stop at once, and so make the sample with which its new ledger begins;
        after that `State.first_area` is to be set to what is returned, else None.
        """
        world, memory = self.world, start.memory
        self.is_released = True
        if not memory:
            self._load(start.position, start.velocity)
            return None
        self.driven = Driven.remembered(memory)
        is_kept, interval = start.is_placed_as_in(self.setup), self.recorder.keep.frame_interval
        world.restore({name: part for name, part in memory.items() if is_kept or name not in CACHES})
        world.set_state(next_frame=np.floor(start.time / interval) if interval > 0 else -1)
        world.set_drive(farthest=self._farthest)
        here = {"position": world.position, "velocity": world.velocity}
        here |= state_of_plane(world.plane) if self._tilts else {}
        is_there = all(values.tobytes() == getattr(start, name).tobytes() for name, values in here.items())
        if is_kept and is_there:  # to the bit
            world.resume(self._walk_end, Status.TIME_LIMIT)
            self.recorder.go_on(memory["state/last_sample"], start.time)
            return None
        if self._tilts:
            assert start.origin is not None and start.axes is not None and start.plane_rates is not None
            e1, e2 = start.axes
            axes = np.stack([e1, e2, np.cross(e1, e2)])  # the plane's along axis 0
            world.set_plane(np.concatenate([start.plane_rates, axes[:, 0], axes[:, 1], start.origin]))
        world.change(start.position, start.velocity)
        world.resume(world.time, Status.FINISHED)
        return float(memory["state/first_area"])

    def _raise(self, position: Array, clearance: float) -> float:
        """How far a chain at this position must be raised to a clearance [m]."""
        length, radius = self.setup.parameters.link_length, self.setup.link_values.radius
        return self.setup.floor.raised_by(circles_of(position, length), np.tile(radius, 2), clearance)

    def _release(self, position: Array, velocity: Array, hanging: float = math.nan) -> None:
        """Begin the walk of a chain; ``hanging``: how far it must be raised as it hung on its sprocket at rest [m]."""
        scene = self.setup.scene
        if scene.clearance_of == "hanging":
            raised = max(hanging, self._raise(position, 0.0))  # a loop is wider, and may reach into a wall
        else:
            raised = self._raise(position, scene.clearance)
        self.driven.raised = raised
        position[:, 1] += raised
        self._load(position, velocity)
        if self._tilts:
            self.world.set_plane(released_plane(self.setup, position))
        self.is_released = True

    def _load(self, position: Array, velocity: Array) -> None:
        """Begin the walk of a chain on its floor."""
        self.world.set_drive(farthest=self._farthest)
        has_marks = self.recorder.keep.frame_interval > 0
        before = self._attempts_before
        load = partial(self.world.load, position, velocity, softness=self._hold_softness)
        load(stop_time=self._walk_end, stop_status=Status.TIME_LIMIT, attempts_before=before, has_frame_marks=has_marks)
