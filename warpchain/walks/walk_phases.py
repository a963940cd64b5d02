"""The phases of walks on the worlds of a batch: drive, release, walk.

The drive (settle, spin-up, hold until steady) needs a sprocket and no floor, the walk a floor and no sprocket. The
equations of the drive do not contain the floor, so the chain is driven about the origin and raised to its clearance at
the release. `warpchain.walks.outcome` reads the numbers of a walk, `warpchain.walks.restart` its states.

Walks that begin a phase with the same launch begin it together, as arrays (w, …) over all of equal numbers of links.
"""

import functools
import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpchain.chain.floor import raised_by
from warpchain.chain.keep import NOTHING, Keep
from warpchain.chain.setup import Setup
from warpchain.chain.sprocket_motion import motion_rows
from warpchain.chain.starts import Motion, first_motions
from warpchain.engine.world import CACHES, World
from warpchain.inputs.arrays import Array
from warpchain.inputs.options import on_gpu
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.kernels.methods.explicit_tableaus import HYBRID, HYBRID_SPRINGS
from warpchain.status import Status
from warpchain.walks.drive import drives_of
from warpchain.walks.moving_plane import released_plane, state_of_plane
from warpchain.walks.outcome import Driven, Outcome, along_floor, datums, only, outcomes_of
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
        frame_joints: Joints of these frames in the laboratory frame [m], as in `WalkResult`: x, y, shape (f, n, 2);
            if the plane tilts x, y, z, shape (f, n, 3).
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
    """What kernels are compiled for in those phases that a walk has: `driven`, `moving` (beside a sprocket), `free`.

    On a GPU chains on a driven sprocket and those on a floor share a kernel, so that half as many are compiled and one
    launch carries both. Their steps take as long as with two kernels.
    """
    scene, options, columns = setup.scene, setup.options, layout.padded_width(setup.scene.links)
    body, tilts = "floor" if scene.is_level else setup.floor.body, scene.plane == "tilting"
    own = options.method, columns, options.self_contact, options.is_mixed
    shares = on_gpu(options.device) and not tilts
    return _kernels(*own, body, tilts, shares, setup.has_drive, scene.release is not None)


@functools.cache
def _kernels(
    method: str,
    columns: int,
    contact: bool,
    is_mixed: bool,
    body: str,
    tilts: bool,
    shares: bool,
    has_drive: bool,
    moves: bool,
) -> dict[str, Features]:
    """See `phase_features`; `shares`: one kernel, `moves`: whether the sprocket moves after the release."""
    features = partial(Features, columns=columns, self_contact=contact, is_mixed=is_mixed)
    found = {"free": features(method, fixed_body=body, tilts=tilts, has_drive=shares)}
    if has_drive:
        # on a sprocket no joint becomes rigid, and the release loads a chain anew: both methods may share this kernel
        driven = features(HYBRID_SPRINGS if method == HYBRID else method, fixed_body="sprocket")
        found["driven"] = found["free"] if shares else driven
        if moves:
            found["moving"] = features(method, fixed_body=body, tilts=tilts, moving_sprocket=True)
    return found


class WalkRun:
    """One walk on a world, which `go_on` takes from one phase to the next.

    Attributes:
        world: Where it runs, set up and read between launches.
        setup: What it is.
        features: What the kernel of its phase must be compiled for; None before the first phase and when it is over.
        driven: What is known of the time before the release.
        status: RUNNING until the run is over.
        is_released: Whether the chain walks, with or without a sprocket that moves.
    """

    def __init__(self, world: World, setup: Setup, keep: Keep = NOTHING, motion: Motion | None = None) -> None:
        """Prepare a walk; the batch of the world has its options, and records what is to be kept.

        ``motion``: how the chain lies at first, of `first_motions`, if that is known.
        """
        scene = setup.scene
        self.world, self.setup = world, setup
        self._motion = first_motions([setup])[0] if motion is None else motion
        self.features: Features | None = None
        self.recorder = Recorder(world, keep, setup)
        self.driven = Driven(has_sprocket=setup.has_drive)
        self.status = Status.RUNNING
        self.is_released = False
        self._next: Phase | None = _begin
        self._kernels = phase_features(setup)
        self._hanging = math.nan  # how far it must be raised as it hung on its sprocket at rest [m]
        self._hold_softness = 0.0
        self._walk_end = min(scene.walk_limit, scene.stop_time or math.inf)  # since the release, if it is not at rest
        self._farthest = (scene.distance_limit or 0.0) * along_floor(setup)  # along x

    @property
    def is_free(self) -> bool:
        """Whether the chain walks without a sprocket, and all that its start brings has been done."""
        return self._next is None

    @property
    def is_driven(self) -> bool:
        """Whether its chain hangs on a driven sprocket."""
        return not self.is_released and self.setup.has_drive

    def enter(self, kernel: str, following: "Phase | None") -> None:
        """Be in a phase with a kernel of `phase_features`, and know what begins when its chain stops."""
        self.features, self._next = self._kernels[kernel], following

    def end(self, status: Status) -> None:
        """Be over, as the world stopped with a status."""
        scene = self.setup.scene
        is_planned = scene.stop_time is not None and scene.stop_time <= scene.walk_limit
        self.status = Status.FINISHED if status == Status.TIME_LIMIT and is_planned else status
        self.features = None

    def outcome(self) -> Outcome:
        """The numbers of the walk, which is over."""
        return only(outcomes([self]))

    def motion(self) -> dict[str, Any]:
        """What was kept of its motion, by the names of the arrays of `WalkResult`."""
        return self.recorder.motion(float(datums(World.together([self.world]), [self.setup])[0]))

    def progress(self) -> Progress:
        """Where the walk is."""
        now, sample = self.world.time, self.world.state("last_sample")
        counts = self.world.counts
        attempts = int(_attempts_before([self])[0]) + counts["accepted"] + counts["rejected"]
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


Phase = Callable[[Sequence[WalkRun], World], None]
"""What begins a phase of walks that are alike, given their worlds as one."""


def go_on(runs: Sequence[WalkRun]) -> None:
    """Begin the next phase of walks that have not begun, or whose worlds have stopped: of all those alike together.

    Each world is then to be carried on with the `features` of its walk until it stops; a walk without is over.
    """
    alike: dict[tuple[Phase, int, str, bool], list[WalkRun]] = defaultdict(list)
    statuses = _together(runs).state("status").tolist()
    for run, status in zip(runs, statuses, strict=True):
        setup = run.setup
        if run._next is None or (run.features is not None and status != Status.FINISHED):
            run.end(Status(status))
        else:
            alike[run._next, setup.scene.links, setup.scene.start, setup.start is None].append(run)
    for (begin, *_), group in alike.items():
        begin(group, _together(group))


def taken(runs: Sequence[WalkRun]) -> World:
    """What `outcomes` reads of the worlds of walks that are over, which others may use then."""
    return _together(runs).taken()


def outcomes(runs: Sequence[WalkRun], worlds: Sequence[World] = ()) -> dict[str, Any]:
    """The numbers of walks that are over, see `outcomes_of`, from their own worlds or from those that were `taken`."""
    setups, statuses = [run.setup for run in runs], [run.status for run in runs]
    driven, released = [run.driven for run in runs], [run.is_released for run in runs]
    world = World.joined(worlds) if worlds else _together(runs)
    return outcomes_of(world, setups, statuses, driven, released)


def _together(runs: Sequence[WalkRun]) -> World:
    """The worlds of several walks as one."""
    return World.together([run.world for run in runs])


def _begin(runs: Sequence[WalkRun], world: World) -> None:
    """Set worlds up, and begin the first phase."""
    setups = [run.setup for run in runs]
    own = world.set_up(setups)
    if setups[0].start is not None:
        for run in runs:
            _continue(run)
        return
    position, velocity = (np.array(parts) for parts in zip(*(run._motion for run in runs if run._motion), strict=True))
    if not setups[0].has_drive:
        _release(runs, world, position, velocity)
        return
    drives = drives_of(setups, own)
    world.set_drive(**drives)
    for run, start, softness in zip(runs, drives["hold_start"].tolist(), drives["hold_softness"].tolist(), strict=True):
        run.driven.full_speed_at, run._hold_softness = start, softness
        run.enter("driven", _spin_up)
    settled = np.array([setup.settling_time for setup in setups])
    world.load(position, velocity, stop_time=settled, stop_status=Status.FINISHED, softness=drives["hold_softness"])
    if setups[0].scene.start != "rest":
        _hold(runs, world)


def _spin_up(runs: Sequence[WalkRun], world: World) -> None:
    """Note how chains hang at rest; their sprockets go on and turn."""
    clearances = np.array([run.setup.scene.clearance for run in runs])
    for run, hanging in zip(runs, _raised(runs, world, world.position, clearances).tolist(), strict=True):
        run._hanging = hanging
    _hold(runs, world)


def _hold(runs: Sequence[WalkRun], world: World) -> None:
    """Carry loops on until they are steady."""
    limits = np.array([run.driven.full_speed_at + run.setup.scene.hold_limit for run in runs])
    world.resume(limits, Status.NOT_STEADY)
    for run in runs:
        run.enter("driven", _let_go)


def _let_go(runs: Sequence[WalkRun], world: World) -> None:
    """Release steady loops from their sprockets, which vanish or move on."""
    position, velocity, unloaded_at = world.position, world.velocity, world.unloaded_at
    times, drifts = world.state("time").tolist(), world.watched(layout.DRIFT).tolist()
    tallies = world.state("counts"), world.state("extremes")
    for run, time, drift, counts, extremes in zip(runs, times, drifts, *tallies, strict=True):
        driven = run.driven
        driven.drive_time, driven.drift, driven.counts, driven.extremes = time, drift, counts, extremes
    _release(runs, world, position, velocity)
    for run, since in zip(runs, unloaded_at.tolist(), strict=True):
        driven, scene = run.driven, run.setup.scene
        run.recorder.release(driven.drive_time, driven.raised, float(np.fmax(driven.full_speed_at, since)))
        if scene.release is not None:
            run.world.set_drive(motion=motion_rows(scene.release, scene.frequency, driven.raised))
            run.world.resume(min(scene.release[-1][0], run._walk_end), Status.FINISHED)
            run.enter("moving", _walk)


def _walk(runs: Sequence[WalkRun], world: World) -> None:
    """Let chains walk on until they rest; nothing comes after that."""
    world.resume(np.array([run._walk_end for run in runs]), Status.TIME_LIMIT)
    for run in runs:
        run.enter("free", None)


def _continue(run: WalkRun) -> None:
    """Place a chain as a state has it; if that was taken from a walk, go on with the walk.

    If the state was changed, the world stops at once, and so makes the sample with which its new ledger begins.
    """
    start, world = run.setup.start, run.world
    assert start is not None
    memory, tilts = start.memory, run.setup.scene.plane == "tilting"
    run.is_released = True
    if not memory:
        _load([run], _together([run]), start.position[np.newaxis], start.velocity[np.newaxis])
        return
    run.driven = Driven.remembered(memory)
    is_kept, interval = start.is_placed_as_in(run.setup), run.recorder.keep.frame_interval
    world.restore({name: part for name, part in memory.items() if is_kept or name not in CACHES})
    world.set_state(next_frame=np.floor(start.time / interval) if interval > 0 else -1)
    world.set_drive(farthest=run._farthest)
    here = {"position": world.position, "velocity": world.velocity}
    here |= state_of_plane(world.plane) if tilts else {}
    is_there = all(values.tobytes() == getattr(start, name).tobytes() for name, values in here.items())
    if is_kept and is_there:  # to the bit
        _walk([run], _together([run]))
        run.recorder.go_on(memory["state/last_sample"], start.time)
        return
    if tilts:
        assert start.origin is not None and start.axes is not None and start.plane_rates is not None
        e1, e2 = start.axes
        axes = np.stack([e1, e2, np.cross(e1, e2)])  # the plane's along axis 0
        world.set_plane(np.concatenate([start.plane_rates, axes[:, 0], axes[:, 1], start.origin]))
    world.change(start.position, start.velocity)
    world.resume(world.time, Status.FINISHED)
    run.enter("free", _walk_from_change)


def _walk_from_change(runs: Sequence[WalkRun], world: World) -> None:
    """Let chains walk on whose states were changed."""
    for run in runs:
        assert run.setup.start is not None
        run.world.set_state(first_area=run.setup.start.memory["state/first_area"])
    _walk(runs, world)


def _raised(runs: Sequence[WalkRun], world: World, position: Array, clearances: Array) -> Array:
    """How far chains at these positions must be raised to their clearances [m], (w,)."""
    floors = [None if run.setup.scene.is_level else run.setup.floor for run in runs]
    lengths = np.array([run.setup.parameters.link_length for run in runs])
    return raised_by(floors, position, lengths, world.radius, clearances)


def _release(runs: Sequence[WalkRun], world: World, position: Array, velocity: Array) -> None:
    """Begin the walks of chains on their floors."""
    hangs = np.array([run.setup.scene.clearance_of == "hanging" for run in runs])
    raised = _raised(runs, world, position, np.where(hangs, 0.0, [run.setup.scene.clearance for run in runs]))
    # a loop is wider than it hung, and may reach into a wall
    raised = np.where(hangs, np.fmax([run._hanging for run in runs], raised), raised)
    position[..., 1] += raised[:, np.newaxis]
    _load(runs, world, position, velocity)
    for run, own, height in zip(runs, position, raised.tolist(), strict=True):
        run.driven.raised, run.is_released = height, True
        if run.setup.scene.plane == "tilting":
            run.world.set_plane(released_plane(run.setup, own))


def _load(runs: Sequence[WalkRun], world: World, position: Array, velocity: Array) -> None:
    """Begin the last phase of walks anew."""
    world.load(
        position,
        velocity,
        stop_time=0.0,
        stop_status=Status.TIME_LIMIT,
        softness=np.array([run._hold_softness for run in runs]),
        attempts_before=_attempts_before(runs),
        has_frame_marks=np.array([run.recorder.keep.frame_interval > 0 for run in runs]),
    )
    world.set_drive(farthest=np.array([run._farthest for run in runs]))
    _walk(runs, world)


def _attempts_before(runs: Sequence[WalkRun]) -> NDArray[np.int64]:
    """Attempts before the releases that have come, (w,)."""
    counts: NDArray[np.int64] = np.array([run.driven.counts for run in runs])
    return counts[:, layout.ACCEPTED] + counts[:, layout.REJECTED]
