"""The motion of any given chain: what tests and analysts use."""

from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from warpchain.engine.batch import Batch
from warpchain.engine.devices import gpu_turn
from warpchain.engine.tallies import LOST
from warpchain.inputs.keywords import Method, Number, OtherOptions, Preset, Truth
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import MOST_LINKS, check_links_on_gpu
from warpchain.inputs.validation import InputError, plain, shown, validated
from warpchain.status import Status
from warpchain.walks.trajectory import Trajectory

Array = NDArray[np.float64]

LONGEST = 1e9
"""Durations [s] from here on are refused."""
MOST_PLACES = 10_000_000
"""Most links × instants of a trajectory, which take 0.5 GB."""
_UNSOFTENED = {"soften_pile": False, "soften_drive": False}
"""A given chain has no phases in which joints soften."""


def simulate(
    parameters: Parameters | Preset,
    position: Array,
    velocity: Array,
    duration: Number,
    *,
    times: Sequence[Number] | Array | None = None,
    floor: Truth = True,
    gravity: Truth = True,
    self_contact: Truth = True,
    method: Method = "rkf78",
    tolerance: Number | None = None,
    device: str = "cpu",
    **settings: Unpack[OtherOptions],
) -> Trajectory:
    """Integrate a given chain, without sprocket.

    Args:
        parameters: Of the chain, or the name of a preset.
        position: (n, 3): x, y [m] and θ [rad] of each link's centre; n even, at least 4. Link i's right end meets
            link i + 1's left end, the last link's the first one's. Links 0, 2, … are inner ones.
        velocity: (n, 3): their rates [m/s, m/s, rad/s].
        duration: Simulated time [s], from time 0.
        times: Instants of the trajectory [s], rising, in [0, duration]; steps land on them exactly. Default: 101
            instants evenly spread.
        floor: Whether there is a floor at y = 0.
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
    chosen: dict[str, object] = {"method": method, "device": device, "self_contact": self_contact}
    if tolerance is not None:
        chosen["tolerance"] = tolerance
    floor, gravity = plain(floor, "floor"), plain(gravity, "gravity")
    end: float = plain(duration, "duration")
    options = validated(Options, {**_UNSOFTENED, **settings, **chosen}, "options")
    for name in _UNSOFTENED:
        if getattr(options, name):
            raise InputError(f"options.{name}: only a walk has phases in which joints soften; leave it out")
    for name, switch in (("floor", floor), ("gravity", gravity)):
        if not isinstance(switch, bool):
            raise InputError(f"{name}: {shown(switch)} is not a truth value; give True or False")
    chain = parameters if isinstance(parameters, Parameters) else preset(parameters)
    if not gravity:
        chain = chain.with_values({"gravity": 0.0})
    start, rates = _checked_state("position", position), _checked_state("velocity", velocity)
    if len(rates) != len(start):
        raise InputError(f"velocity: {len(rates)} rows, but position has {len(start)}; give one row per link each")
    if len(start) < 4 or len(start) % 2:
        raise InputError(f"position: {len(start)} links; a closed chain has an even number of at least 4")
    if len(start) > MOST_LINKS:
        raise InputError(f"position: {len(start)} links; give at most {MOST_LINKS}")
    check_links_on_gpu(len(start), options.device, "position")
    instants = _checked_times(end, times)
    if len(instants) * len(start) > MOST_PLACES:
        raise InputError(
            f"times: {len(instants)} instants of {len(start)} links are too many; "
            f"give at most {MOST_PLACES // len(start)}"
        )
    with gpu_turn([options.device]):
        return _follow(options, chain, start, rates, instants, end, bool(floor))


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
        method: Method = "explicit",
        device: str = "cpu",
        **settings: Unpack[OtherOptions],
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
        options = validated(Options, {"soften_drive": False, **settings, "method": method, "device": device}, "options")
        if options.soften_drive:
            raise InputError("options.soften_drive: there is no sprocket; leave it out")
        shape = (len(parameters), *np.shape(position)[1:2], 3)
        for name, given in (("position", position), ("velocity", velocity)):
            if np.shape(given) != shape or len(shape) != 3 or not np.all(np.isfinite(given)):
                raise InputError(f"{name}: its shape is {np.shape(given)}; give finite numbers of shape (W, n, 3)")
        worlds, links, _ = shape
        if worlds < 1 or links < 4 or links % 2:
            raise InputError(f"position: {worlds} chains of {links} links; give chains of an even number of at least 4")
        check_links_on_gpu(links, options.device, "position")
        self.time, self._links = 0.0, links
        with gpu_turn([options.device]):
            self._batch = Batch(worlds, links, options)
            for world, chain in enumerate(parameters):
                self._batch.set_chain(world, chain, links)
                self._batch.load(world, position[world], velocity[world], stop_time=0.0, stop_status=Status.FINISHED)
            self._features = self._batch.features(fixed_body="floor" if floor else "none")
            self._batch.run(range(worlds), self._features)

    @property
    def status(self) -> NDArray[np.int32]:
        """Codes of `Status`, (W,): FINISHED of a chain that can go on."""
        return self._batch.statuses().copy()

    def motions(self, chains: Sequence[int] | NDArray[np.integer[Any]] | None = None) -> tuple[Array, Array]:
        """Place and angle of the links of all chains, or of some numbers, (W, n, 3); and their rates."""
        return self._batch.motions(range(len(self.status)) if chains is None else list(chains), self._links)

    def set_velocity(self, chains: Sequence[int] | NDArray[np.integer[Any]], velocity: Array) -> None:
        """Give some chains, by their numbers, other velocities, (chains, n, 3)."""
        if len(chains):
            self._batch.set_velocities(list(chains), velocity)

    def run(
        self,
        until: float,
        chains: Sequence[int] | NDArray[np.integer[Any]] | None = None,
        *,
        to_rest: bool = False,
    ) -> None:
        """Carry on all chains that can go on, or those of some numbers.

        Args:
            until: Time [s].
            chains: Numbers of the chains; None: all.
            to_rest: Whether a chain that comes to rest on the floor stays there, AT_REST; others end with TIME_LIMIT.
        """
        status, wanted = self.status, range(len(self.status)) if chains is None else chains
        going = [int(world) for world in wanted if status[world] == Status.FINISHED]
        if going:
            with gpu_turn([self._batch.options.device]):
                self._batch.resume(going, until, Status.TIME_LIMIT if to_rest else Status.FINISHED)
                self._batch.run(going, self._features)
        self.time = until


def _follow(
    options: Options, chain: Parameters, start: Array, rates: Array, instants: Array, end: float, floor: bool
) -> Trajectory:
    """Integrate a chain whose values are checked, see `simulate`."""
    batch = Batch(1, len(start), options)
    batch.set_chain(0, chain, len(start))
    batch.load(0, start, rates, stop_time=instants[0], stop_status=Status.FINISHED)
    features = batch.features(fixed_body="floor" if floor else "none")
    reached, positions, velocities = [], [], []
    for instant in instants:
        batch.resume(0, instant, Status.FINISHED)
        batch.run([0], features)
        reached.append(batch.time(0))
        positions.append(batch.position(0))
        velocities.append(batch.velocity(0))
        if batch.status(0) != Status.FINISHED:
            break
    if batch.status(0) == Status.FINISHED and instants[-1] < end:
        batch.resume(0, end, Status.FINISHED)
        batch.run([0], features)
    counts, extremes, losses = batch.counts(0), batch.extremes(0), batch.losses(0)
    kinds = ("floor", "self")
    return Trajectory(
        status=batch.status(0),
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


def _checked_state(name: str, given: Array) -> Array:
    """Positions or velocities as a float64 array of shape (n, 3), or an `InputError`."""
    array = _real_array(name, given, "shape (n, 3)")
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name}: its shape is {array.shape}; give (n, 3), one row x, y, θ per link")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name}: holds a number that is not finite; give finite numbers")
    return array


def _checked_times(duration: float, times: Sequence[Number] | Array | None) -> Array:
    """Instants of a trajectory, which rise within the duration, or an `InputError`."""
    if isinstance(duration, bool) or not isinstance(duration, int | float):
        raise InputError(f"duration: {shown(duration)} is not a number; give seconds")
    if not 0 <= duration < LONGEST:
        raise InputError(f"duration: {shown(duration)} is not a time; give a number of seconds, at least 0")
    if times is None:
        return np.linspace(0.0, float(duration), 101)
    instants = _real_array("times", times, "rising instants in s")
    if instants.ndim != 1 or len(instants) == 0:
        raise InputError(f"times: its shape is {instants.shape}; give a row of at least one instant")
    if not np.all((instants >= 0) & (instants <= duration)) or np.any(np.diff(instants) <= 0):
        raise InputError(f"times: give rising instants between 0 and the duration of {duration} s")
    return instants


def _real_array(name: str, given: object, remedy: str) -> Array:
    """Anything like an array of real numbers as a new float64 array, or an `InputError`."""
    try:
        if np.array(given).dtype.kind in "cSU":  # complex numbers and text would be converted without a word
            raise TypeError
        return np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: not an array of numbers; give {remedy}") from None
