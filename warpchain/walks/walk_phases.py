"""The run of one walk on one world of a batch: its phases, and its outcome.

The drive (settle, spin-up, hold until steady) needs a sprocket and no floor, the walk a floor and no sprocket. The
equations of the drive do not contain the floor, so the chain is driven about the origin and raised to its clearance at
the release. The state of a walk at any time after that is that of the walk, run again until then.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.engine.devices import gpu_turn
from warpchain.engine.snapshot import CACHES, change, restore, take_snapshot
from warpchain.engine.tallies import CONTACTS, COUNTS, EXTREMES, LOST
from warpchain.inputs.arrays import Array
from warpchain.inputs.floor import circles_of
from warpchain.inputs.scene import joint_radius, link_values, settling_time
from warpchain.inputs.setup import Setup
from warpchain.inputs.sprocket_motion import motion_rows
from warpchain.inputs.start_shapes import ellipse, lay_chain
from warpchain.inputs.state import State
from warpchain.inputs.validation import InputError, checked
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.status import Status
from warpchain.walks.drive import drive_of
from warpchain.walks.landmarks import RELEASE
from warpchain.walks.motion import NOTHING, Keep
from warpchain.walks.moving_plane import angles, released_plane, state_of_plane
from warpchain.walks.recorder import Recorder

_OF_THE_RUN = ("raised", "drive_time", "drift", "_at_full_speed", "_has_sprocket")
"""What a run knows of the time before its release."""
_NO_FALL: Mapping[str, float] = {
    **dict.fromkeys(("lateral_drift", "final_tilt", "final_yaw", "greatest_tilt", "fell_at"), math.nan),
    **dict.fromkeys(("fell_over", "fell_before_collapse"), -1),
}


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
    features = partial(Features, options.method, columns, self_contact=options.self_contact)
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
        status: RUNNING until the run is over.
        raised: Height [m] by which the chain and its sprocket were raised at the release, and so the height of the
            sprocket's centre above the floor; NaN before the release.
        drive_time: Simulated time [s] before the release.
        drift: Of the loop on its sprocket, see `WalkResult.drift`.
        is_free: Whether the chain walks without a sprocket, and all that its start brings has been done.
    """

    def __init__(self, batch: Batch, world: int, setup: Setup, keep: Keep = NOTHING) -> None:
        """Prepare a walk; the batch has its options, and records what is to be kept."""
        scene, parameters = setup.scene, setup.parameters
        self.setup = setup
        self.recorder = Recorder(batch, world, keep, scene.plane == "tilting")
        self.status = Status.RUNNING
        self.raised = self.drift = self._at_full_speed = math.nan
        self.drive_time = 0.0
        self._before = {"counts": np.zeros(len(COUNTS), int), "extremes": np.zeros(len(EXTREMES))}  # the release
        self.is_free = self._released = False
        self._batch, self._world = batch, world
        self._hold_softness = 0.0
        self._links = link_values(scene, parameters)
        self._has_sprocket = setup.has_drive
        self._settled = settling_time(scene)
        self._tilts = scene.plane == "tilting"
        self._level = math.cos(math.radians(scene.slope))  # of a distance along the floor
        self._walk_end = min(scene.walk_limit, scene.walk_until or math.inf)  # since the release, if it is not at rest
        self._farthest = (scene.distance_limit or 0.0) * self._level  # along x

    def phases(self) -> Iterator[Features]:
        """Set the world up for one phase after the other, and yield what its kernel must be compiled for.

        The world is then to be carried on until it stops. At the end the walk has its `status`.
        """
        yield from self._phases()
        status, scene = self._batch.status(self._world), self.setup.scene
        is_planned = scene.walk_until is not None and scene.walk_until <= scene.walk_limit
        self.status = Status.FINISHED if status == Status.TIME_LIMIT and is_planned else status

    def _phases(self) -> Iterator[Features]:
        batch, world, setup, features = self._batch, self._world, self.setup, phase_features(self.setup)
        batch.set_up(world, setup)
        if setup.start is not None:
            area = self._go_on(setup.start)
            if area is not None:
                yield features["free"]
                if batch.status(world) != Status.FINISHED:
                    return
                batch.set_state(world, first_area=area)
                batch.resume(world, self._walk_end, Status.TIME_LIMIT)
        elif not setup.has_drive:
            scene, length = setup.scene, setup.parameters.link_length
            speed = 2 * math.pi * scene.frequency * joint_radius(scene, setup.parameters)
            try:
                laid = lay_chain(ellipse(scene.ellipse_aspect), scene.links, length, speed, scene.phase)
            except ValueError:
                problem = f"too far from 1 for {scene.links} links; give one closer to it"
                raise InputError(f"scene.ellipse_aspect: {problem}") from None
            self._release(*laid)
        else:
            hanging = math.nan
            (position, velocity), drive = drive_of(setup, self._links)
            self._at_full_speed, self._hold_softness = drive["hold_start"], drive["hold_softness"]
            batch.set_drive(world, **drive)
            load = partial(batch.load, world, position, velocity, softness=self._hold_softness)
            load(stop_time=self._settled, stop_status=Status.FINISHED)
            if setup.scene.start == "rest":
                yield features["driven"]
                if batch.status(world) != Status.FINISHED:
                    return
                hanging = self._raise(batch.position(world), setup.scene.clearance)
            batch.resume(world, self._at_full_speed + setup.scene.hold_limit, Status.NOT_STEADY)
            yield features["driven"]
            self.drift = batch.watched(world, layout.DRIFT)
            if batch.status(world) != Status.FINISHED:
                return
            self.drive_time = batch.time(world)
            self._before = {name: batch.host[f"state/{name}"][world].copy() for name in self._before}
            free_since = float(np.fmax(self._at_full_speed, batch.unloaded_at(world)))
            self._release(batch.position(world), batch.velocity(world), hanging)
            self.recorder.release(self.drive_time, self.raised, free_since)
            if setup.scene.release is not None:
                moving = motion_rows(setup.scene.release, setup.scene.frequency, self.raised)
                batch.set_drive(world, motion=moving)
                batch.resume(world, min(setup.scene.release[-1][0], self._walk_end), Status.FINISHED)
                yield features["moving"]
                if batch.status(world) != Status.FINISHED:
                    return
                batch.resume(world, self._walk_end, Status.TIME_LIMIT)
        self.is_free = True
        yield features["free"]

    @property
    def counts(self) -> dict[str, int]:
        """Counters of all phases so far."""
        before = self._before["counts"] if self._released else 0
        return dict(zip(COUNTS, (before + self._batch.host["state/counts"][self._world]).tolist(), strict=True))

    def progress(self) -> Progress:
        """Where the walk is."""
        now, sample = self._batch.time(self._world), self._batch.last_sample(self._world)
        attempts = self.counts["accepted"] + self.counts["rejected"]
        if self._released:
            speed = math.hypot(sample[layout.CENTER_U], sample[layout.CENTER_V])
            height = self.raised if self._has_sprocket else math.nan
            return Progress("walk", now or self.drive_time, speed, attempts, *self.recorder.latest_frames(), height)
        phase = "settle" if now < self._settled else "spin up" if now < self._at_full_speed else "hold"
        return Progress(phase, now, float(sample[layout.LOOP_SPEED]), attempts)

    @property
    def datum(self) -> float:
        """Energy [J] of the chain's mass on the floor below the release, from which potential energies count."""
        x = self._batch.first_sample(self._world)[layout.CENTER_X]
        return self._links.total_mass * self.setup.parameters.gravity * float(self.setup.floor.heights(x))

    def energy(self) -> dict[str, float]:
        """Where the energy of the walk went [J]; NaN before the release. Keys: `walk_result.ENERGIES`."""
        first, last = self._batch.first_sample(self._world), self._batch.last_sample(self._world)
        datum = self.datum
        lost = {name: loss for name, loss in self._batch.losses(self._world).items() if name in LOST}
        ledger = {
            "kinetic_at_release": float(first[layout.KINETIC]),
            "potential_at_release": float(first[layout.GRAVITATIONAL] + first[layout.SPRING]) - datum,
            "kinetic_at_end": float(last[layout.KINETIC]),
            "potential_at_end": float(last[layout.GRAVITATIONAL] + last[layout.SPRING]) - datum,
            **lost,
        }
        at_release = ledger["kinetic_at_release"] + ledger["potential_at_release"]
        at_end = ledger["kinetic_at_end"] + ledger["potential_at_end"]
        ledger["residual"] = at_release - at_end - sum(lost.values())
        return ledger if self._released else dict.fromkeys(ledger, math.nan)

    def _fall(self, is_at_rest: bool) -> Mapping[str, float]:
        """What became of the plane; NaN and −1 if it is fixed or was never released."""
        if not (self._tilts and self._released):
            return _NO_FALL
        last = self._batch.last_sample(self._world)
        tilt, yaw = angles(last[layout.PLANE_COLUMN :])
        rows = (layout.COLLAPSED_AT, layout.FELL_AT, layout.GREATEST_LEAN)
        collapsed_at, fell_at, lean = (self._batch.watched(self._world, row) for row in rows)
        return {
            "lateral_drift": float(last[layout.CENTER_Z]) if is_at_rest else math.nan,
            "final_tilt": float(tilt),
            "final_yaw": float(yaw),
            "greatest_tilt": math.asin(min(1.0, lean)),
            "fell_at": fell_at,
            "fell_over": int(not math.isnan(fell_at)),
            "fell_before_collapse": int(fell_at < (math.inf if math.isnan(collapsed_at) else collapsed_at)),
        }

    def _ending(self, moment: str, event: str, first: int) -> dict[str, Any]:
        """When an event came, after how many bounces begun, and how long after the last impulse on the floor.

        Given is the first of its three entries of :attr:`State.watch`.
        """
        at, bounces, flight = (
            self._batch.watched(self._world, row) if self._released else math.nan for row in range(first, first + 3)
        )
        return {
            moment: at,
            f"bounces_before_{event}": -1 if math.isnan(bounces) else int(bounces),
            f"flight_before_{event}": flight if math.isfinite(flight) else math.nan,
        }

    def outcome(self) -> dict[str, Any]:
        """Results of the walk apart from its motion, by the names of the fields of `WalkResult`."""
        counts, greatest = self.counts, self._batch.host["state/extremes"][self._world]
        now = self._batch.time(self._world)
        held = (self.drive_time if self._released else now) - self._at_full_speed
        if self._released:
            greatest = np.fmax(self._before["extremes"], greatest)
        extremes = dict(zip(EXTREMES, greatest.tolist(), strict=True))
        is_at_rest = self.status == Status.AT_REST
        first, last = self._batch.first_sample(self._world), self._batch.last_sample(self._world)
        released = first if self._released else np.full_like(first, np.nan)
        columns = [layout.CENTER_X, layout.CENTER_Y, layout.WIDTH, layout.HEIGHT, layout.LOWEST]
        # Δx is x of the centre of mass, because the sprocket's centre is at x = 0; on a slope, along the floor
        return {
            "status": self.status,
            "dx": float(last[layout.CENTER_X]) / self._level if is_at_rest else math.nan,
            "walk_time": now if self._released else 0.0,
            "simulated_time": self.drive_time + now,
            "hold_time": max(0.0, held) if self._has_sprocket else math.nan,
            "drift": self.drift,
            "softened_at": self._batch.watched(self._world, layout.SOFTENED_AT),
            "bounces": counts["bounces"],
            "steps_accepted": counts["accepted"],
            "steps_rejected": counts["rejected"],
            "impulses": {kind: counts[kind] for kind in CONTACTS},
            "greatest_opening": extremes["opening"],
            "greatest_penetration": {kind: extremes[kind] for kind in CONTACTS},
            "energy": self.energy(),
            **self._fall(is_at_rest),
            **self._ending("self_contact_at", "self_contact", layout.SELF_CONTACT_AT),
            **self._ending("strands_met_at", "strands_met", layout.STRANDS_MET_AT),
            **self._ending("collapsed_at", "collapse", layout.COLLAPSED_AT),
            "sprocket_height": self.raised if self._has_sprocket else math.nan,
            "release": dict(zip(RELEASE, released[columns].tolist(), strict=True)),
            "release_speed": float(released[layout.LOOP_SPEED]),
        }

    def drain(self) -> None:
        """Take what a launch has recorded; to be called after each launch, before the next phase."""
        self.recorder.drain(self._released)

    def memory(self) -> dict[str, NDArray[Any]]:
        """All that the rest of a walk, or of its outcome, depends on: a `State.memory`."""
        return {
            **take_snapshot(self._batch, self._world),
            "setup": self.setup.fingerprint,
            **{f"run/{name}": np.array(getattr(self, name)) for name in _OF_THE_RUN},
            **{f"run/{name}": values for name, values in self._before.items()},
        }

    def _go_on(self, start: State) -> float | None:
        """Place a chain as a state has it; if that was taken from a walk, go on with the walk.

        If the state was changed, the world is to stop at once, and so make the sample with which its new ledger begins;
        after that `State.first_area` is to be set to what is returned, else None.
        """
        batch, world, memory = self._batch, self._world, start.memory
        self._released = True
        if not memory:
            self._load(start.position, start.velocity)
            return None
        for name in _OF_THE_RUN:
            setattr(self, name, memory[f"run/{name}"].item())
        self._before = {name: memory[f"run/{name}"] for name in self._before}
        is_kept, interval = start.is_placed_as_in(self.setup), self.recorder.keep.frame_interval
        restore(batch, world, {name: part for name, part in memory.items() if is_kept or name not in CACHES})
        batch.set_state(world, next_frame=np.floor(start.time / interval) if interval > 0 else -1)
        batch.set_drive(world, farthest=self._farthest)
        here = {"position": batch.position(world), "velocity": batch.velocity(world)}
        here |= state_of_plane(batch.plane(world)) if self._tilts else {}
        is_there = all(values.tobytes() == getattr(start, name).tobytes() for name, values in here.items())
        if is_kept and is_there:  # to the bit
            batch.resume(world, self._walk_end, Status.TIME_LIMIT)
            self.recorder.go_on(memory["state/last_sample"], start.time)
            return None
        if self._tilts:
            assert start.origin is not None and start.axes is not None and start.plane_rates is not None
            e1, e2 = start.axes
            axes = np.stack([e1, e2, np.cross(e1, e2)])  # the plane's along axis 0
            batch.set_plane(world, np.concatenate([start.plane_rates, axes[:, 0], axes[:, 1], start.origin]))
        change(batch, world, start.position, start.velocity)
        batch.resume(world, batch.time(world), Status.FINISHED)
        return float(memory["state/first_area"])

    def _raise(self, position: Array, clearance: float) -> float:
        """How far a chain at this position must be raised to a clearance [m]."""
        length, radius = self.setup.parameters.link_length, self._links.radius
        return self.setup.floor.raised_by(circles_of(position, length), np.tile(radius, 2), clearance)

    def _release(self, position: Array, velocity: Array, hanging: float = math.nan) -> None:
        """Begin the walk of a chain; ``hanging``: how far it must be raised as it hung on its sprocket at rest [m]."""
        scene = self.setup.scene
        if scene.clearance_of == "hanging":
            self.raised = max(hanging, self._raise(position, 0.0))  # a loop is wider, and may reach into a wall
        else:
            self.raised = self._raise(position, scene.clearance)
        position[:, 1] += self.raised
        self._load(position, velocity)
        if self._tilts:
            self._batch.set_plane(self._world, released_plane(self.setup, position))
        self._released = True

    def _load(self, position: Array, velocity: Array) -> None:
        """Begin the walk of a chain on its floor."""
        self._batch.set_drive(self._world, farthest=self._farthest)
        before = int(self._before["counts"][[layout.ACCEPTED, layout.REJECTED]].sum())
        has_marks = self.recorder.keep.frame_interval > 0
        load = partial(self._batch.load, self._world, position, velocity, softness=self._hold_softness)
        load(stop_time=self._walk_end, stop_status=Status.TIME_LIMIT, attempts_before=before, has_frame_marks=has_marks)


def state_at(setup: Setup, t: object, end: float) -> State:
    """The state of a walk at the end of its first step at or after a time [s], see `WalkResult.state`.

    Launches that go past that step are undone and shortened, down to one attempt: so the walk makes the steps that it
    always makes, and none for this time. Its end [s] is NaN if it came before the release. An `InputError` says that
    there is no such time, or that the walk, run again, ends before.
    """
    time: float = checked(t, "t", float, "s")
    first = setup.scene.release[-1][0] if setup.scene.release is not None else 0.0  # then the sprocket vanishes
    if setup.start is not None:
        first = setup.start.time
    if np.isnan(end):
        raise InputError("t: the walk ended before its release, and has no such time; see its status")
    if setup.start is None and 0 <= time < first:
        remedy = "give more" if end >= first else f"but the walk ends at {end:g} s: it has no state"
        raise InputError(f"t: {time:g} s: the sprocket is there until {first:g} s, and a state has none; {remedy}")
    if not first <= time <= end:
        raise InputError(f"t: {time:g} s is not in the walk; give a time from {first:g} to {end:.6g}")
    with gpu_turn([setup.options.device]):
        batch = Batch(1, setup.scene.links, setup.options, faces=len(setup.floor.laws))
        run = WalkRun(batch, 0, setup)
        attempts = batch.attempts_of_launch
        for features in run.phases():
            while not (has_come := run.is_free and batch.time(0) >= time) and batch.status(0) == Status.RUNNING:
                before = take_snapshot(batch, 0) if run.is_free else None
                batch.launch([0], features, attempts)
                if before is not None and batch.time(0) >= time and attempts > 1:
                    restore(batch, 0, before)
                    attempts = max(1, attempts // 8)
            if has_come:
                return State(
                    position=batch.position(0),
                    velocity=batch.velocity(0),
                    setup=replace(setup, start=None),
                    time=batch.time(0),
                    memory=run.memory(),
                    **(state_of_plane(batch.plane(0)) if setup.scene.plane == "tilting" else {}),
                )
        raise InputError(f"t: run again, the walk ends as {run.status.label} at {batch.time(0):.6g} s; give less")
