"""The numbers of a walk, and how they are read off its world when it is over.

The annotations of `Outcome` are the one table of these numbers: files, columns of a sweep, units and the reference
derive from them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.chain.setup import Setup
from warpchain.engine.tallies import CONTACTS, COUNTS, DEPTHS, EXTREMES, IMPULSES, LOSSES, LOST
from warpchain.hdf5_files import Stored
from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import Named
from warpchain.kernels import layout
from warpchain.status import Status
from warpchain.walks.landmarks import RELEASE
from warpchain.walks.moving_plane import angles

if TYPE_CHECKING:  # results are read without Warp, which takes half a second to import
    from warpchain.engine.world import World

_SINCE_FLOOR: Final = "time since the last impulse on the floor (NaN if none)"
_FIXED: Final = "if the plane is fixed"
_NEVER: Final = "NaN if that never happened"

ENERGIES: Final = {
    "kinetic_at_release": "kinetic energy at the release",
    "potential_at_release": "gravitational energy, from the floor below the release, and spring energy at the release",
    "kinetic_at_end": "kinetic energy at the end",
    "potential_at_end": "gravitational and spring energy at the end",
    **LOST,
    "residual": "energy at the release minus that at the end and all losses; the error of the integration",
}
"""Keys of `WalkResult.energy`. Losses count as positive."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Outcome:
    """The numbers of one walk, with their units and meanings.

    `outcomes_of` makes them when a walk ends; columns of sweeps, files and the reference have the same fields.
    """

    status: Status
    dx: Annotated[
        float,
        Stored(
            "m",
            "x of the centre of mass at rest minus x of the sprocket's centre; on a slope of angle α, x / cos α, the "
            "distance along the floor to the point vertically below it; NaN unless at rest",
        ),
    ]
    walk_time: Annotated[float, Stored("s", "time from the release to the end of the walk")]
    simulated_time: Annotated[float, Stored("s", "total simulated time, including the phases before the release")]
    hold_time: Annotated[
        float, Stored("s", "time for which the loop was held at full frequency; NaN without a sprocket")
    ]
    drift: Annotated[
        float,
        Stored(
            "1",
            "largest change of the held loop's mean height, width or horizontal position in the last steadiness check, "
            f"relative to height or width; {_NEVER}",
        ),
    ]
    lateral_drift: Annotated[
        float,
        Stored(
            "m", "sideways position z of the centre of mass at rest, positive to the right; NaN unless the plane tilts"
        ),
    ]
    final_tilt: Annotated[
        float, Stored("rad", f"tilt angle of the plane at the end, positive to the left; NaN {_FIXED}")
    ]
    final_yaw: Annotated[float, Stored("rad", f"yaw angle of the plane at the end, within ±π; NaN {_FIXED}")]
    greatest_tilt: Annotated[float, Stored("rad", f"largest absolute tilt angle in the walk; NaN {_FIXED}")]
    fell_at: Annotated[float, Stored("s", f"time from the release to the first tilt of 45°; {_NEVER}")]
    fell_over: Annotated[int, Stored("1", "1 if the plane ever tilted by 45°, 0 if not; −1 if the plane is fixed")]
    fell_before_collapse: Annotated[
        int, Stored("1", "1 if the chain fell over before its loop collapsed, 0 if not; −1 if the plane is fixed")
    ]
    self_contact_at: Annotated[
        float, Stored("s", "time from the release to the first record after an impulse between links; NaN if none")
    ]
    bounces_before_self_contact: Annotated[
        int, Stored("1", "number of bounces that had begun at self_contact_at; −1 if there was none")
    ]
    flight_before_self_contact: Annotated[float, Stored("s", f"{_SINCE_FLOOR}, at self_contact_at")]
    strands_met_at: Annotated[
        float,
        Stored(
            "s",
            f"time from the release to the first impulse between strands, links {layout.STRANDS_APART} or more apart; "
            "NaN if none",
        ),
    ]
    bounces_before_strands_met: Annotated[
        int, Stored("1", "number of bounces that had begun at strands_met_at; −1 if there was none")
    ]
    flight_before_strands_met: Annotated[float, Stored("s", f"{_SINCE_FLOOR}, at strands_met_at")]
    collapsed_at: Annotated[
        float,
        Stored("s", "time from the release to the collapse, when the loop encloses half of its area; NaN if none"),
    ]
    bounces_before_collapse: Annotated[
        int, Stored("1", "number of bounces that had begun at collapsed_at; −1 if there was none")
    ]
    flight_before_collapse: Annotated[float, Stored("s", f"{_SINCE_FLOOR}, at collapsed_at")]
    softened_at: Annotated[
        float, Stored("s", "time from the release to the softening of the joints; NaN if they were not softened")
    ]
    bounces: Annotated[int, Stored("1", COUNTS["bounces"])]
    steps_accepted: Annotated[int, Stored("1", COUNTS["accepted"])]
    steps_rejected: Annotated[int, Stored("1", COUNTS["rejected"])]
    impulses: Annotated[dict[str, int], Stored("1", "number of impulses by kind of contact", keys=IMPULSES)]
    greatest_opening: Annotated[float, Stored("m", EXTREMES["opening"])]
    greatest_penetration: Annotated[
        dict[str, float], Stored("m", "largest penetration by kind of contact", keys=DEPTHS)
    ]
    energy: Annotated[dict[str, float], Stored("J", "energy balance of the walk", keys=ENERGIES)]
    sprocket_height: Annotated[
        float, Stored("m", "height of the sprocket's centre at the release; NaN without a sprocket or a release")
    ]
    release: Annotated[dict[str, float], Stored("m", "geometry of the loop at the release", keys=RELEASE)]
    release_speed: Annotated[float, Stored("m/s", "mean speed of the link centres along the loop at the release")]

    def __post_init__(self) -> None:
        """Make an unknown key of `energy` and the like an `UnknownNameError`."""
        for name, value in vars(self).items():
            if isinstance(value, dict):
                object.__setattr__(self, name, Named(value))

    @property
    def energy_at_release(self) -> float:
        """Kinetic and potential energy at the release [J]; NaN without one."""
        return self.energy["kinetic_at_release"] + self.energy["potential_at_release"]

    @property
    def energy_at_end(self) -> float:
        """Kinetic and potential energy at the end [J]; NaN without a release."""
        return self.energy["kinetic_at_end"] + self.energy["potential_at_end"]


@dataclass(kw_only=True)
class Driven:
    """What the rest of a walk and its outcome need of the time before the release.

    Attributes:
        has_sprocket: Whether the walk began on a sprocket.
        full_speed_at: Simulated time [s] at which that turned at its full frequency.
        drift: Of the loop on its sprocket, see `Outcome.drift`.
        drive_time: Simulated time [s] before the release.
        raised: Height [m] by which the chain and its sprocket were raised at the release, and so the height of the
            sprocket's centre above the floor; NaN before the release.
        counts: Counters before the release, in the order of `COUNTS`.
        extremes: Greatest lengths [m] before the release, in the order of `EXTREMES`.
    """

    has_sprocket: bool
    full_speed_at: float = math.nan
    drift: float = math.nan
    drive_time: float = 0.0
    raised: float = math.nan
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(len(COUNTS), np.int64))
    extremes: NDArray[np.float64] = field(default_factory=lambda: np.zeros(len(EXTREMES)))

    @classmethod
    def remembered(cls, memory: Mapping[str, NDArray[Any]]) -> "Driven":
        """What `memory` kept."""
        values: dict[str, Any] = {
            name.removeprefix(_MEMORY): part for name, part in memory.items() if name.startswith(_MEMORY)
        }
        return cls(**{name: part if part.ndim else part.item() for name, part in values.items()})

    @property
    def memory(self) -> dict[str, NDArray[Any]]:
        """Its fields as entries of a `State.memory`."""
        return {f"{_MEMORY}{name}": np.array(value) for name, value in vars(self).items()}


_MEMORY: Final = "driven/"
"""How the names of its fields begin in a memory."""


def outcomes_of(
    world: "World",
    setups: Sequence[Setup],
    statuses: Sequence[Status],
    driven: Sequence[Driven],
    released: Sequence[bool],
) -> dict[str, Any]:
    """The numbers of walks that have ended in worlds: arrays (w,) by the fields of `Outcome`, of some by keys as well.

    Given are all worlds together, and of each walk its setup, status, time before the release, and whether that came.
    """
    is_released, status = np.array(released), np.array(statuses, np.int32)
    is_at_rest, has_sprocket = status == Status.AT_REST, np.array([each.has_sprocket for each in driven])
    drive_time, full_speed_at, drift, raised = np.array(
        [(each.drive_time, each.full_speed_at, each.drift, each.raised) for each in driven]
    ).T
    now, first, last = world.state("time"), world.state("first_sample"), world.state("last_sample")
    counts, extremes = world.state("counts"), world.state("extremes")
    held = np.where(is_released, drive_time, now) - full_speed_at
    counts = np.where(is_released[:, np.newaxis], np.array([each.counts for each in driven]) + counts, counts)
    greatest = np.fmax(np.array([each.extremes for each in driven]), extremes)
    extremes = np.where(is_released[:, np.newaxis], greatest, extremes)
    count, extreme = dict(zip(COUNTS, counts.T, strict=True)), dict(zip(EXTREMES, extremes.T, strict=True))
    sample = np.where(is_released[:, np.newaxis], first, np.nan)
    columns = [layout.CENTER_X, layout.CENTER_Y, layout.WIDTH, layout.HEIGHT, layout.LOWEST]
    # Δx is x of the centre of mass, because the sprocket's centre is at x = 0; on a slope, along the floor
    distance = last[:, layout.CENTER_X] / np.array([along_floor(setup) for setup in setups])
    return {
        "status": status,
        "dx": np.where(is_at_rest, distance, np.nan),
        "walk_time": np.where(is_released, now, 0.0),
        "simulated_time": drive_time + now,
        "hold_time": np.where(has_sprocket, np.fmax(0.0, held), np.nan),
        "drift": np.where(is_released, drift, world.watched(layout.DRIFT)),
        "softened_at": world.watched(layout.SOFTENED_AT),
        "bounces": count["bounces"],
        "steps_accepted": count["accepted"],
        "steps_rejected": count["rejected"],
        "impulses": {kind: count[kind] for kind in CONTACTS},
        "greatest_opening": extreme["opening"],
        "greatest_penetration": {kind: extreme[kind] for kind in CONTACTS},
        "energy": _energies(world, setups, is_released),
        **_falls(world, is_released & [setup.scene.plane == "tilting" for setup in setups], is_at_rest),
        **_endings(world, is_released, "self_contact_at", "self_contact", layout.SELF_CONTACT_AT),
        **_endings(world, is_released, "strands_met_at", "strands_met", layout.STRANDS_MET_AT),
        **_endings(world, is_released, "collapsed_at", "collapse", layout.COLLAPSED_AT),
        "sprocket_height": np.where(has_sprocket, raised, np.nan),
        "release": dict(zip(RELEASE, sample[:, columns].T, strict=True)),
        "release_speed": sample[:, layout.LOOP_SPEED],
    }


def only(outcomes: Mapping[str, Any]) -> Outcome:
    """The outcome of a walk that `outcomes_of` has the numbers of, and of no other."""
    values: dict[str, Any] = {
        name: {key: part.item() for key, part in value.items()} if isinstance(value, dict) else value.item()
        for name, value in outcomes.items()
    }
    return Outcome(**values | {"status": Status(values["status"])})


def along_floor(setup: Setup) -> float:
    """Part of a distance along the floor by which x grows."""
    return math.cos(math.radians(setup.scene.slope))


def datums(world: "World", setups: Sequence[Setup]) -> Array:
    """Energy [J] of chains' masses on the floor below the release, from which potential energies count, (w,)."""
    heights = np.zeros(len(setups))
    for place, setup in enumerate(setups):
        if not setup.scene.is_level:
            heights[place] = setup.floor.heights(world.state("first_sample")[place, layout.CENTER_X])
    weights: Array = world.constant("mass") * world.constant("gravity")
    return weights * heights


def _energies(world: "World", setups: Sequence[Setup], is_released: NDArray[np.bool_]) -> dict[str, Array]:
    """Where the energy of walks went [J]; NaN before the release. Keys: `ENERGIES`."""
    first, last, below = world.state("first_sample").T, world.state("last_sample").T, datums(world, setups)
    lost = {name: loss for name, loss in zip(LOSSES, world.state("losses").T, strict=True) if name in LOST}
    ledger = {
        "kinetic_at_release": first[layout.KINETIC],
        "potential_at_release": first[layout.GRAVITATIONAL] + first[layout.SPRING] - below,
        "kinetic_at_end": last[layout.KINETIC],
        "potential_at_end": last[layout.GRAVITATIONAL] + last[layout.SPRING] - below,
        **lost,
    }
    at_release = ledger["kinetic_at_release"] + ledger["potential_at_release"]
    at_end = ledger["kinetic_at_end"] + ledger["potential_at_end"]
    ledger["residual"] = at_release - at_end - sum(lost.values())
    return {name: np.where(is_released, values, np.nan) for name, values in ledger.items()}


_FALL: Final = ("lateral_drift", "final_tilt", "final_yaw", "greatest_tilt", "fell_at")


def _falls(world: "World", tilts: NDArray[np.bool_], is_at_rest: NDArray[np.bool_]) -> dict[str, NDArray[Any]]:
    """What became of planes; `tilts` is false of one that is fixed or was never released."""
    if not tilts.any():
        never = {name: np.full(len(tilts), np.nan) for name in _FALL}
        return never | {name: np.full(len(tilts), -1) for name in ("fell_over", "fell_before_collapse")}
    last = world.state("last_sample")
    tilt, yaw = angles(last[:, layout.PLANE_COLUMN :])
    rows = (layout.COLLAPSED_AT, layout.FELL_AT, layout.GREATEST_LEAN)
    collapsed_at, fell_at, lean = map(world.watched, rows)
    leans = np.array([math.asin(each) for each in np.fmin(1.0, lean)])
    found = np.where(is_at_rest, last[:, layout.CENTER_Z], np.nan), tilt, yaw, leans, fell_at
    has_fallen = ~np.isnan(fell_at), fell_at < np.where(np.isnan(collapsed_at), np.inf, collapsed_at)
    return {
        **{name: np.where(tilts, values, np.nan) for name, values in zip(_FALL, found, strict=True)},
        "fell_over": np.where(tilts, has_fallen[0], -1),
        "fell_before_collapse": np.where(tilts, has_fallen[1], -1),
    }


def _endings(
    world: "World", is_released: NDArray[np.bool_], moment: str, event: str, first: int
) -> dict[str, NDArray[Any]]:
    """When an event came, after how many bounces begun, and how long after the last impulse on the floor.

    Given is the first of its three entries of :attr:`State.watch`.
    """
    at, bounces, flight = (np.where(is_released, world.watched(row), np.nan) for row in range(first, first + 3))
    return {
        moment: at,
        f"bounces_before_{event}": np.where(np.isnan(bounces), -1, bounces).astype(np.int64),
        f"flight_before_{event}": np.where(np.isfinite(flight), flight, np.nan),
    }
