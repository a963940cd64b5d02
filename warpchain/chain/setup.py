"""The complete definition of one walk, `Setup`, and a chain at one instant, `State`.

Every walk is computed from a `Setup`: single walks make one from keywords, sweeps make one per sample, and a result
keeps the one that it was computed from. Users take a `State` from a walk, or make one of measurements.
"""

import hashlib
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpchain.chain.floor import Floor, circles_of, floor_from
from warpchain.chain.link_values import LinkValues, link_values
from warpchain.chain.outlines import fitted
from warpchain.chain.start_shapes import links_between
from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.compound_fields import FARTHEST
from warpchain.inputs.distributions import Distribution, Gaussian
from warpchain.inputs.fields import SECTION_OF
from warpchain.inputs.options import LONGEST_DRIVE_INTERVAL, Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import Scene, check_links_on_gpu
from warpchain.inputs.unit_slips import check_units
from warpchain.inputs.validation import InputError, InputWarning, shown, validated, with_numbers
from warpchain.kernels.methods.method import find_method

DEFAULT_PRESET: Final = "paper"
"""Preset of a walk or a sweep that names none."""
WIDEST_OPENING: Final = 0.1
"""Greatest distance of two joined link ends, in link lengths; a loop whose ends are farther apart is not closed."""
LEAST_SPROCKET: Final = 1e-3
"""Least distance of the joints from the sprocket's centre, in link lengths; far smaller ones are lost in rounding."""


FARTHEST_MOVED: Final = 0.02
"""Greatest distance by which fitting links of one length may move a given joint, in link lengths."""
FARTHEST_UNSAID: Final = 1e-3
"""Greatest such distance, in link lengths, of which no warning tells."""


@dataclass(frozen=True)
class Setup:
    """All values that define one walk, checked and complete; `walk(setup=…)` repeats the walk bit for bit.

    Users read it as `walk.setup`. `preset` names the preset that the parameters started from. Without a `start` the
    walk begins as the scene defines; with one, values of the scene before the release are those of the state's walk.
    Quantities that follow from these values alone, such as `loop_speed`, are properties.
    """

    preset: str
    parameters: Parameters
    scene: Scene
    options: Options
    start: "State | None" = None

    @property
    def sections(self) -> dict[str, dict[str, Any]]:
        """All fields by section and name."""
        return {name: getattr(self, name).model_dump() for name in ("parameters", "scene", "options")}

    @property
    def has_drive(self) -> bool:
        """Whether the walk begins on a sprocket."""
        return self.start is None and self.scene.is_on_sprocket

    @cached_property
    def link_values(self) -> LinkValues:
        """Masses, radii and friction of each link and joint."""
        own = link_values([self.scene], [self.parameters])
        return LinkValues(*(values[0] for values in vars(own).values()))

    @cached_property
    def floor(self) -> Floor:
        """The floor of the walk."""
        usual = self.parameters.floor_restitution, self.parameters.floor_friction
        return floor_from(self.scene.floor, self.scene.slope, usual)

    @property
    def settling_time(self) -> float:
        """Time [s] for which the chain settles on the sprocket before that turns; 0 unless it starts at rest."""
        if self.scene.start != "rest":
            return 0.0
        if self.scene.settle_time is not None:
            return self.scene.settle_time
        return 2.0 if self.scene.clearance_of == "hanging" else 0.1

    @property
    def riding_radius(self) -> float:
        """Height [m] of the joints above a surface that the chain rides on: half of them are at least so high."""
        if self.scene.link_radii is None and self.scene.charm_radius is None:
            return self.parameters.circle_radius
        return self._median_radius

    @cached_property
    def _median_radius(self) -> float:
        radius = self.link_values.radius
        return float(np.median(np.maximum(radius, np.roll(radius, -1))))

    @property
    def joint_radius(self) -> float:
        """Distance from the sprocket's centre at which the joints ride [m]."""
        if self.scene.sprocket_radius_is == "pitch":
            return self.parameters.sprocket_radius
        return self.parameters.sprocket_radius + self.riding_radius

    @property
    def contact_radius(self) -> float:
        """Radius of the sprocket that the circles of the links touch [m]."""
        if self.scene.sprocket_radius_is == "contact":
            return self.parameters.sprocket_radius
        return self.parameters.sprocket_radius - self.riding_radius

    @property
    def loop_speed(self) -> float:
        """Speed [m/s] along the loop of a chain that does not slip on its sprocket.

        Links on it are chords, each seen from the centre under 2 asin(ℓ / 2ρ), with ρ of `joint_radius`.
        """
        half = math.asin(min(1.0, self.parameters.link_length / (2 * self.joint_radius)))
        return math.pi * self.scene.frequency * self.parameters.link_length / half

    @property
    def fewest_links(self) -> int:
        """Least even number of links whose loop can hang round the sprocket.

        A link whose joints are both at least ρ, the `joint_radius`, from the centre is seen from there under an angle
        of at most 2 asin(ℓ / 2ρ), and a loop round the sprocket needs 2π in all: n ≥ π / asin(ℓ / 2ρ).
        """
        sine = self.parameters.link_length / (2 * self.joint_radius)
        around = math.ceil(math.pi / math.asin(sine)) if sine < 1 else 2
        return max(4, around + around % 2)

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
        limits = {"walk_limit", "stop_time", "distance_limit"}
        parts = [self.parameters.model_dump_json(), self.options.model_dump_json(exclude_defaults=True)]
        parts.append(self.scene.model_dump_json(exclude=limits, exclude_defaults=True))
        return np.frombuffer(hashlib.sha256("\n".join(parts).encode()).digest(), dtype=np.uint8)

    def with_drawn(self, drawn: Mapping[str, float]) -> "Setup":
        """A copy with drawn values of parameters and scene, if they make a possible walk; else an `InputError`."""
        sections: dict[str, dict[str, float]] = {"parameters": {}, "scene": {}}
        for name, value in drawn.items():
            sections[SECTION_OF[name]][name] = value
        parameters = with_numbers(self.parameters, sections["parameters"], "parameters")
        scene = with_numbers(self.scene, sections["scene"], "scene")
        return Setup(self.preset, parameters, scene, self.options, self.start).checked(asks_units=False)

    def placed(self, distributions: Mapping[str, Distribution]) -> dict[str, Distribution]:
        """The distributions with means and bounds for this chain.

        A Gaussian without a mean gets the chain's value. A link length must leave room for two circles of the widest
        link.
        """
        complete: dict[str, Distribution] = {}
        for name, distribution in distributions.items():
            if isinstance(distribution, Gaussian) and distribution.mean is None:
                value = getattr(getattr(self, SECTION_OF[name]), name)
                distribution = Gaussian(float(value), distribution.sigma, distribution.bounds)
            complete[name] = distribution
        if "link_length" in distributions and "circle_radius" not in distributions:
            widest = float(self.link_values.radius.max())
            room = math.nextafter(2 * widest, math.inf), math.inf
            complete["link_length"] = replace(complete["link_length"], bounds=room)
        return complete

    def checked(self, path: str = "scene.links", *, asks_units: bool = True) -> Self:
        """This setup, if its values do not contradict one another; else an `InputError`.

        Resolution and sweeps ask for it, of a state only its own checks. `path` is where the number of links was given.
        Drawn values are not asked about their units, since their distributions were, nor is a state, which has no
        options to insist with.
        """
        scene, options = self.scene, self.options
        if scene.plane == "tilting" and find_method(options.method).has_rigid_flight:
            raise InputError(
                f"options.method: {shown(options.method)} cannot tilt the plane; use explicit, or plane: fixed"
            )
        if self.start is None and asks_units and not options.unusual_values:
            check_units(vars(self.parameters), "parameters")
            check_units(vars(scene), "scene")
        self._check_links(path)
        if self.has_drive:
            self._check_drive()
        check_links_on_gpu(scene.links, options.device, path)
        return self

    def _check_links(self, path: str) -> None:
        """Check that links are longer than their circles are wide, and that links of two kinds are even in number."""
        scene, parameters = self.scene, self.parameters
        if scene.link_radii is not None or scene.charm_radius is not None:
            radii = self.link_values.radius
            if not radii.max() < (half := parameters.link_length / 2):
                field = "charm_radius" if scene.charm_radius == radii.max() else f"link_radii[{radii.argmax()}]"
                raise InputError(f"scene.{field}: expected less than half a link, {half}, got {radii.max()}; use less")
        inner, outer = parameters.inner_mass, parameters.outer_mass
        is_one_kind = (inner, parameters.inner_inertia) == (outer, parameters.outer_inertia)
        if scene.links % 2 and not is_one_kind and (scene.link_masses is None or scene.link_inertias is None):
            raise InputError(
                f"{path}: expected an even number, got {scene.links}; use one, or set link_masses and link_inertias"
            )

    def _check_drive(self) -> None:
        """Check that the chain can hang on its sprocket, leave it, and bear the loads there."""
        scene, parameters = self.scene, self.parameters
        radius = parameters.sprocket_radius
        if self.contact_radius <= 0:
            raise InputError(
                f"parameters.sprocket_radius: {radius} is too small for sprocket_radius_is: pitch; use more"
            )
        highest = scene.clearance + scene.links * parameters.link_length / 2  # of the sprocket's lowest point
        if scene.release and scene.is_level and (lowest := min(row[2] for row in scene.release)) < -highest:
            raise InputError(
                f"scene.release: expected y of at least {-highest:g} m, got {lowest:g} m; raise the sprocket"
            )
        if self.joint_radius < LEAST_SPROCKET * parameters.link_length:
            raise InputError(
                f"parameters.sprocket_radius: {radius} is negligible compared with a link; use more, or start: ellipse"
            )
        if scene.load_factor is not None:
            greatest = self.link_values.greatest_load(parameters.link_length)
            if scene.load_factor > greatest:
                problem = f"{scene.load_factor:g} is too much for links with such a small moment of inertia"
                raise InputError(f"scene.load_factor: {problem}; use at most {greatest:.6g}, or null")
        if scene.links < (fewest := self.fewest_links):
            raise InputError(
                f"scene.links: {scene.links} links do not reach around the sprocket; use at least {fewest}"
            )
        interval = self.options.record_interval
        if interval > LONGEST_DRIVE_INTERVAL and scene.load_factor != 1:
            raise InputError(
                f"options.record_interval: loads on the sprocket change at each, and {interval} s is too long for "
                f"that; use at most {LONGEST_DRIVE_INTERVAL} s, or scene.load_factor: 1"
            )


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class State:
    """A chain of n links at one instant, from which `walk(start=state)` and `simulate(state)` continue.

    `WalkResult.state` takes a state from a walk, `State.of_joints` makes one from measured joints, and `State.of_links`
    from any positions and velocities. `dataclasses.replace(state, velocity=1.001 * state.velocity)` perturbs it. A walk
    from an unchanged state continues its walk bit for bit. If position, velocity or plane were changed, the walk
    continues with the time, the softness of the joints, the counters and the events of the first walk, but with a new
    energy balance.

    Attributes:
        position: x, y [m] and θ [rad] of each link's centre of mass, shape (n, 3). The right end of link i meets the
            left end of link i + 1, and that of the last link meets link 0. Links 0, 2, … are inner links. If the plane
            tilts, x and y are coordinates in the plane. Δx and `distance_limit` are measured from x = 0.
        velocity: rates of change of `position` [m/s, m/s, rad/s], shape (n, 3).
        setup: setup of its walk: parameters of the chain, scene and options.
        time: time since the release [s]; 0 unless the state is that of a walk.
        origin: origin of the plane's coordinates in the laboratory frame [m], shape (3,); None if the plane is fixed.
        axes: directions of the plane's x and y in the laboratory frame, shape (2, 3); None if the plane is fixed.
        plane_rates: velocity of the plane's origin across the plane [m/s], and angular velocities of the plane about
            its x and y [rad/s], shape (3,); None if the plane is fixed.
        memory: further variables that a bitwise restart needs; only the package reads them.

    Raises:
        InputError: an array has another shape or values that are not finite, a position is more than 10 km away, or
            the loop is not closed.
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
                raise InputError(
                    f"{name}: expected at most {FARTHEST:g} m from the origin, got {far:.6g} m; check the unit"
                )
        if self.axes is not None and not np.allclose(self.axes @ self.axes.T, np.eye(2), atol=1e-9):
            raise InputError("axes: expected two perpendicular unit vectors; correct them")
        clock = float(self.memory.get("state/time", 0.0))
        if self.time != clock:
            raise InputError(f"time: expected the time of its walk, {clock:g} s, got {self.time!r}; use the former")
        left, right = np.split(circles_of(self.position, self.parameters.link_length), 2)
        opening = np.linalg.norm(np.roll(left, -1, axis=0) - right, axis=1)
        if (widest := float(opening.max())) > WIDEST_OPENING * self.parameters.link_length:
            link = int(opening.argmax())
            raise InputError(
                f"position: the loop is not closed: the ends of links {link} and {(link + 1) % self.links} are "
                f"{widest:.3g} m apart, and links are {self.parameters.link_length:g} m long; let links meet"
            )

    def __repr__(self) -> str:
        """One line."""
        return f"<State of {self.links} links at {self.time:.6g} s>"

    @classmethod
    def of_links(
        cls, position: ArrayLike | None, velocity: ArrayLike | None, parameters: Parameters | str = DEFAULT_PRESET
    ) -> "State":
        """Make a state from the positions and velocities of all links.

        Args:
            position: x, y [m] and θ [rad] of each link, shape (n, 3), as described for the class; n is at least 4, and
                even unless inner and outer links are equal.
            velocity: rates of change of `position`, shape (n, 3).
            parameters: physical parameters of the chain, or the name of a preset.

        Raises:
            InputError: the number of links is refused, or an array, as described for the class.
        """
        places = checked_array(position, "position", "n", 3)
        rates = checked_array(velocity, "velocity", len(places), 3)
        return cls(position=places, velocity=rates, setup=_setup(len(places), parameters, "position"))

    @classmethod
    def of_joints(
        cls, joints: ArrayLike, velocity: ArrayLike | None = None, parameters: Parameters | str = DEFAULT_PRESET
    ) -> "State":
        """Make a state from measured joints, which are moved as little as possible to fit links of one length.

        Args:
            joints: x and y of each joint in order around the loop [m], shape (n, 2); joint i is at the end of link i,
                and links 0, 2, … are inner links. y = 0 is the floor. n is at least 4, and even unless inner and outer
                links are equal.
            velocity: velocities of the joints [m/s], shape (n, 2); None: at rest.
            parameters: physical parameters of the chain, or the name of a preset.

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
        near, rates = fitted(places, rates, length)
        moved = np.linalg.norm(near - places, axis=1) / length
        text = f"joints: to fit links of {length:g} m joint {moved.argmax()} moves by {moved.max():.2%} of a link"
        if moved.max() > FARTHEST_MOVED:
            raise InputError(f"{text}, more than {FARTHEST_MOVED:.0%}; measure joints or link_length more exactly")
        if moved.max() > FARTHEST_UNSAID:
            warnings.warn(f"{text} (mean {moved.mean():.2%}); the walk begins from there", InputWarning, stacklevel=2)
        position, rate = links_between(near, rates)
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
        """x and y of the joint at the end of each link [m], shape (n, 2); if the plane tilts, in its coordinates."""
        return circles_of(self.position, self.parameters.link_length)[self.links :]


def _setup(links: int, parameters: Parameters | str, field_name: str) -> Setup:
    """The setup of a chain that no sprocket has moved."""
    name = DEFAULT_PRESET if isinstance(parameters, Parameters) else parameters
    chain = parameters if isinstance(parameters, Parameters) else preset(parameters)
    scene = validated(Scene, {"links": links, "frequency": 0.0, "start": "ellipse"}, field_name)
    return Setup(name, chain, scene, Options()).checked(field_name, asks_units=False)
