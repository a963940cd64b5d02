"""`warpchain.simulate` and `warpchain.Chains`, which integrate given chains without a sprocket."""

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
from warpchain.inputs.validation import InputError, Named, checked, plain, shown, validated
from warpchain.status import Status

if TYPE_CHECKING:
    from warpchain.typed import SolverFields

LONGEST = 1e9
"""Durations of this length and longer are refused [s]."""
MOST_PLACES = 10_000_000
"""Maximum number of links × times of a trajectory, which takes 0.5 GB."""
_Numbers = Sequence[int] | NDArray[np.integer[Any]]
_UNSOFTENED = {"soften_pile": False, "soften_drive": False}
"""Options of `simulate`, because a given chain has no phases in which joints are softened."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Trajectory:
    """Motion of a chain of n links at t times; `warpchain.simulate` returns it.

    Attributes:
        status: how the simulation ended.
        time: times [s], shape (t,).
        position: x, y [m] and θ [rad] of each link's centre of mass, shape (t, n, 3).
        velocity: their rates of change [m/s, m/s, rad/s], shape (t, n, 3).
        steps_accepted: number of accepted steps.
        steps_rejected: number of rejected steps.
        impulses: number of contact impulses by kind of contact.
        losses: dissipated energy by cause [J], positive.
        greatest_opening: maximum joint separation, the distance between two joined link ends [m].
        greatest_penetration: maximum penetration depth by kind of contact [m].
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
    """Integrate the motion of a given chain without a sprocket, e.g. to test an integrator or a measured motion.

    Args:
        parameters: Physical parameters of the chain, the name of a preset, or a :class:`State`, which also has the
            positions and velocities.
        position: x, y [m] and θ [rad] of each link's centre of mass, shape (n, 3). The right end of link i meets the
            left end of link i + 1, and that of the last link meets link 0. Links 0, 2, … are inner links.
        velocity: Rates of change of ``position`` [m/s, m/s, rad/s], shape (n, 3).
        duration: Simulated time [s]; time 0 is that of the given motion. None: up to the last of ``times``.
        times: Times of the trajectory [s], increasing, in [0, duration]; steps end exactly at them. None: 101 times at
            equal intervals.
        floor: True (at y = 0), False (no floor), or any floor of a scene, e.g. points ``[x, y]`` [m] or
            ``[x, y, e, μ]``. None: the floor of the state's scene; y = 0 for arrays.
        gravity: Whether gravity acts.
        self_contact: Whether links can touch each other.
        method: Integrator, a key of ``warpchain.inputs.methods.METHODS`` such as ``"dp5"``.
        tolerance: Maximum error of a step, see :func:`walk`.
        device: ``"cpu"``, ``"cuda"`` (the first GPU) or ``"cuda:N"``.
        settings: Any other field of :class:`Options` by its name.

    Returns:
        The trajectory. If ``status`` is not ``FINISHED``, it ends with the state at which the integration stopped.

    Raises:
        InputError: A value is refused, before anything is computed. It is a ``ValueError``.
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
    """Many given chains of n links on one device, whose velocities you can change while they move.

    Use it for experiments such as a drag or a push at any time: call `run`, read `motions`, call `set_velocity`, and
    `run` again. The chains are independent of each other and have no sprocket. As in walks, the joints of a loop that
    has collapsed are softened.

    Attributes:
        time: time up to which the chains were last advanced [s], from 0.
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
        """Place W chains on the device, at time 0.

        Args:
            parameters: Physical parameters of each of the W chains.
            position: x, y [m] and θ [rad] of each link, shape (W, n, 3), as in :func:`simulate`.
            velocity: Rates of change of ``position``, shape (W, n, 3).
            floor: Whether there is a floor at y = 0.
            method: Solver profile or integrator, see :func:`walk`.
            device: ``"cpu"``, ``"cuda"`` (the first GPU) or ``"cuda:N"``.
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
        """Status code of each chain, shape (W,); a chain that `run` can advance has `Status.FINISHED`."""
        return self._batch.statuses().copy()

    def motions(self, chains: _Numbers | None = None) -> tuple[Array, Array]:
        """Positions and velocities of the links, (W, n, 3) each, of all chains or of those with some numbers."""
        chosen = self._batch.several(self._numbers(chains))
        return chosen.position, chosen.velocity

    def set_velocity(self, chains: _Numbers, velocity: Array) -> None:
        """Set the velocities (chains, n, 3) of the chains with some numbers.

        Raises:
            InputError: A number or the shape is refused.
        """
        numbers = self._numbers(chains)
        rates = checked_array(velocity, "velocity", len(numbers), self._links, 3)
        if numbers:
            chosen = self._batch.several(numbers)
            chosen.place(chosen.position, rates)

    def run(self, until: float, chains: _Numbers | None = None, *, to_rest: bool = False) -> None:
        """Advance all chains whose status is `FINISHED`, or those with some numbers.

        Args:
            until: Time up to which to advance [s], not before the time of any of them.
            chains: Numbers of the chains; None: all.
            to_rest: Whether chains that come to rest on the floor stop as `AT_REST`; the others then end as
                `TIME_LIMIT`.

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
        """Checked numbers of chains; None: all."""
        count = len(self.status)
        numbers: list[int] = checked(chains, "chains", list[Annotated[int, Field(ge=0, lt=count)]] | None)
        return list(range(count)) if numbers is None else numbers


def _follow(batch: Batch, body: str, instants: Array, end: float) -> Trajectory:
    """Advance the chain of a batch from time to time until the end [s]; ``body`` is its floor."""
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
        impulses=Named({kind: counts[kind] for kind in kinds}),
        losses=Named({name: losses[name] for name in LOST}),
        greatest_opening=extremes["opening"],
        greatest_penetration=Named({kind: extremes[kind] for kind in kinds}),
    )
