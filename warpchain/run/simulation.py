"""The motion of any given chain: what tests and analysts use."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Never, Unpack

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from warpchain.chain.setup import State
from warpchain.engine.batch import Batch
from warpchain.engine.devices import gpu_turn
from warpchain.engine.tallies import LOST
from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.keywords import takes_fields
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene, check_links_on_gpu
from warpchain.inputs.validation import InputError, checked, plain, shown, validated
from warpchain.status import Status

if TYPE_CHECKING:
    from warpchain.typed import SolverFields

LONGEST = 1e9
"""Durations [s] from here on are refused."""
MOST_PLACES = 10_000_000
"""Most links × instants of a trajectory, which take 0.5 GB."""
_Numbers = Sequence[int] | NDArray[np.integer[Any]]
_UNSOFTENED = {"soften_pile": False, "soften_drive": False}
"""A given chain has no phases in which joints soften."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Trajectory:
    """Motion of a chain of n links at t chosen instants, as `warpchain.simulate` returns it.

    Attributes:
        status: how the simulation ended.
        time: instants [s], shape (t,).
        position: x, y [m] and θ [rad] of each link's centre of mass, shape (t, n, 3).
        velocity: their rates [m/s, m/s, rad/s], shape (t, n, 3).
        steps_accepted: number of accepted steps.
        steps_rejected: number of rejected steps.
        impulses: number of impulses by kind of contact.
        losses: energy lost by cause [J], positive.
        greatest_opening: greatest distance between two joined link ends [m].
        greatest_penetration: greatest overlap by kind of contact [m].
    """

    status: Status
    time: Array
    position: Array
    velocity: Array
    steps_accepted: int
    steps_rejected: int
    impulses: dict[str, int]
    losses: dict[str, float]
    greatest_opening: float
    greatest_penetration: dict[str, float]

    def __repr__(self) -> str:
        """One line."""
        return f"<Trajectory of {self.position.shape[1]} links, {len(self.time)} instants: {self.status.label}>"


@takes_fields("options", without=_UNSOFTENED, method="rkf78")
def simulate(
    parameters: State | Parameters | str,
    position: Array | None = None,
    velocity: Array | None = None,
    duration: float | None = None,
    *,
    times: Sequence[float] | Array | None = None,
    floor: Any = None,
    gravity: bool = True,
    **settings: "Unpack[SolverFields[Never]]",
) -> Trajectory:
    """Integrate a given chain, without sprocket.

    Args:
        parameters: Of the chain, or the name of a preset; or a :class:`State`, which has positions and velocities, too.
        position: (n, 3): x, y [m] and θ [rad] of each link's centre; n as of :class:`State`. Link i's right end meets
            link i + 1's left end, the last link's the first one's. Links 0, 2, … are inner ones.
        velocity: (n, 3): their rates [m/s, m/s, rad/s].
        duration: Simulated time [s], from time 0, which is that of the state; None: up to the last of ``times``.
        times: Instants of the trajectory [s], rising, in [0, duration]; steps land on them exactly. Default: 101
            instants evenly spread.
        floor: True (at y = 0), False (none) or what ``floor`` of a scene may be, such as points ``[x, y]`` [m] or
            ``[x, y, e, μ]``; None: that of the state's scene, for arrays at y = 0.
        gravity: Whether gravity acts.
        self_contact: Whether links touch one another.
        method: A key of ``warpchain.inputs.methods.METHODS``, such as ``"dp5"``.
        tolerance: See :func:`walk`.
        device: ``"cpu"``, ``"cuda"`` (the first GPU) or ``"cuda:N"``.
        settings: Any other field of :class:`Options` by its name.

    Returns:
        The trajectory. If ``status`` is not ``FINISHED``, it ends with the state in which the chain stopped.

    Raises:
        InputError: A value is refused; nothing has been computed. It is a ``ValueError``.
    """
    chosen = {"method": "rkf78"} | {name: value for name, value in settings.items() if value is not None}
    floor, gravity = plain(floor, "floor"), checked(gravity, "gravity", bool)
    chosen_times = None if times is None else checked_array(times, "times", "t")
    if duration is None and chosen_times is None:
        raise InputError("duration: missing; set it in s, or set times")
    if duration is None and chosen_times is not None and len(chosen_times):
        duration = max(0.0, float(chosen_times[-1]))
    end: float = checked(
        0.0 if duration is None else duration, "duration", Annotated[float, Field(ge=0, lt=LONGEST)], "s"
    )
    options = validated(Options, {**_UNSOFTENED, **chosen}, "options")
    for name in _UNSOFTENED:
        if getattr(options, name):
            raise InputError(f"options.{name}: only a walk softens its joints; remove it")
    if not isinstance(parameters, State):
        state = State.of_links(position, velocity, parameters)
    elif position is not None or velocity is not None:
        raise InputError("position: not possible with a state, which has positions and velocities; remove them")
    elif parameters.axes is not None:
        raise InputError("parameters: simulate does not support tilting planes; use walk(start=state) instead")
    elif parameters.memory and parameters.memory["state/softness"] > 0:
        raise InputError("parameters: simulate does not support softened joints; use walk(start=state) instead")
    else:
        state = parameters
    scene = state.setup.scene
    if floor is not None:
        given = {"floor": "flat" if isinstance(floor, bool) else floor, "slope": 0.0}
        scene = validated(Scene, {**vars(scene), **given}, "")
    chain = state.parameters if gravity else state.parameters.with_values({"gravity": 0.0})
    setup = replace(state.setup, scene=scene, parameters=chain)
    check_links_on_gpu(state.links, options.device, "position")
    instants = np.linspace(0.0, end, 101) if chosen_times is None else chosen_times
    is_rising = chosen_times is None or bool(np.all(np.diff(instants) > 0))
    if not len(instants) or instants[0] < 0 or instants[-1] > end or not is_rising:
        raise InputError(f"times: expected increasing times between 0 and the duration of {end} s; correct them")
    if len(instants) * state.links > MOST_PLACES:
        raise InputError(f"times: expected at most {MOST_PLACES // state.links} times, got {len(instants)}; use fewer")
    if floor is not False and not (floor is None and state.is_placed_as_in(state.setup)):
        setup.floor.check_above(state.position, chain.link_length, "position")
    with gpu_turn([options.device]):
        batch = Batch(1, state.links, options, faces=len(setup.floor.laws))
        batch.several([0]).set_up([setup])
        batch.worlds[0].load(state.position, state.velocity, stop_time=instants[0], stop_status=Status.FINISHED)
        return _follow(batch, "none" if floor is False else setup.floor.body, instants, end)


class Chains:
    """Many given chains of n links, side by side on a device, whose velocities may be changed between runs.

    For experiments, such as a drag or a push at any time. There is no sprocket; loops that collapse soften as those of
    walks do.

    Attributes:
        time: To which the chains were last carried on [s], from 0.
    """

    def __init__(
        self,
        parameters: Sequence[Parameters],
        position: Array,
        velocity: Array,
        *,
        floor: bool = True,
        **settings: "Unpack[SolverFields[Never]]",
    ) -> None:
        """Place the chains.

        Args:
            parameters: Of each of the W chains.
            position: (W, n, 3), as those of :func:`simulate`.
            velocity: (W, n, 3): their rates.
            floor: Whether there is a floor at y = 0.
            method: See :func:`simulate`.
            device: See :func:`simulate`.
            settings: Any other field of :class:`Options` by its name.

        Raises:
            InputError: A value is refused.
        """
        options = validated(Options, {"method": "explicit", "soften_drive": False, **settings}, "options")
        if options.soften_drive:
            raise InputError("options.soften_drive: these chains have no sprocket; remove it")
        floor = checked(floor, "floor", bool)
        position = checked_array(position, "position", "W", "n", 3)
        velocity, (worlds, links, _) = checked_array(velocity, "velocity", *position.shape), position.shape
        if not isinstance(parameters, list | tuple) or len(parameters) != worlds:
            raise InputError(
                f"parameters: expected Parameters of each of {worlds} chains, got {shown(parameters)}; pass a list"
            )
        if not parameters:
            raise InputError("parameters: expected at least one chain, got none; add one")
        check_links_on_gpu(links, options.device, "position")
        states = [State.of_links(*given) for given in zip(position, velocity, parameters, strict=True)]
        for state in states if floor else ():
            state.setup.floor.check_above(state.position, state.parameters.link_length, "position")
        self.time, self._links = 0.0, links
        with gpu_turn([options.device]):
            self._batch = Batch(worlds, links, options)
            every = self._batch.several(range(worlds))
            every.set_up([state.setup for state in states])
            every.load(position, velocity, stop_time=0.0, stop_status=Status.FINISHED)
            self._features = self._batch.features(fixed_body="floor" if floor else "none")
            self._batch.run(range(worlds), self._features)

    @property
    def status(self) -> NDArray[np.int32]:
        """Codes of `Status`, (W,): FINISHED of a chain that can go on."""
        return self._batch.statuses().copy()

    def motions(self, chains: _Numbers | None = None) -> tuple[Array, Array]:
        """Place and angle of the links of all chains, or of some numbers, (W, n, 3); and their rates."""
        chosen = self._batch.several(self._numbers(chains))
        return chosen.position, chosen.velocity

    def set_velocity(self, chains: _Numbers, velocity: Array) -> None:
        """Give some chains, by their numbers, other velocities, (chains, n, 3); an `InputError` if they do not fit."""
        numbers = self._numbers(chains)
        rates = checked_array(velocity, "velocity", len(numbers), self._links, 3)
        if numbers:
            chosen = self._batch.several(numbers)
            chosen.place(chosen.position, rates)

    def run(self, until: float, chains: _Numbers | None = None, *, to_rest: bool = False) -> None:
        """Carry on all chains that can go on, or those of some numbers.

        Args:
            until: Time [s], not before that of any of them.
            chains: Numbers of the chains; None: all.
            to_rest: Whether a chain that comes to rest on the floor stays there, AT_REST; others end with TIME_LIMIT.

        Raises:
            InputError: A number or the time is refused.
        """
        status = self.status
        going = [number for number in self._numbers(chains) if status[number] == Status.FINISHED]
        now = max((self._batch.worlds[number].time for number in going), default=0.0)
        until = checked(until, "until", Annotated[float, Field(ge=now, lt=LONGEST)], "s")
        if going:
            with gpu_turn([self._batch.options.device]):
                self._batch.several(going).resume(until, Status.TIME_LIMIT if to_rest else Status.FINISHED)
                self._batch.run(going, self._features)
        self.time = until

    def _numbers(self, chains: _Numbers | None) -> list[int]:
        """Numbers of chains, by default all, or an `InputError`."""
        count = len(self.status)
        numbers: list[int] = checked(chains, "chains", list[Annotated[int, Field(ge=0, lt=count)]] | None)
        return list(range(count)) if numbers is None else numbers


def _follow(batch: Batch, body: str, instants: Array, end: float) -> Trajectory:
    """Carry the chain of a batch on from instant to instant until the end [s]; ``body``: its floor."""
    features, world = batch.features(fixed_body=body), batch.worlds[0]
    reached, positions, velocities = [], [], []
    for instant in instants:
        world.resume(instant, Status.FINISHED)
        batch.run([0], features)
        reached.append(world.time)
        positions.append(world.position)
        velocities.append(world.velocity)
        if world.status != Status.FINISHED:
            break
    if world.status == Status.FINISHED and instants[-1] < end:
        world.resume(end, Status.FINISHED)
        batch.run([0], features)
    counts, extremes, losses = world.counts, world.extremes, world.losses
    kinds = ("floor", "self")
    return Trajectory(
        status=world.status,
        time=np.array(reached),
        position=np.array(positions),
        velocity=np.array(velocities),
        steps_accepted=counts["accepted"],
        steps_rejected=counts["rejected"],
        impulses={kind: counts[kind] for kind in kinds},
        losses={name: losses[name] for name in LOST},
        greatest_opening=extremes["opening"],
        greatest_penetration={kind: extremes[kind] for kind in kinds},
    )
