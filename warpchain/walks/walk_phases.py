"""The run of one walk on one world of a batch: its phases, and its outcome.

The drive (settle, spin-up, hold until steady) needs a sprocket and no floor, the walk a floor and no sprocket. The
equations of the drive do not contain the floor, so the chain is driven about the origin and raised to its clearance at
the release.
"""

import math
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.engine.control import (
    HOLD_STRAIN,
    LOADED_STRAIN,
    hold_softness,
    mean_weight,
    push_rate,
    suitable_load,
)
from warpchain.engine.snapshot import set_first_area, take_snapshot
from warpchain.engine.sprocket_motion import motion_rows
from warpchain.engine.tallies import CONTACTS, COUNTS, EXTREMES, LOST
from warpchain.inputs.floor import circles_of, raised_by
from warpchain.inputs.link_values import mean_value
from warpchain.inputs.scene import (
    contact_radius,
    floor_body,
    floor_points,
    joint_radius,
    link_values,
    loop_speed,
    settling_time,
)
from warpchain.inputs.setup import Setup
from warpchain.inputs.start_shapes import ellipse, lay_chain, stadium
from warpchain.inputs.state import State
from warpchain.inputs.validation import InputError
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.status import Status
from warpchain.walks.going_on import go_on
from warpchain.walks.landmarks import at_release
from warpchain.walks.motion import NOTHING, Keep
from warpchain.walks.moving_plane import angles, lowest_point, released_plane
from warpchain.walks.recorder import Recorder

Array = NDArray[np.float64]

STILL_PERIOD = 0.25
"""Loop period [s] that is assumed when the sprocket stands still."""
SHORTEST_WINDOW, LONGEST_WINDOW = 0.05, 0.25
"""Bounds of the time [s] over which a loop under its own loads is averaged; between them half a loop period.

Loops whose links do not alternate are averaged over whole periods, no more than the lower bound needs."""
BY_ITSELF = -1.0
"""As `steady_time` means: the kernel chooses how long to watch, see :mod:`warpchain.kernels.events.release`."""


_OF_THE_RUN = ("raised", "drive_time", "drift", "_at_full_speed", "_has_sprocket")
"""What a run knows of the time before its release."""

PLANE_OUTCOME = ("lateral_drift", "final_tilt", "final_yaw", "greatest_tilt", "fell_at")
"""Numbers of a walk's outcome that only a plane that tilts has."""


class Phase(Enum):
    """Phases of a walk; the values are their names for people."""

    SETTLE = "settle"
    SPIN_UP = "spin up"
    HOLD = "hold"
    WALK = "walk"


class WalkRun:
    """One walk: loads a world; each time the world stops, it starts the next phase.

    Attributes:
        setup: What the walk is.
        status: RUNNING until the run is over.
        raised: Height [m] by which the chain and its sprocket were raised at the release, and so the height of the
            sprocket's centre above the floor; NaN before the release.
        drive_time: Simulated time [s] before the release.
        drift: How far the loop moved while it was last watched on its sprocket, relative to its height or width; NaN if
            it was not watched.
        drive_counts: Counters (:data:`warpchain.engine.tallies.COUNTS`) of the time before the release.
        drive_extremes: Greatest opening and depths [m] of the time before the release.
        recorder: What is kept of the motion since the release.
        compile_time: Wall time [s] for which the walk waited for kernels; counted only if somebody watches.
    """

    def __init__(self, batch: Batch, world: int, setup: Setup, keep: Keep = NOTHING) -> None:
        """Place the chain of a walk in a world; the batch has the walk's options, and records what is to be kept."""
        self.setup = setup
        self.recorder = Recorder(batch, world, keep, setup.scene.plane == "tilting")
        self.status = Status.RUNNING
        self.raised = math.nan
        self.drive_time = self.compile_time = 0.0
        self.drift = math.nan
        self.drive_counts = dict.fromkeys(COUNTS, 0)
        self.drive_extremes = dict.fromkeys(EXTREMES, 0.0)
        self._batch, self._world = batch, world
        self._hanging_raise = math.nan
        self._released = False
        self._hold_softness = 0.0
        self._at_full_speed = math.nan
        self._first_area: float | None = None
        self._moves_sprocket = False

        scene, parameters = setup.scene, setup.parameters
        self._links = link_values(scene, parameters)
        self._has_sprocket = setup.has_drive
        self._tilts = scene.plane == "tilting"
        self._floor = floor_points(scene)
        self._level = math.cos(math.radians(scene.slope))  # of a distance along the floor
        if setup.start is not None:
            self._go_on(setup.start)
            return
        from_rest = scene.start == "rest"
        radius = joint_radius(scene, parameters)
        speed = 2 * math.pi * scene.frequency * radius
        if not self._has_sprocket:
            self._set_chain()
            try:
                position, velocity = lay_chain(
                    ellipse(scene.ellipse_aspect), scene.links, parameters.link_length, speed, scene.phase
                )
            except ValueError:
                raise InputError(
                    f"scene.ellipse_aspect: {scene.links} links cannot follow an ellipse of aspect "
                    f"{scene.ellipse_aspect}; give one closer to 1, or more links"
                ) from None
            self._release(position, velocity)
            return
        density = mean_value(self._links.mass) / parameters.link_length
        tension = density * speed**2
        weight = mean_weight(parameters, density, scene.links, radius)
        load_factor = scene.load_factor or suitable_load(parameters, self._links, setup.options, weight)
        loaded_softness = 0.0
        if setup.options.soften_drive:
            self._hold_softness = hold_softness(parameters, tension, HOLD_STRAIN)
            loaded_softness = hold_softness(parameters, tension + load_factor * weight, LOADED_STRAIN)
        period = scene.links * parameters.link_length / speed if speed > 0 else STILL_PERIOD
        window = min(max(period / 2, SHORTEST_WINDOW), LONGEST_WINDOW)
        if not self._links.alternates:  # the loop swings as it turns: only over whole turns does its mean stay
            window = period * math.ceil(SHORTEST_WINDOW / period)
        self._set_chain(contact_radius(scene, parameters))
        self._settled = settling_time(scene)
        spin_up = scene.spin_up_time if from_rest and speed > 0 else 0.0
        self._at_full_speed = self._settled + spin_up
        start_speed = 0.0 if from_rest else speed
        position, velocity = lay_chain(stadium(radius), scene.links, parameters.link_length, start_speed)
        softness = self._hold_softness
        batch.load(world, position, velocity, stop_time=self._settled, stop_status=Status.FINISHED, softness=softness)
        batch.set_drive(
            world,
            sprocket_speed=-2 * math.pi * scene.frequency,  # clockwise, so that the walk goes towards +x
            spin_up_start=self._settled,
            spin_up_time=spin_up,
            hold_start=self._at_full_speed,
            loop_speed=loop_speed(scene, parameters),
            loop_period=period,
            load_factor=load_factor,
            steady_window=window,
            steady_time=BY_ITSELF if scene.steady_time is None else scene.steady_time,
            steady_tolerance=scene.steady_tolerance,
            further_hold=scene.further_hold,
            release_phase=scene.phase,
            hold_softness=self._hold_softness,
            loaded_softness=loaded_softness,
            push_rate=push_rate(setup.options),
        )
        if not from_rest:
            self._start_drive()

    @property
    def phase(self) -> Phase:
        """The phase that the world is in."""
        if self._released:
            return Phase.WALK
        now = self._batch.time(self._world)
        if now < self._settled:
            return Phase.SETTLE
        return Phase.SPIN_UP if now < self._at_full_speed else Phase.HOLD

    @property
    def is_released(self) -> bool:
        """Whether the chain walks without a sprocket, and all that its start brings has been done."""
        return self._released and self._first_area is None and not self._moves_sprocket

    @property
    def _walk_end(self) -> float:
        """Time [s] since the release at which a walk ends that is not at rest."""
        scene = self.setup.scene
        return min(scene.walk_limit, scene.walk_until or math.inf)

    @property
    def features(self) -> Features:
        """What the kernel that carries the world on must be compiled for."""
        if self._released:
            body = floor_body(self.setup.scene)
            return self._batch.features(fixed_body=body, tilts=self._tilts, moving_sprocket=self._moves_sprocket)
        return self._batch.features(fixed_body="sprocket")

    @property
    def counts(self) -> dict[str, int]:
        """Counters of all phases so far."""
        now = self._batch.counts(self._world)
        return {name: self.drive_counts[name] + now[name] for name in COUNTS} if self._released else now

    @property
    def extremes(self) -> dict[str, float]:
        """Greatest opening and depths [m] of all phases so far."""
        now = self._batch.extremes(self._world)
        return {name: max(self.drive_extremes[name], now[name]) for name in EXTREMES} if self._released else now

    @property
    def attempts(self) -> int:
        """Attempted steps so far."""
        counts = self.counts
        return counts["accepted"] + counts["rejected"]

    @property
    def walk_time(self) -> float:
        """Time [s] since the release."""
        return self._batch.time(self._world) if self._released else 0.0

    @property
    def simulated_time(self) -> float:
        """Time [s] simulated so far."""
        return self.drive_time + self._batch.time(self._world)

    @property
    def hold_time(self) -> float:
        """Time [s] for which the loop was held at full frequency; NaN if it was not."""
        if not self._has_sprocket:
            return math.nan
        end = self.drive_time if self._released else self._batch.time(self._world)
        return max(0.0, end - self._at_full_speed)

    @property
    def speed(self) -> float:
        """Speed [m/s] of the centre of mass in the walk, along the loop before."""
        sample = self._batch.last_sample(self._world)
        if self._released:
            return math.hypot(sample[layout.CENTER_U], sample[layout.CENTER_V])
        return float(sample[layout.LOOP_SPEED])

    def energy(self) -> dict[str, float]:
        """Where the energy of the walk went [J]; NaN before the release. Keys: `walk_result.ENERGIES`."""
        first, last = self._batch.first_sample(self._world), self._batch.last_sample(self._world)
        losses = self._batch.losses(self._world)
        lost = {name: losses[name] for name in LOST}
        ledger = {
            "kinetic_at_release": float(first[layout.KINETIC]),
            "potential_at_release": float(first[layout.GRAVITATIONAL] + first[layout.SPRING]),
            "kinetic_at_end": float(last[layout.KINETIC]),
            "potential_at_end": float(last[layout.GRAVITATIONAL] + last[layout.SPRING]),
            **lost,
        }
        at_release = ledger["kinetic_at_release"] + ledger["potential_at_release"]
        at_end = ledger["kinetic_at_end"] + ledger["potential_at_end"]
        ledger["residual"] = at_release - at_end - sum(lost.values())
        return ledger if self._released else dict.fromkeys(ledger, math.nan)

    def _fall(self, is_at_rest: bool) -> dict[str, Any]:
        """What became of the plane; NaN and −1 if it is fixed or was never released."""
        if not (self._tilts and self._released):
            return {**dict.fromkeys(PLANE_OUTCOME, math.nan), "fell_over": -1, "fell_before_collapse": -1}
        last = self._batch.last_sample(self._world)
        tilt, yaw = angles(last[layout.PLANE_COLUMN :])
        collapsed_at, fell_at = (self._batch.watched(self._world, row) for row in (layout.COLLAPSED_AT, layout.FELL_AT))
        return {
            "lateral_drift": float(last[layout.CENTER_Z]) if is_at_rest else math.nan,
            "final_tilt": float(tilt),
            "final_yaw": float(yaw),
            "greatest_tilt": self._batch.greatest_tilt(self._world),
            "fell_at": fell_at,
            "fell_over": int(not math.isnan(fell_at)),
            "fell_before_collapse": int(fell_at < (math.inf if math.isnan(collapsed_at) else collapsed_at)),
        }

    def _ending(self, moment: str, event: str, first: int) -> dict[str, Any]:
        """When an event came, after how many bounces begun, and how long after the last impulse on the floor.

        Args:
            moment: name of the field that says when.
            event: as the names of the other two have it.
            first: of the three entries of :attr:`State.watch`.
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
        counts, extremes = self.counts, self.extremes
        is_at_rest = self.status == Status.AT_REST
        first = self._batch.first_sample(self._world)
        # Δx is x of the centre of mass, because the sprocket's centre is at x = 0; on a slope, along the floor
        return {
            "status": self.status,
            "dx": float(self._batch.last_sample(self._world)[layout.CENTER_X]) / self._level
            if is_at_rest
            else math.nan,
            "walk_time": self.walk_time,
            "simulated_time": self.simulated_time,
            "hold_time": self.hold_time,
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
            **at_release(first if self._released else np.full_like(first, np.nan), self.setup.parameters.circle_radius),
        }

    def drain(self) -> None:
        """Take what a launch has recorded; to be called after each launch, before the next phase."""
        self.recorder.drain(self._released)

    def next_phase(self) -> bool:
        """Start the next phase of a world that has stopped; False if the run is over."""
        status = self._batch.status(self._world)
        if not self._released:
            self.drift = self._batch.watched(self._world, layout.DRIFT)
        if self._released and not self.is_released and status == Status.FINISHED:
            if self._first_area is not None:
                set_first_area(self._batch, self._world, self._first_area)
            self._first_area, self._moves_sprocket = None, False
            self._batch.resume(self._world, self._walk_end, Status.TIME_LIMIT)
            return True
        if self._released or status != Status.FINISHED:
            until, limit = self.setup.scene.walk_until, self.setup.scene.walk_limit
            is_planned = status == Status.TIME_LIMIT and until is not None and until <= limit
            self.status = Status.FINISHED if is_planned else status
            return False
        if self._batch.time(self._world) <= self._settled and math.isnan(self._hanging_raise):
            self._hanging_raise = self._raise(self._batch.position(self._world))
            self._start_drive()
        else:
            self.drive_time = self._batch.time(self._world)
            self.drive_counts = self._batch.counts(self._world)
            self.drive_extremes = self._batch.extremes(self._world)
            free_since = max(self._at_full_speed, self._batch.unloaded_at(self._world))
            self._release(self._batch.position(self._world), self._batch.velocity(self._world))
            self.recorder.release(self.drive_time, self.raised, free_since)
        return True

    def memory(self) -> dict[str, NDArray[Any]]:
        """All that the rest of a walk, or of its outcome, depends on: a `State.memory`."""
        return {
            **take_snapshot(self._batch, self._world),
            "setup": self.setup.fingerprint,
            **{f"run/{name}": np.array(getattr(self, name)) for name in _OF_THE_RUN},
            "run/counts": np.array([self.drive_counts[name] for name in COUNTS]),
            "run/extremes": np.array([self.drive_extremes[name] for name in EXTREMES]),
        }

    def _go_on(self, start: State) -> None:
        """Place a chain as a state has it; if that was taken from a walk, go on with the walk."""
        batch, world, memory = self._batch, self._world, start.memory
        self._set_chain()
        self._released = True
        if not memory:
            self._load(start.position, start.velocity)
            return
        for name in _OF_THE_RUN:
            setattr(self, name, memory[f"run/{name}"].item())
        self.drive_counts = dict(zip(COUNTS, memory["run/counts"].tolist(), strict=True))
        self.drive_extremes = dict(zip(EXTREMES, memory["run/extremes"].tolist(), strict=True))
        if go_on(batch, world, start, self.setup, self._walk_end, self.recorder.keep.frame_interval):
            self.recorder.go_on(memory["state/last_sample"], start.time)
        else:
            self._first_area = float(memory["state/first_area"])
        self._set_floor()

    def _start_drive(self) -> None:
        limit = self._at_full_speed + self.setup.scene.hold_limit
        self._batch.resume(self._world, limit, Status.NOT_STEADY)

    def _raise(self, position: Array) -> float:
        """How far a chain at this position must be raised to its clearance [m]."""
        clearance, parameters = self.setup.scene.clearance, self.setup.parameters
        if self._floor is None:
            return clearance - lowest_point(position, parameters)
        circles = circles_of(position, parameters.link_length)
        return raised_by(self._floor, circles, parameters.circle_radius, clearance)

    def _set_floor(self) -> None:
        """Set the floor, and how far the chain may walk on it."""
        scene = self.setup.scene
        self._batch.set_drive(self._world, farthest=(scene.distance_limit or 0.0) * self._level)
        if self._floor is not None:
            self._batch.set_floor(self._world, self._floor, self.setup.parameters)

    def _release(self, position: Array, velocity: Array) -> None:
        scene = self.setup.scene
        self.raised = self._hanging_raise if scene.clearance_of == "hanging" else self._raise(position)
        position[:, 1] += self.raised
        self._set_chain(None if scene.release is None else contact_radius(scene, self.setup.parameters))
        self._load(position, velocity)
        if self._tilts:
            self._batch.set_plane(self._world, released_plane(self.setup, position))
        if scene.release is not None:
            self._batch.set_drive(self._world, motion=motion_rows(scene.release, scene.frequency, self.raised))
            self._batch.resume(self._world, min(scene.release[-1][0], self._walk_end), Status.FINISHED)
            self._moves_sprocket = True
        self._released = True

    def _set_chain(self, radius: float | None = None) -> None:
        """Set the chain's constants, and the radius [m] at which circles touch the sprocket, if there is one."""
        self._batch.set_chain(self._world, self.setup.parameters, self.setup.scene.links, radius, self._links)

    def _load(self, position: Array, velocity: Array) -> None:
        """Begin the walk of a chain whose parameters are set."""
        self._set_floor()
        self._batch.load(
            self._world,
            position,
            velocity,
            stop_time=self._walk_end,
            stop_status=Status.TIME_LIMIT,
            attempts_before=self.drive_counts["accepted"] + self.drive_counts["rejected"],
            softness=self._hold_softness,
            has_frame_marks=self.recorder.keep.frame_interval > 0,
        )
