"""The stationary loop of a chain on its sprocket: what is kept of it, its mean shape and the forces in it.

Every joint follows the same path at the same speed. All joints in all frames are therefore samples of one periodic
function of q = i + o(t), where i is the number of the joint and o(t) the distance, in links, that the chain has moved.
Averages over frames at equal q are functions of the arc length s from the lowest point along the motion.

The loop runs clockwise. The tangent is t = (−cos φ, sin φ): its angle φ is measured clockwise, is 0 at the lowest point
and grows along the motion. n = (sin φ, cos φ) is the normal towards the inside, κ = φ' the curvature, positive where
the loop bends inwards. Force F and moment M are those of the part ahead on the part behind, M positive clockwise. With
the line density ρ and the speed v, effective tension and shear are the force less what turns the momentum of links of
length ℓ: T_e t + N n = F − ρ v² (t + ℓ²/12 t'').
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from warpchain.chain.link_values import mean_value
from warpchain.chain.setup import Setup
from warpchain.chain.softened_joints import SOFT
from warpchain.hdf5_files import Stored, dataset_of, stored_fields
from warpchain.inputs.arrays import Array
from warpchain.inputs.parameters import Parameters

if TYPE_CHECKING:
    import xarray

BEFORE_RELEASE: Final = "before_release"
"""Name of the motion before the release, among the arrays of a walk and in its file."""
FEWEST_FRAMES: Final = 8
"""Number of frames that an average needs."""
LEAST_WAY: Final = 4.0
"""Distance that the loop must move in all frames together [links]."""
POINTS_PER_LINK: Final = 24
"""Points of the mean curve per link, 0.5 mm apart."""
WHOLE_WAVES: Final = 5.0
"""Waves at least this long [links] are fully in the averages …"""
NO_WAVES: Final = 2.0
"""… and waves up to this long not at all: joints are a link apart, and the mean loop has corners at the sprocket."""
OFF_SPROCKET: Final = 5e-4
"""The loop is free where its joints are this much [m] farther from the centre than on the sprocket."""
KINK_REACH: Final = 0.35
"""Part of the free length, before and after the lowest point, in which the kink is searched for."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class BeforeRelease:
    """A chain of n links on its sprocket: t instants and f frames just before its release.

    Unit, meaning and shape stand beside each array. Coordinates are those of the walk, with the sprocket at its
    height at the release. Forces are F = k C + b dC/dt with the stiffness and damping that the joints had then: they
    may be softened. Moments are positive counter-clockwise. On the link after a joint both act with the opposite sign.
    """

    time: Annotated[Array, Stored("s", "time since the release, negative", "t")]
    center: Annotated[Array, Stored("m", "centre of mass x, y", "t 2")]
    center_velocity: Annotated[Array, Stored("m/s", "velocity of the centre of mass x, y", "t 2")]
    frame_time: Annotated[Array, Stored("s", "time of a frame since the release, negative", "f")]
    frame_joints: Annotated[
        Array,
        Stored("m", "joint positions x, y; joint i is at the end of link i, and even links are inner links", "f n 2"),
    ]
    frame_forces: Annotated[Array, Stored("N", "force x, y in each joint on the link that it ends", "f n 2")]
    frame_moments: Annotated[
        Array, Stored("N m", "friction moment that each joint exerts on the link that ends there", "f n")
    ]

    def __repr__(self) -> str:
        """One line."""
        span = -float(self.frame_time[0]) if len(self.frame_time) else 0.0
        return f"<BeforeRelease: {span:.3g} s, {len(self.time)} instants, {len(self.frame_time)} frames>"

    def to_xarray(self) -> "xarray.Dataset":
        """The arrays as a data set with named coordinates, units and meanings, as `WalkResult.to_xarray`."""
        return dataset_of(vars(self), LOOP_FIELDS)


LOOP_FIELDS: Final[dict[str, Stored]] = stored_fields(BeforeRelease)
"""Arrays of a `BeforeRelease`: name → unit, meaning and shape."""


class Kink(NamedTuple):
    """The greatest and the least curvature [1/m] near the lowest point, and their places s [m].

    The least, `dip`, is negative if the loop bulges; places are positive after the lowest point along the motion.
    """

    peak: float
    peak_at: float
    dip: float
    dip_at: float


@dataclass(frozen=True, eq=False, kw_only=True)
class StationaryLoop:
    """Mean shape and forces of the loop on the sprocket just before the release; `walk.mean_loop()` returns it.

    All quantities are functions of the arc length s at g points; their signs are those of the module's docstring.

    Attributes:
        parameters: parameters of the chain, with the friction smoothing that its joints had on the sprocket.
        density: ρ = m̄/ℓ, mass per length [kg/m].
        speed: v along the loop [m/s].
        length: length of the mean loop [m].
        radius: distance of joints on the sprocket from its centre [m].
        center: the sprocket's centre x, y [m], shape (2,).
        s: arc length from the lowest point along the motion [m], shape (g,), from about −length/2 to length/2.
        position: x, y [m], shape (g, 2).
        spread: standard deviation of the joints across the mean curve [m], shape (g,).
        angle: φ [rad], shape (g,).
        curvature: κ [1/m], shape (g,).
        bending: κ' [1/m²], shape (g,).
        tension: T = F · t [N], shape (g,).
        effective_tension: T_e [N], shape (g,).
        shear: N [N], shape (g,).
        moment: M [N m], shape (g,).
        free: where the free part begins and ends, s [m]: lift-off from the sprocket and touch-down.
    """

    parameters: Parameters
    density: float
    speed: float
    length: float
    radius: float
    center: Array
    s: Array
    position: Array
    spread: Array
    angle: Array
    curvature: Array
    bending: Array
    tension: Array
    effective_tension: Array
    shear: Array
    moment: Array
    free: tuple[float, float]

    @property
    def is_free(self) -> NDArray[np.bool_]:
        """Points of the free part, shape (g,)."""
        return np.asarray((self.s >= self.free[0]) & (self.s <= self.free[1]))

    @property
    def bottom_curvature(self) -> float:
        """κ at the lowest point [1/m]."""
        return float(np.interp(0.0, self.s, self.curvature))

    def kink(self) -> Kink:
        """The kink of the loop, beside its lowest point, where the curvature has its least value."""
        near = np.flatnonzero(np.abs(self.s) < KINK_REACH * (self.free[1] - self.free[0]))
        peak, dip = near[np.argmax(self.curvature[near])], near[np.argmin(self.curvature[near])]
        return Kink(*(float(values[at]) for at in (peak, dip) for values in (self.curvature, self.s)))


def average_loop(setup: Setup, before: BeforeRelease | None, center: Array | None) -> StationaryLoop:
    """The mean loop of a walk just before its release, given the sprocket's centre x, y [m] at the release, (2,).

    A `ValueError` says that the walk has no sprocket, or has kept nothing of that time or too little.
    """
    if not setup.has_drive:
        raise ValueError("walk: it began without a sprocket, so it has no loop on one; take one from its drive on")
    if center is None:
        raise ValueError("walk: it ended before its release; see its status, which says what to try")
    if before is None:
        raise ValueError("walk: nothing was kept of the time before its release; run it again with record_before")
    parameters = setup.parameters
    if setup.options.soften_drive:
        smoothing = max(parameters.friction_smoothing, SOFT.smoothing)
        parameters = parameters.with_values({"friction_smoothing": smoothing})
    mass = mean_value(setup.link_values.mass)
    return average_frames(before, parameters, mass, center, setup.joint_radius)


def average_frames(
    before: BeforeRelease, parameters: Parameters, mass: float, center: Array, radius: float
) -> StationaryLoop:
    """The mean loop of frames; a `ValueError` if they are too few, or if the loop does not run clockwise.

    Given are the mean mass m̄ of the links [kg], the sprocket's centre x, y [m], and how far from it joints ride [m].
    """
    joints = before.frame_joints - center
    frames, links = joints.shape[:2]
    if frames < FEWEST_FRAMES:
        raise ValueError(f"before_release: {frames} frames are too few for an average; keep {FEWEST_FRAMES} or more")
    # With X = x + i y = Σ c_m e^{2πi m q/n}, the harmonic m = −1 runs round clockwise; its phase in a frame is −2π o/n.
    turning = np.exp(2j * np.pi * np.arange(links) / links)
    turned = np.angle(np.mean((joints[..., 0] + 1j * joints[..., 1]) * turning, axis=1))
    moved = -np.unwrap(turned) * links / (2 * np.pi)  # o(t), until each frame [links]
    rate = float(np.polyfit(before.frame_time, moved, 1)[0])  # links a second
    if moved[-1] - moved[0] < LEAST_WAY:
        raise ValueError("before_release: expected a loop that circulates clockwise; use one that does")
    curve = _Harmonics(joints, moved)
    force = _Harmonics(before.frame_forces, moved).at(0)
    moment = -_Harmonics(before.frame_moments[..., None], moved).at(0)[:, 0]
    place, first, second, third = (curve.at(order) for order in range(4))
    per_q = np.hypot(*first.T)  # ds/dq [m]
    tangent = first / per_q[:, None]
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    curvature = np.sum(second * normal, axis=1) / per_q**2
    effective = force - mass * rate**2 * (first + third / 12)

    step = links / len(per_q)
    length = float(per_q.sum() * step)
    s = np.concatenate([[0.0], np.cumsum((per_q[1:] + per_q[:-1]) * step / 2)])
    bottom = int(np.argmin(place[:, 1]))
    lowest = s[bottom] - per_q[bottom] * first[bottom, 1] / second[bottom, 1]  # a step of Newton's to dy/dq = 0
    count = len(s) // 2 * 2
    grid = length * (np.arange(count) - count // 2) / count

    def on_grid(values: Array) -> Array:
        return np.interp(grid, s - lowest, values, period=length)

    off, along = joints - curve.at_joints(0, moved), curve.at_joints(1, moved)
    across = (off[..., 0] * along[..., 1] - off[..., 1] * along[..., 0]) / np.linalg.norm(along, axis=-1)
    functions = {
        "spread": np.sqrt(np.maximum(0.0, _Harmonics(across[..., None] ** 2, moved).at(0)[:, 0])),
        "curvature": curvature,
        "bending": (np.sum(third * normal, axis=1) - 3 * curvature * np.sum(first * second, axis=1)) / per_q**3,
        "tension": np.sum(force * tangent, axis=1),
        "effective_tension": np.sum(effective * tangent, axis=1),
        "shear": np.sum(effective * normal, axis=1),
        "moment": moment,
    }
    position = np.stack([on_grid(place[:, axis]) for axis in (0, 1)], axis=1)
    # The angle of t = (−cos φ, sin φ), near 0 in the middle of the arrays, where s = 0.
    angle = np.unwrap(np.arctan2(on_grid(tangent[:, 1]), -on_grid(tangent[:, 0])))
    return StationaryLoop(
        parameters=parameters,
        density=mass / parameters.link_length,
        speed=rate * parameters.link_length,
        length=length,
        radius=radius,
        center=np.asarray(center, dtype=np.float64),
        s=grid,
        position=position + center,
        angle=angle - 2 * np.pi * np.round(angle[count // 2] / (2 * np.pi)),
        free=_free_part(grid, np.hypot(*position.T), radius + OFF_SPROCKET),
        **{name: on_grid(values) for name, values in functions.items()},
    )


class _Harmonics:
    """The mean over frames of a quantity of the joints as a function of q, by its harmonics.

    The joints of a frame are samples one link apart, which give waves longer than two links exactly. Shorter waves add
    an error of phase 2π o(t) to them, which vanishes in the average over frames.
    """

    def __init__(self, values: Array, moved: Array) -> None:
        """Average values of shape (f, n, c) over f frames, until which the loop has `moved` [links], shape (f,)."""
        self._links = values.shape[1]
        self._waves = np.fft.rfftfreq(self._links)  # waves a link
        back = np.exp(-2j * np.pi * self._waves * moved[:, None])
        share = np.clip((1 / NO_WAVES - self._waves) / (1 / NO_WAVES - 1 / WHOLE_WAVES), 0.0, 1.0)
        kept = np.sin(np.pi / 2 * share) ** 2
        self._spectrum = np.mean(np.fft.rfft(values, axis=1) * back[..., None], axis=0) * kept[:, None]

    def at(self, order: int) -> Array:
        """The derivative of some order with respect to q, at POINTS_PER_LINK n even points from q = 0 on, (…, c)."""
        spectrum, points = self._spectrum * (2j * np.pi * self._waves[:, None]) ** order, POINTS_PER_LINK
        return np.asarray(points * np.fft.irfft(spectrum, points * self._links, axis=0))

    def at_joints(self, order: int, moved: Array) -> Array:
        """The same where the joints are in frames, until which the loop has moved (f,) [links], shape (f, n, c)."""
        factor = (2j * np.pi * self._waves) ** order * np.exp(2j * np.pi * self._waves * moved[:, None])
        return np.asarray(np.fft.irfft(self._spectrum * factor[..., None], self._links, axis=1))


def _free_part(s: Array, distance: Array, least: float) -> tuple[float, float]:
    """Both ends s [m] of the part round s = 0 whose distance from the sprocket's centre exceeds `least` [m].

    A `ValueError` says that there is no such part, or that it is the whole loop.
    """
    middle, touching = len(s) // 2, np.flatnonzero(distance <= least)
    before, after = touching[touching < middle], touching[touching > middle]
    if distance[middle] <= least or not len(before) or not len(after):
        raise ValueError("before_release: expected a loop that hangs on a sprocket; use one that does")
    return float(s[before[-1] + 1]), float(s[after[0] - 1])
