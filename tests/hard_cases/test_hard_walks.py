"""Walks that break careless integrators: each ends at rest or with a clear status, its ledger closed."""

import math
from dataclasses import dataclass
from typing import Any

import pytest

from tests.hard_cases.starts import METHODS, PRECISION, SOFT, every_method
from tests.support.setups import setup_walk
from warpchain import Status, WalkResult
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.results.one_walk import run_walk

QUICK = ("rkf78", "dp5", "hybrid")
every_method_walks = pytest.mark.parametrize(
    "method", [pytest.param(method, marks=() if method in QUICK else pytest.mark.slow) for method in METHODS]
)
"""Walks need a kernel more than short runs: no other quick test uses those of bs32 and os32."""


@dataclass(frozen=True)
class Walk:
    """A walk, the bounds of its Δx [m], and its status."""

    settings: dict[str, Any]
    distance: tuple[float, float] = (-math.inf, math.inf)
    preset: str = "soft"
    status: Status = Status.AT_REST

    def end(self, method: str, within: float, **settings: object) -> WalkResult:
        """Walk with other settings, check status and Δx, and that the ledger closes to this share of the energy."""
        limits = {"step_limit": 20_000_000, "tolerance": 1e-6, "flight_tolerance": 1e-4, "precision": PRECISION[method]}
        setup = setup_walk(self.preset, {"method": method, **limits, **self.settings, **settings})
        done = run_walk(setup, frame_interval=None)
        assert done.status == self.status
        if self.status == Status.AT_REST:
            assert self.distance[0] < done.dx < self.distance[1]
        assert done.energy_error < within
        return done


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "tolerance", "within"),
    [pytest.param("rkf78", 1e-6, 1e-4, marks=pytest.mark.thorough), ("hybrid", 1e-4, 5e-4)],
)
def test_longest_slow_walk_ends_in_a_pile_at_rest(method: str, tolerance: float, within: float) -> None:
    """180 links released at 5 Hz fall into a pile beside the sprocket and rest there, and the ledger closes."""
    slow = Walk({"frequency": 5.0, "start": "spinning", "links": 180}, distance=(0.0, 0.3))
    done = slow.end(method, within, tolerance=tolerance)
    assert done.center[-1, 1] < 0.06
    assert done.impulses["self"] > 1e5
    assert done.greatest_penetration["floor"] < SOFT.circle_radius / 2


@pytest.mark.slow
@pytest.mark.parametrize(("preset", "links"), [("paper", 60), ("soft", 180)])
@every_method
def test_chain_dropped_without_spin_rests_below(preset: str, links: int, method: str) -> None:
    """An upright ellipse at rest drops, collapses and rests within a few centimetres of where it hung.

    With the settings of explicit but tighter tolerances, which close the ledger to 1e-3; at 1e-6 and on stiff joints a
    pile takes minutes.
    """
    settings = {**METHODS_BY_NEED["explicit"], "flight_tolerance": 1e-4 if method == "hybrid" else 1e-3}
    del settings["method"]
    if method in ("os32", "hybrid"):
        settings |= {"tolerance": 1e-3, "soft_tolerance": 3e-3, "precision": "mixed"}
    else:
        settings |= {"tolerance": 1e-4, "soft_tolerance": 1e-4}
    dropped = {"frequency": 0.0, "start": "ellipse", "ellipse_aspect": 2.0}
    done = Walk(dropped, (-0.03, 0.03), preset).end(method, 1e-3, links=links, **settings)
    assert done.bounces >= 1
    assert done.impulses["self"] > 1000
    assert done.center[-1, 1] < done.center[0, 1] / 3


@every_method_walks
@pytest.mark.parametrize("links", [4, 6, 8])
def test_short_chains(method: str, links: int) -> None:
    """The shortest chains drop, bounce and come to rest, flat on the floor, where they do with the reference."""
    short = Walk({"links": links, "frequency": 4.0, "start": "ellipse"}, distance=(0.0, 0.5))
    done = short.end(method, 2e-4)
    assert done.bounces >= 1
    if method != "rkf78":
        # after two or three bounces chaos has not come far
        assert done.dx == pytest.approx(short.end("rkf78", 2e-4).dx, rel=0.02)
    assert done.center[-1, 1] < SOFT.circle_radius + links * SOFT.link_length / 4


@pytest.mark.slow
@pytest.mark.parametrize("method", ["dp5", pytest.param("hybrid", marks=pytest.mark.thorough)])
def test_sixty_turns_per_second(method: str) -> None:
    """At 60 Hz the chain walks for many metres and comes to rest, its ledger closed to 5e-4.

    The loop slips by 5 to 8 % and wanders by 2 %, for good: watched to 1 % for as long as slow waves need it is not
    steady in 30 s.
    """
    steady = {"steady_time": 0.1, "steady_tolerance": 0.03}
    fast = Walk({"links": 60, "frequency": 60.0, "start": "spinning", **steady}, distance=(10.0, 13.0))
    fast.end(method, 5e-4)


@pytest.mark.parametrize(
    ("start", "method"),
    [
        ("rest", "dp5"),
        ("spinning", "dp5"),
        *(pytest.param("rest", method, marks=pytest.mark.thorough) for method in METHODS if method != "dp5"),
        *(pytest.param("spinning", method, marks=pytest.mark.slow) for method in ("rkf78", "os32", "hybrid")),
    ],
)
def test_standing_sprocket(start: str, method: str) -> None:
    """At 0 Hz the chain hangs on its sprocket until it is let go, falls, and rests within a few centimetres.

    A pile amplifies the last digits, so the symmetry of the hanging loop says no more than that: |Δx| well below the
    loop's half width.
    """
    precision = "mixed" if method == "os32" else PRECISION[method]
    hanging = Walk({"links": 60, "frequency": 0.0, "start": start}, distance=(-0.03, 0.03))
    done = hanging.end(method, 1e-5, precision=precision)
    assert done.impulses["sprocket"] > 0
    assert done.greatest_penetration["sprocket"] < 1e-3
    assert done.sprocket_center is not None
    # it hangs: the centre is one loop's height above the floor
    assert done.sprocket_center[1] < 60 * SOFT.link_length / 2


@every_method_walks
@pytest.mark.parametrize("friction", [0.0, 1.0])
@pytest.mark.parametrize("restitution", [0.0, 1.0])
def test_walks_at_the_ends_of_the_collision_law(method: str, friction: float, restitution: float) -> None:
    """With e and μ of 0 or 1 a chain still comes to rest; without friction of the floor it stays above its start."""
    law = {
        **dict.fromkeys(["floor_restitution", "chain_restitution"], restitution),
        **dict.fromkeys(["floor_friction", "chain_friction"], friction),
    }
    distance = (0.1, 1.0) if friction else (-1e-10, 1e-10)  # rounding moves the centre by at most 2e-12
    done = Walk({"links": 20, "frequency": 10.0, "start": "ellipse", **law}, distance).end(method, 3e-4)
    assert abs(done.energy["joint_switch"]) < 1e-2 * done.energy["kinetic_at_release"]
