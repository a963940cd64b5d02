"""The loop of a chain that runs stationarily on its sprocket: its mean shape, what it carries, whether that balances.

In a stationary loop every joint follows the same path at the same speed. Frames of all joints are therefore samples of
one periodic function of q = i + o(t), where i is the joint's number and o(t), in links, how far the chain has moved on;
o(t) is read off each frame, from the phase of its first harmonic. Averages over frames at equal q are averages in the
frame of the room. They are made into functions of the arc length s, measured along the motion from the lowest point.

Signs. The loop runs clockwise: down on the right of the sprocket, along the bottom to the left, up again. The angle φ
of its tangent is measured from there, clockwise: t = (−cos φ, sin φ), so that it is 0 at the lowest point and grows
along the motion. n = (sin φ, cos φ) is the normal towards the inside, κ = φ' the curvature, positive where the loop
bends inwards. Force and moment are those of the part ahead on the part behind, the moment positive where it turns
clockwise.

Balances. With the line density ρ = m̄/ℓ and the speed v, tension and shear are counted less what bends the momentum
round the curve,

    T_e t + N n = F − ρ v² (t + ℓ²/12 t''),

the second term because rigid links cut the corners: F_{i+1} − F_i = m (dV/dt + g ŷ) for plane waves e^{iκ q} that stand
still, with (κ/2) cot(κ/2) = 1 − κ²/12 expanded. Then, to order ℓ²,

    (T_e t + N n)' = ρ g ŷ        M' + N = j v² κ'        j = (Ī − m̄ ℓ²/6) / ℓ.

The links' own inertia resists being turned; their length does the opposite.
"""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import joint_radius
from warpchain.inputs.setup import Setup
from warpchain.loop.before_release import BeforeRelease

Array = NDArray[np.float64]

FEWEST_FRAMES: Final = 8
"""Fewer frames make no average."""
LEAST_WAY: Final = 4.0
"""Nor do frames in which the loop has moved on by fewer links."""
POINTS_PER_LINK: Final = 6
"""Points of the mean curve in a link's length."""
WHOLE_WAVES: Final = 5.0
"""Waves of so many links and more are in the averages whole …"""
NO_WAVES: Final = 2.0
"""… and of so many and less not at all: joints are a link apart, and the mean loop has corners at the sprocket."""
OFF_SPROCKET: Final = 5e-4
"""The loop is free where its joints ride this much [m] farther out than on the sprocket."""
EDGE: Final = 4.0
"""So many links at both ends of the free part are no part of a check of balances: averages mix in what touches."""
KINK_REACH: Final = 0.35
"""Part of the free length, before and after the lowest point, in which the kink is looked for."""


@dataclass(frozen=True, kw_only=True)
class LoopParameters:
    """What the balances of a loop need to know of its chain.

    Attributes:
        link_length: ℓ [m].
        density: ρ = m̄/ℓ, mass per length [kg/m].
        inertia: j = (Ī − m̄ ℓ²/6)/ℓ [kg m], see above; may be negative.
        gravity: g [m/s²].
        viscous_friction: β of a joint [N m s].
        coulomb_friction: τ_c of a joint [N m].
        friction_smoothing: ω_c of a joint [rad/s], as it was on the sprocket.
    """

    link_length: float
    density: float
    inertia: float
    gravity: float
    viscous_friction: float
    coulomb_friction: float
    friction_smoothing: float

    def moment(self, spin: Array) -> Array:
        """Friction moment f(w) = β w + τ_c tanh(w / ω_c) [N m] of a joint that turns at w [rad/s]."""
        stick = self.coulomb_friction * np.tanh(spin / self.friction_smoothing)
        moment: Array = self.viscous_friction * spin + stick
        return moment

    @classmethod
    def of(cls, parameters: Parameters, friction_smoothing: float | None = None) -> "LoopParameters":
        """Those of a chain; `friction_smoothing` may be another than its own."""
        mass = (parameters.inner_mass + parameters.outer_mass) / 2
        inertia = (parameters.inner_inertia + parameters.outer_inertia) / 2
        length = parameters.link_length
        return cls(
            link_length=length,
            density=mass / length,
            inertia=(inertia - mass * length**2 / 6) / length,
            gravity=parameters.gravity,
            viscous_friction=parameters.viscous_friction,
            coulomb_friction=parameters.coulomb_friction,
            friction_smoothing=friction_smoothing or parameters.friction_smoothing,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class StationaryLoop:
    """The mean loop, as functions of the arc length s at g points; signs as above.

    Attributes:
        parameters: of the chain.
        speed: v along the loop [m/s].
        length: of the mean loop [m].
        radius: distance of the joints from the sprocket's centre where they lie on it [m].
        center: the sprocket's centre x, y [m], shape (2,).
        s: arc length from the lowest point along the motion [m], shape (g,), from about −length/2 to length/2.
        position: x, y [m], shape (g, 2).
        spread: standard deviation of joints from the mean curve, across it [m], shape (g,).
        angle: φ [rad], shape (g,).
        curvature: κ [1/m], shape (g,).
        bending: κ' [1/m²], shape (g,).
        tension: T [N], the whole of it, shape (g,).
        effective_tension: T_e [N], shape (g,).
        shear: N [N], shape (g,).
        moment: M [N m], shape (g,).
        free: where the free part begins and ends, s [m]: lift-off from the sprocket and touch-down.
    """

    parameters: LoopParameters
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
        inside: NDArray[np.bool_] = (self.s >= self.free[0]) & (self.s <= self.free[1])
        return inside

    @property
    def bottom_curvature(self) -> float:
        """κ at the lowest point [1/m]."""
        return float(np.interp(0.0, self.s, self.curvature))


@dataclass(frozen=True, kw_only=True)  # frozen: its attributes are only read
class HeldWalk(Protocol):
    """What a mean loop needs of a walk, whichever class holds it.

    Attributes:
        setup: parameters, scene and options.
        sprocket_center: centre of the sprocket x, y at the release [m], shape (2,); None without one.
        before_release: the motion on the sprocket just before the release; None if it was not kept.
    """

    setup: Setup
    sprocket_center: Array | None
    before_release: BeforeRelease | None


def average_loop(walk: HeldWalk) -> StationaryLoop:
    """The mean loop of a walk in the last moments before its release.

    Raises:
        ValueError: the walk has kept nothing of that time, or too little.
    """
    before, setup = walk.before_release, walk.setup
    if before is None or walk.sprocket_center is None:
        raise ValueError("walk: nothing was kept of the time before its release; run it again with record_before")
    smoothing = setup.parameters.friction_smoothing
    if setup.options.soften_drive:
        smoothing = max(smoothing, preset("soft").friction_smoothing)  # of joints that are softened on the sprocket
    parameters = LoopParameters.of(setup.parameters, smoothing)
    return average_frames(before, parameters, walk.sprocket_center, joint_radius(setup.scene, setup.parameters))


def average_frames(before: BeforeRelease, parameters: LoopParameters, center: Array, radius: float) -> StationaryLoop:
    """The mean loop of frames.

    Args:
        before: frames of a loop that runs clockwise.
        parameters: of its chain.
        center: the sprocket's centre x, y [m].
        radius: distance of the joints from it where they lie on the sprocket [m].

    Raises:
        ValueError: there are too few frames, or the loop does not run clockwise.
    """
    joints = before.frame_joints - center
    frames, links = joints.shape[:2]
    if frames < FEWEST_FRAMES:
        raise ValueError(f"before_release: {frames} frames are too few for an average; keep {FEWEST_FRAMES} or more")
    moved = _moved(joints)
    rate = float(np.polyfit(before.frame_time, moved, 1)[0])  # links a second
    if moved[-1] - moved[0] < LEAST_WAY:
        raise ValueError("before_release: the loop does not run clockwise, or hardly moves; give one that runs")
    curve = _Harmonics(joints, moved)
    force = _Harmonics(before.frame_forces, moved).at(0)
    moment = -_Harmonics(before.frame_moments[..., None], moved).at(0)[:, 0]
    place, first, second, third = (curve.at(order) for order in range(4))
    per_q = np.hypot(*first.T)  # ds/dq [m]
    tangent = first / per_q[:, None]
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    curvature = np.sum(second * normal, axis=1) / per_q**2
    bending = periodic_slope(curvature, links) / per_q
    mass = parameters.density * parameters.link_length
    effective = force - mass * rate**2 * (first + third / 12)

    step = links / len(per_q)
    length = float(per_q.sum() * step)
    s = np.concatenate([[0.0], np.cumsum((per_q[1:] + per_q[:-1]) * step / 2)])
    lowest, _ = _vertex(s, place[:, 1], int(np.argmin(place[:, 1])), length)
    count = len(s) // 2 * 2
    grid = length * (np.arange(count) - count // 2) / count

    def on_grid(values: Array) -> Array:
        return np.interp(grid, s - lowest, values, period=length)

    position = np.stack([on_grid(place[:, axis]) for axis in (0, 1)], axis=1)
    return StationaryLoop(
        parameters=parameters,
        speed=rate * parameters.link_length,
        length=length,
        radius=radius,
        center=np.asarray(center, dtype=np.float64),
        s=grid,
        position=position + center,
        spread=on_grid(_spread(joints, moved, curve.at(0, 8 * POINTS_PER_LINK), normal)),
        angle=_angle(on_grid(tangent[:, 0]), on_grid(tangent[:, 1])),
        curvature=on_grid(curvature),
        bending=on_grid(bending),
        tension=on_grid(np.sum(force * tangent, axis=1)),
        effective_tension=on_grid(np.sum(effective * tangent, axis=1)),
        shear=on_grid(np.sum(effective * normal, axis=1)),
        moment=on_grid(moment),
        free=_free_part(grid, np.hypot(*position.T), radius + OFF_SPROCKET),
    )


@dataclass(frozen=True)
class Kink:
    """Where the curvature overshoots.

    Attributes:
        peak: greatest curvature near the lowest point [1/m] …
        peak_at: … and where it is, s [m].
        dip: least curvature on the side of the kink [1/m], negative if the loop bulges …
        dip_at: … and where it is, s [m]: after the lowest point along the motion where positive.
        opposite_dip: least curvature as far on the other side of the lowest point [1/m].
    """

    peak: float
    peak_at: float
    dip: float
    dip_at: float
    opposite_dip: float


def find_kink(loop: StationaryLoop) -> Kink:
    """The kink of a loop: on one side of the lowest point its curvature swings below zero before it settles."""
    reach = KINK_REACH * (loop.free[1] - loop.free[0])
    before = np.flatnonzero((loop.s > -reach) & (loop.s < 0))
    after = np.flatnonzero((loop.s > 0) & (loop.s < reach))
    near = np.concatenate([before, after])
    peak_at, peak = _vertex(loop.s, loop.curvature, int(near[np.argmax(loop.curvature[near])]))
    dips = [_vertex(loop.s, loop.curvature, int(side[np.argmin(loop.curvature[side])])) for side in (before, after)]
    (dip_at, dip), (_, opposite) = sorted(dips, key=lambda place: place[1])
    return Kink(peak=peak, peak_at=peak_at, dip=dip, dip_at=dip_at, opposite_dip=opposite)


@dataclass(frozen=True)
class Imbalance:
    """What is left of a balance, relative to the greatest of its terms: root mean square and greatest value."""

    rms: float
    greatest: float


def imbalances(loop: StationaryLoop) -> dict[str, Imbalance]:
    """How well the balances of the mean loop close on its free part, but for its ends.

    Keys: `force` compares (T_e t + N n)(s) with what it is at the lowest point and the weight in between, ρ g ŷ s;
    `normal` is N' + T_e κ − ρ g cos φ; `moment` is M' + N − j v² κ'; `friction` compares M with f(ℓ v κ'), the moment
    of joints that all turn as the mean curve does.
    """
    p, edge = loop.parameters, EDGE * loop.parameters.link_length
    inside = (loop.s > loop.free[0] + edge) & (loop.s < loop.free[1] - edge)
    step = loop.length / len(loop.s)
    tangent = np.stack([-np.cos(loop.angle), np.sin(loop.angle)], axis=1)
    normal = np.stack([np.sin(loop.angle), np.cos(loop.angle)], axis=1)
    force = loop.effective_tension[:, None] * tangent + loop.shear[:, None] * normal
    bottom = np.array([np.interp(0.0, loop.s, force[:, axis]) for axis in (0, 1)])
    weight = np.stack([np.zeros_like(loop.s), p.density * p.gravity * loop.s], axis=1)
    shear_slope, moment_slope = (periodic_slope(values, len(values)) / step for values in (loop.shear, loop.moment))
    bend, across = loop.effective_tension * loop.curvature, p.density * p.gravity * np.cos(loop.angle)
    turned = p.inertia * loop.speed**2 * loop.bending
    expected = p.moment(p.link_length * loop.speed * loop.bending)
    terms = {
        "force": (np.hypot(*(force - bottom - weight).T), [np.hypot(*force.T)]),
        "normal": (shear_slope + bend - across, [shear_slope, bend, across]),
        "moment": (moment_slope + loop.shear - turned, [moment_slope, loop.shear, turned]),
        "friction": (loop.moment - expected, [loop.moment]),
    }
    found = {}
    for name, (rest, parts) in terms.items():
        scale = max(float(np.max(np.abs(part[inside]))) for part in parts)
        share = np.abs(rest[inside]) / scale
        found[name] = Imbalance(rms=float(np.sqrt(np.mean(share**2))), greatest=float(share.max()))
    return found


def periodic_slope(values: Array, period: float) -> Array:
    """Derivative of a periodic function, sampled evenly over one period, shape (g,) or (g, c)."""
    waves = 2j * np.pi * np.fft.rfftfreq(len(values), period / len(values))
    if len(values) % 2 == 0:
        waves[-1] = 0.0
    spectrum = np.fft.rfft(values, axis=0) * waves.reshape(-1, *[1] * (values.ndim - 1))
    slope: Array = np.fft.irfft(spectrum, len(values), axis=0)
    return slope


def _moved(joints: Array) -> Array:
    """How far the loop has moved on in each frame, o(t) in links, (f,).

    Of X(q) = Σ c_m e^{2πi m q/n}, x + i y taken together, the harmonic m = −1 is what makes the loop go round
    clockwise; in the joints i of a frame its phase is −2π o/n.
    """
    links = joints.shape[1]
    turning = np.exp(2j * np.pi * np.arange(links) / links)
    first = np.mean((joints[..., 0] + 1j * joints[..., 1]) * turning, axis=1)
    moved: Array = -np.unwrap(np.angle(first)) * links / (2 * np.pi)
    return moved


class _Harmonics:
    """The mean over frames of a quantity of the joints as a function of q, by its harmonics.

    The joints of a frame are samples a link apart, and give the harmonics of less than half a wave a link exactly. What
    shorter waves would add has the phase 2π o(t), and goes as frames are averaged.
    """

    def __init__(self, values: Array, moved: Array) -> None:
        """Average values (f, n, c) of frames in which the loop has moved on by (f,) links."""
        self._links = values.shape[1]
        self._waves = np.fft.rfftfreq(self._links)  # waves a link
        back = np.exp(-2j * np.pi * self._waves * moved[:, None])
        share = np.clip((1 / NO_WAVES - self._waves) / (1 / NO_WAVES - 1 / WHOLE_WAVES), 0.0, 1.0)
        kept = np.sin(np.pi / 2 * share) ** 2
        self._spectrum = np.mean(np.fft.rfft(values, axis=1) * back[..., None], axis=0) * kept[:, None]

    def at(self, order: int, points: int = POINTS_PER_LINK) -> Array:
        """A derivative with respect to q at so many points in a link, q = 0, 1/points …, (points n, c)."""
        factor = (2j * np.pi * self._waves[:, None]) ** order
        values: Array = points * np.fft.irfft(self._spectrum * factor, points * self._links, axis=0)
        return values


def _spread(joints: Array, moved: Array, place: Array, normal: Array) -> Array:
    """Standard deviation of joints across the mean curve [m], at the points of its normals, (POINTS_PER_LINK n,)."""
    links = joints.shape[1]
    q = (np.arange(links) + moved[:, None]) % links

    def at_joints(values: Array) -> Array:
        points = links * np.arange(len(values)) / len(values)
        return np.stack([np.interp(q, points, values[:, axis], period=links) for axis in (0, 1)], axis=-1)

    across = np.sum((joints - at_joints(place)) * at_joints(normal), axis=-1)
    nearest = np.floor(q).astype(np.int64).ravel() % links
    counts = np.maximum(np.bincount(nearest, minlength=links), 1)
    mean_square = np.bincount(nearest, across.ravel() ** 2, links) / counts
    points = np.arange(len(normal)) / POINTS_PER_LINK
    return np.sqrt(np.interp(points, np.arange(links) + 0.5, mean_square, period=links))


def _vertex(s: Array, values: Array, middle: int, period: float | None = None) -> tuple[float, float]:
    """Where the parabola through a point and its two neighbours has its vertex, and how high it is.

    Args:
        s: arc length [m].
        values: at s.
        middle: index of an extreme value; if it is at an end, or not extreme, it is taken as it is.
        period: of s [m], if the values go round.
    """
    around = np.arange(middle - 1, middle + 2)
    if period is None and (around[0] < 0 or around[-1] >= len(s)):
        return float(s[middle]), float(values[middle])
    around %= len(s)
    offset = s[around] - s[middle]
    if period is not None:
        offset = (offset + period / 2) % period - period / 2
    square, slope, height = np.polyfit(offset, values[around], 2)
    if square == 0 or abs(slope) > 2 * abs(square) * np.abs(offset).max():
        return float(s[middle]), float(values[middle])
    return float(s[middle] - slope / (2 * square)), float(height - slope**2 / (4 * square))


def _angle(cosine: Array, sine: Array) -> Array:
    """Angle φ of tangents t = (cosine, sine) along the loop, 0 in the middle of the arrays where s is 0."""
    angle: Array = np.unwrap(np.arctan2(sine, -cosine))
    angle -= 2 * np.pi * np.round(angle[len(angle) // 2] / (2 * np.pi))
    return angle


def _free_part(s: Array, distance: Array, least: float) -> tuple[float, float]:
    """Where the part round s = 0 begins and ends that is farther from the sprocket's centre than `least` [m].

    Raises:
        ValueError: there is none, or it has no end.
    """
    middle, touching = len(s) // 2, np.flatnonzero(distance <= least)
    before, after = touching[touching < middle], touching[touching > middle]
    if distance[middle] <= least or not len(before) or not len(after):
        raise ValueError("before_release: the loop has no free part below a sprocket; give one that hangs on one")
    ends = []
    for touch, off in ((before[-1], before[-1] + 1), (after[0], after[0] - 1)):
        share = (least - distance[touch]) / (distance[off] - distance[touch])
        ends.append(float(s[touch] + share * (s[off] - s[touch])))
    return ends[0], ends[1]
