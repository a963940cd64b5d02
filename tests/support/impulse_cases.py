"""Cases of the collision law: worked by hand, and drawn by hypothesis and judged by what holds for any collision."""

from dataclasses import astuple, dataclass, replace

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from warpchain.inputs.parameters import preset

Array = NDArray[np.float64]
Vector = tuple[float, float]

UNIT = preset("paper").with_values(
    {
        "link_length": 2.0,
        "circle_radius": 0.5,
        **dict.fromkeys(["inner_mass", "outer_mass", "inner_inertia", "outer_inertia"], 1.0),
        **dict.fromkeys(["floor_restitution", "sprocket_restitution", "chain_restitution"], 0.0),
        **dict.fromkeys(["floor_friction", "sprocket_friction", "chain_friction"], 1.0),
    }
)
"""Links of 2 m, 1 kg and 1 kg m², circles of 0.5 m, e = 0 and μ = 1: for contacts worked by hand."""


@dataclass(frozen=True)
class Collision:
    """One collision of A and B; the fields are the arguments of `collision_impulse`, in its order."""

    v_rel: Vector
    normal: Vector
    lever_a: Vector
    lever_b: Vector
    inv_mass_a: float
    inv_inertia_a: float
    inv_mass_b: float
    inv_inertia_b: float
    restitution: float
    friction: float
    tangential_restitution: float

    def arguments(self) -> tuple[Array | float, ...]:
        """All fields in order, vectors as arrays."""
        return tuple(np.array(value) if isinstance(value, tuple) else value for value in astuple(self))

    def relative_velocity_after(self, impulse: Array) -> Array:
        """v_A − v_B at P after B got `impulse` and A its opposite, from each body's own equations."""
        return (
            np.array(self.v_rel)
            + self._change_at(self.lever_a, self.inv_mass_a, self.inv_inertia_a, -impulse)
            - (self._change_at(self.lever_b, self.inv_mass_b, self.inv_inertia_b, impulse))
        )

    def kinetic_energy_change(self, impulse: Array) -> float:
        """Change of the bodies' kinetic energy, −J·(v + v')/2 with v = v_A − v_B before and v' after."""
        return float(-impulse @ (np.array(self.v_rel) + self.relative_velocity_after(impulse)) / 2)

    @staticmethod
    def _change_at(lever: Vector, inv_mass: float, inv_inertia: float, impulse: Array) -> Array:
        spin = inv_inertia * (lever[0] * impulse[1] - lever[1] * impulse[0])
        return inv_mass * impulse + spin * np.array([-lever[1], lever[0]])


# Notation: n̂ from A to B, t̂ = ẑ × n̂, W, J₁, J₂ as in `collision_impulse`, D = J₂ − J₁, and
# vectors in brackets are (n, t) components unless they say "world".

# Two equal masses of 1 kg, head-on: W_nn = 2, so v_n = 2 gives J₁ = 1 and J = 1 + e.
HEAD_ON = Collision((2.0, 0.0), (1.0, 0.0), (0.0, 0.0), (0.0, 0.0), 1.0, 1.0, 1.0, 1.0, 1.0, 0.5, 0.0)

# A ball of 2 kg hits the floor with (3, −4) m/s, no lever: v = (4, 3), W = 1/2, J₁ = 8 n̂, J₂ = [8, 6], D = [0, 6].
# n̂ = +y, so t̂ = −x: world = (−J_t, J_n). e = 0.5: J_n = 12.
BALL = Collision((-3.0, 4.0), (0.0, 1.0), (0.0, 0.0), (0.0, 0.0), 0.0, 0.0, 0.5, 2.0, 0.5, 0.25, 0.0)

# A body with m = I = 1 falls with 3 m/s onto the floor, P at (1, −1) from its centre: r × n̂ = 1, r × t̂ = −1,
# W = [2 −1; −1 2], det 3, v = [3, 0], J₁ = 3/2 n̂, J₂ = [2, 1], D = [1/2, 1].
CORNER = Collision((0.0, 3.0), (0.0, 1.0), (0.0, 0.0), (1.0, -1.0), 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0)

# Two bodies, n̂ = +x: m_A = I_A = m_B = 1, I_B = 1/2, levers (1, 1) and (−1, 0): r_A × n̂ = −1, r_A × t̂ = 1, r_B × n̂ = 0,
# r_B × t̂ = −1, W = [3 −1; −1 5], det 14. v = [6, 12]: J₁ = 2 n̂, J₂ = (1/14)[5·6 + 12, 6 + 3·12] = [3, 3], D = [1, 3].
PAIR = Collision((6.0, 12.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 0.0), 1.0, 1.0, 1.0, 2.0, 0.5, 1.0, 0.0)

# PAIR turned by the angle whose cosine and sine are 0.6 and 0.8: world = (0.6 J_n − 0.8 J_t, 0.8 J_n + 0.6 J_t).
PAIR_TURNED = replace(PAIR, v_rel=(-6.0, 12.0), normal=(0.6, 0.8), lever_a=(-0.2, 1.4), lever_b=(-0.6, -0.8))

HAND_CASES: dict[str, tuple[Collision, Vector]] = {
    # e = 0 ends at the common velocity.
    "head-on, plastic": (replace(HEAD_ON, restitution=0.0), (1.0, 0.0)),
    # J^(a) = [12, 6] needs μ ≥ 1/2. μ = 1/4: κ = (1/4)·12/6 = 1/2, J = [12, 3].
    "ball slides": (BALL, (-3.0, 12.0)),
    "ball sticks": (replace(BALL, friction=1.0), (-6.0, 12.0)),
    # J_t = (1 + e_t)·6 = 9 ≤ 12.
    "ball returns half its slip": (replace(BALL, friction=1.0, tangential_restitution=0.5), (-9.0, 12.0)),
    # J^(a) = 3/2 n̂ + D = [2, 1].
    "corner sticks, plastic": (CORNER, (-1.0, 2.0)),
    # μ = 1/4: κ = (1/4)(3/2)/(1 − (1/4)(1/2)) = 3/7, J = [3/2 + 3/14, 3/7] = [12/7, 3/7].
    "corner slides, plastic": (replace(CORNER, friction=0.25), (-3 / 7, 12 / 7)),
    # (1 + e) J₁ = 3 n̂. J^(a) = [4, 3].
    "pair sticks": (PAIR, (4.0, 3.0)),
    # μ = 1/2 < 3/4: κ = (1/2)·3/(3 − 1/2) = 3/5, J = [3.6, 1.8].
    "pair slides": (replace(PAIR, friction=0.5), (3.6, 1.8)),
    # e_t = −1/2: J^(a) = [3.5, 1.5], within μ = 1/2.
    "pair keeps half its slip": (replace(PAIR, friction=0.5, tangential_restitution=-0.5), (3.5, 1.5)),
    # e_t = 1: J^(a) = [5, 6] is beyond μ = 1: κ = 3/(3 − 1) = 3/2, J = [4.5, 4.5].
    "pair returns its slip": (replace(PAIR, tangential_restitution=1.0), (4.5, 4.5)),
    # 0.6·3.6 − 0.8·1.8 = 0.72, 0.8·3.6 + 0.6·1.8 = 3.96.
    "turned pair slides": (replace(PAIR_TURNED, friction=0.5), (0.72, 3.96)),
    "turned pair sticks": (PAIR_TURNED, (0.0, 5.0)),
    # A of 1/2 kg hits an immovable B with 3 m/s: J₁ = 3·(1/2).
    "wall is B": (
        Collision((3.0, 0.0), (1.0, 0.0), (0.0, 0.0), (0.0, 0.0), 2.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.0),
        (1.5, 0.0),
    ),
    "separating": (replace(PAIR, v_rel=(-1e-9, 12.0)), (0.0, 0.0)),
    "grazing": (replace(PAIR, v_rel=(0.0, 12.0)), (0.0, 0.0)),
}
"""Name → collision and the impulse on B, N s in world axes."""


def law_violations(collision: Collision, impulse: Array, tolerance: float = 1e-12) -> list[str]:
    """What an impulse breaks of the laws that hold for any approaching collision: a list of names, empty if none.

    Args:
        collision: an approaching collision with e in [0, 1], e_t in [−1, 1] and μ ≥ 0.
        impulse: (2,), N s, on B.
        tolerance: allowed rounding, relative to the largest quantity that enters.
    """
    v, normal = np.array(collision.v_rel), np.array(collision.normal)
    tangent = np.array([-normal[1], normal[0]])
    after = collision.relative_velocity_after(impulse)
    stiffness = sum(
        inv_mass + inv_inertia * np.dot(lever, lever)
        for lever, inv_mass, inv_inertia in (
            (collision.lever_a, collision.inv_mass_a, collision.inv_inertia_a),
            (collision.lever_b, collision.inv_mass_b, collision.inv_inertia_b),
        )
    )
    speed = np.linalg.norm(v) + stiffness * np.linalg.norm(impulse)
    size = np.linalg.norm(impulse)
    laws = {
        "pushes only": normal @ impulse >= -tolerance * size,
        "normal restitution": abs(normal @ after + collision.restitution * (normal @ v)) <= tolerance * speed,
        "friction cone": abs(tangent @ impulse)
        <= collision.friction * (normal @ impulse) * (1 + tolerance) + 1e-15 * size,
        "energy never rises": collision.kinetic_energy_change(impulse) <= tolerance * size * speed,
    }
    return [name for name, holds in laws.items() if not holds]


def _spread(low: float, high: float) -> st.SearchStrategy[float]:
    """Positive numbers, all orders of magnitude alike."""
    return st.floats(np.log(low), np.log(high)).map(lambda exponent: float(np.exp(exponent)))


@st.composite
def collisions(draw: st.DrawFn) -> Collision:
    """Approaching collisions of bodies of 1 g to 1 kg, either of them possibly immovable, μ from 0 to 1.

    Levers reach four radii of gyration, so W is anything from round to far from it, and sliding can jam.
    """
    angle, slope = draw(st.floats(-np.pi, np.pi)), draw(st.floats(-1.57, 1.57))
    speed = draw(_spread(1e-3, 10.0))
    direction = angle + slope
    immovable = draw(st.sampled_from(["neither", "neither", "A", "B"]))
    levers: list[Vector] = []
    inverses: list[tuple[float, float]] = []
    for body in "AB":
        mass, gyration = draw(_spread(1e-3, 1.0)), draw(_spread(1e-3, 1.0))
        levers.append((gyration * draw(st.floats(-4.0, 4.0)), gyration * draw(st.floats(-4.0, 4.0))))
        inverses.append((0.0, 0.0) if body == immovable else (1 / mass, 1 / (mass * gyration**2)))
    unit = st.one_of(st.sampled_from([0.0, 1.0]), st.floats(1e-3, 1.0))
    return Collision(
        (speed * float(np.cos(direction)), speed * float(np.sin(direction))),
        (float(np.cos(angle)), float(np.sin(angle))),
        levers[0],
        levers[1],
        *inverses[0],
        *inverses[1],
        draw(unit),
        draw(unit),
        draw(st.one_of(st.sampled_from([-1.0, 0.0, 1.0]), st.floats(-1.0, 1.0))),
    )


def crumpled_chain(n: int, seed: int, link_length: float, size: float) -> tuple[Array, Array]:
    """A heap of n links thrown at random, joints torn open: position and velocity (n, 3) of the order of 1 m/s.

    Their centres lie in a box about the origin, through which a floor at y = 0 cuts; its half width is `size` links.
    """
    generator = np.random.default_rng(seed)
    position = generator.uniform(-1, 1, (n, 3)) * [size * link_length, size * link_length, np.pi]
    velocity = generator.normal(size=(n, 3)) * [1.0, 1.0, 2 / link_length]
    return position, velocity


def crumpled_chains() -> st.SearchStrategy[tuple[int, int, float]]:
    """Arguments n, seed and size of `crumpled_chain`: from heaps where most circles overlap to sparse ones."""
    return st.tuples(st.sampled_from([4, 6, 8, 12]), st.integers(0, 2**32 - 1), st.floats(0.3, 3.0))
