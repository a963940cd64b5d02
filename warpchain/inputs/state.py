"""What one walk is: its `Setup`, and the `State` of a chain that it may begin from."""

import hashlib
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.floor import FARTHEST, Floor, circles_of, floor_from
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import Scene, check_parity, check_scene
from warpchain.inputs.start_shapes import links_between
from warpchain.inputs.validation import SECTION_OF, InputError, InputWarning, validated

DEFAULT_PRESET: Final = "paper"
"""Preset of a walk or a sweep that names none."""
WIDEST_OPENING: Final = 0.1
"""Greatest distance of two joined link ends, in link lengths; a loop whose ends are farther apart is not closed."""
WIDEST_MISFIT: Final = 0.5
"""Greatest difference of the distance of two given joints from a link length, in link lengths."""


FARTHEST_MOVED: Final = 0.02
"""Greatest distance by which fitting links of one length may move a given joint, in link lengths."""
FARTHEST_UNSAID: Final = 1e-3
"""Greatest such distance, in link lengths, of which no warning tells."""


@dataclass(frozen=True)
class Setup:
    """Everything that says what one walk is, checked and complete.

    `preset` is the name of the one that the parameters started from. Without a `start` the walk begins as the scene
    says; with one, the scene has values that matter before the release from the walk that the state was taken from.
    """

    preset: str
    parameters: Parameters
    scene: Scene
    options: Options
    start: "State | None" = None

    @property
    def has_drive(self) -> bool:
        """Whether the walk begins on a sprocket."""
        return self.start is None and self.scene.start != "ellipse"

    @property
    def floor(self) -> Floor:
        """The floor of the walk."""
        usual = self.parameters.floor_restitution, self.parameters.floor_friction
        return floor_from(self.scene.floor, self.scene.slope, usual)

    @property
    def described(self) -> str:
        """The chain and how it was spun, in a few words."""
        links, start = f"{self.scene.links} links", self.start
        if start is not None and not start.memory:
            return f"{links} from a given state"
        spun = f"{links} at {self.scene.frequency:g} Hz"
        return spun if start is None else f"{spun}, from its state at {start.time:.4g} s"

    @property
    def fingerprint(self) -> NDArray[np.uint8]:
        """What tells setups apart that would carry one state on in different ways, as bytes; its limits do not."""
        limits = {"walk_limit", "walk_until", "distance_limit"}
        parts = [self.parameters.model_dump_json(), self.options.model_dump_json(exclude_defaults=True)]
        parts.append(self.scene.model_dump_json(exclude=limits, exclude_defaults=True))
        return np.frombuffer(hashlib.sha256("\n".join(parts).encode()).digest(), dtype=np.uint8)

    def with_drawn(self, drawn: Mapping[str, float]) -> "Setup":
        """A copy with drawn values of parameters and scene, if they make a possible walk; else an `InputError`."""
        sections: dict[str, dict[str, float]] = {"parameters": {}, "scene": {}}
        for name, value in drawn.items():
            sections[SECTION_OF[name]][name] = value
        parameters = validated(Parameters, {**vars(self.parameters), **sections["parameters"]}, "parameters")
        scene = validated(Scene, {**vars(self.scene), **sections["scene"]}, "scene")
        check_scene(scene, parameters)
        return replace(self, parameters=parameters, scene=scene)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class State:
    """A chain of n links at one instant, which `walk(start=…)` and `simulate` go on from.

    `WalkResult.state` takes one from a walk, `State.of_joints` makes one of a measured outline, `State.of_links` of any
    motion. `dataclasses.replace(state, velocity=1.001 * state.velocity)` is a perturbed one. While nothing is changed
    the walk that begins from it is the rest of the first one to the bit. With another position, velocity or plane the
    chain goes on with the clock, the softness of the joints, the counters and the noted events of its walk; its energy
    ledger begins anew.

    Attributes:
        position: x, y [m] and θ [rad] of each link's centre, (n, 3). Link i's right end meets link i + 1's left end,
            the last link's the first one's. Links 0, 2, … are inner ones. If the plane tilts, places are in the plane.
            Δx and `distance_limit` count from x = 0.
        velocity: their rates [m/s, m/s, rad/s], (n, 3).
        setup: of its walk: parameters of the chain, scene, options.
        time: since the release [s]; 0 unless it is a state of a walk.
        origin: origin of the plane's coordinates in the room [m], (3,); None if the plane is fixed, like the next two.
        axes: directions of x and y of the plane in the room, (2, 3).
        plane_rates: speed [m/s] across the plane at its origin, and its turning rates [rad/s] about x and y, (3,).
        memory: what else the walk had at that instant; only the package reads it.

    Raises:
        InputError: an array has another shape, holds no finite numbers or places more than 10 km away, or the loop is
            not closed.
    """

    position: Array
    velocity: Array
    setup: Setup
    time: float = 0.0
    origin: Array | None = None
    axes: Array | None = None
    plane_rates: Array | None = None
    memory: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the arrays, and that the loop is closed."""
        shapes: dict[str, tuple[int, ...]] = {"position": (self.links, 3), "velocity": (self.links, 3)}
        if self.setup.scene.plane == "tilting":
            shapes |= {"origin": (3,), "axes": (2, 3), "plane_rates": (3,)}
        for name, shape in shapes.items():
            object.__setattr__(self, name, checked_array(getattr(self, name), name, *shape))
        for name in ("position", "origin") if self.origin is not None else ("position",):
            if (far := float(np.abs(getattr(self, name)[..., :2]).max())) > FARTHEST:
                raise InputError(f"{name}: a place {far:.6g} m from the origin; expected at most {FARTHEST:g} m, in m")
        if self.axes is not None and not np.allclose(self.axes @ self.axes.T, np.eye(2), atol=1e-9):
            raise InputError("axes: not two directions at right angles; give unit vectors")
        clock = float(self.memory.get("state/time", 0.0))
        if self.time != clock:
            raise InputError(f"time: {self.time!r} s is not that of its walk; give {clock:g}")
        left, right = np.split(circles_of(self.position, self.parameters.link_length), 2)
        opening = np.linalg.norm(np.roll(left, -1, axis=0) - right, axis=1)
        if (widest := float(opening.max())) > WIDEST_OPENING * self.parameters.link_length:
            link = int(opening.argmax())
            raise InputError(
                f"position: the loop is not closed: the ends of links {link} and {(link + 1) % self.links} are "
                f"{widest:.3g} m apart, and links are {self.parameters.link_length:g} m long; give links that join"
            )

    def __repr__(self) -> str:
        """One line."""
        return f"<State of {self.links} links at {self.time:.6g} s>"

    @classmethod
    def of_links(
        cls, position: ArrayLike | None, velocity: ArrayLike | None, parameters: Parameters | str = DEFAULT_PRESET
    ) -> "State":
        """The state of links whose centres, angles and rates are known, see the attributes.

        Args:
            position: (n, 3); n at least 4, and even unless inner and outer links are equal.
            velocity: (n, 3).
            parameters: of the chain, or the name of a preset.

        Raises:
            InputError: as of the class; or the number of links is refused.
        """
        places = checked_array(position, "position", "n", 3)
        rates = checked_array(velocity, "velocity", len(places), 3)
        return cls(position=places, velocity=rates, setup=_setup(len(places), parameters, "position"))

    @classmethod
    def of_joints(
        cls, joints: ArrayLike, velocity: ArrayLike | None = None, parameters: Parameters | str = DEFAULT_PRESET
    ) -> "State":
        """The state of a chain whose joints were measured; they move as little as fits links of one length.

        Args:
            joints: x, y of each joint in order around the loop [m], (n, 2); joint i ends link i, and links 0, 2, … are
                inner ones. y = 0 is the floor. n is at least 4, and even unless inner and outer links are equal.
            velocity: their rates [m/s], (n, 2); None: at rest.
            parameters: of the chain, or the name of a preset.

        Raises:
            InputError: two neighbours are not about a link length apart: the loop is not closed, or lengths are in
                another unit; a joint would have to move by more than 2 % of a link length; or an array or the number
                of links is refused.

        An `InputWarning` says how far the joints moved if one of them moved by more than 0.1 % of a link length.
        """
        places = checked_array(joints, "joints", "n", 2)
        rates = np.zeros_like(places) if velocity is None else checked_array(velocity, "velocity", *places.shape)
        setup = _setup(len(places), parameters, "joints")
        length = setup.parameters.link_length
        fitted, rates = _fitted(places, rates, length)
        moved = np.linalg.norm(fitted - places, axis=1) / length
        text = f"joints: to fit links of {length:g} m joint {moved.argmax()} moves by {moved.max():.2%} of a link"
        if moved.max() > FARTHEST_MOVED:
            raise InputError(f"{text}, more than {FARTHEST_MOVED:.0%}; measure joints or link_length more exactly")
        if moved.max() > FARTHEST_UNSAID:
            warnings.warn(f"{text} (mean {moved.mean():.2%}); the walk begins from there", InputWarning, stacklevel=2)
        position, rate = links_between(fitted, rates)
        return cls(position=position, velocity=rate, setup=setup)

    @property
    def links(self) -> int:
        """Number of links n."""
        return self.setup.scene.links

    def is_placed_as_in(self, setup: Setup) -> bool:
        """Whether it is where its walk had it, and a setup would carry it on as that walk did."""
        memory = self.memory
        return (
            "setup" in memory
            and np.array_equal(memory["setup"], setup.fingerprint)
            and np.array_equal(memory["state/links"][:3, : self.links].T, self.position)
        )

    @property
    def parameters(self) -> Parameters:
        """Physical parameters of the chain and the floor."""
        return self.setup.parameters

    @property
    def joints(self) -> Array:
        """Joints x, y [m], (n, 2), as the end of link i; if the plane tilts, in the plane."""
        return circles_of(self.position, self.parameters.link_length)[self.links :]


def _setup(links: int, parameters: Parameters | str, field_name: str) -> Setup:
    """The setup of a chain that no sprocket has moved."""
    name = DEFAULT_PRESET if isinstance(parameters, Parameters) else parameters
    chain = parameters if isinstance(parameters, Parameters) else preset(parameters)
    scene = validated(Scene, {"links": links, "frequency": 0.0, "start": "ellipse"}, field_name)
    check_parity(scene, chain, field_name)
    return Setup(name, chain, scene, Options())


def _fitted(joints: Array, rates: Array, length: float) -> tuple[Array, Array]:
    """Joints that are a link length apart, and their rates that keep it so, near given ones; both (n, 2)."""
    n = len(joints)
    apart = np.linalg.norm(joints - np.roll(joints, 1, axis=0), axis=1)
    worst = int(np.abs(apart - length).argmax())
    if abs(apart[worst] - length) > WIDEST_MISFIT * length:
        raise InputError(
            f"joints: the loop is not closed, or lengths are not in m: joints {(worst - 1) % n} and {worst} are "
            f"{apart[worst]:.3g} m apart, and links are {length:g} m long; give every joint, in order"
        )
    places = joints.copy()
    for _ in range(50):
        span = places - np.roll(places, 1, axis=0)
        misfit = (np.sum(span**2, axis=1) - length**2) / 2
        if np.abs(misfit).max() <= 1e-13 * length**2:
            return places, rates - _pull(span, np.sum(span * (rates - np.roll(rates, 1, axis=0)), axis=1))
        places -= _pull(span, misfit)
    raise InputError(f"joints: no closed chain of {n} links of {length:g} m lies near them; measure them anew")


def _pull(span: Array, change: Array) -> Array:
    """The least motion of the joints, (n, 2), that changes half the squares of the spans by so much, (n,)."""
    n = len(span)
    rates = np.zeros((n, n, 2))  # of each half square by each joint
    rates[np.arange(n), np.arange(n)] = span
    rates[np.arange(n), np.arange(n) - 1] -= span
    least = np.linalg.lstsq(rates.reshape(n, 2 * n), change)[0]
    return np.asarray(least, dtype=np.float64).reshape(n, 2)
