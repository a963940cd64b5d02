"""The numbers of a walk, and how they are read off its world when it is over.

The annotations of `Outcome` are the one table of these numbers: files, columns of a sweep, units and the reference
derive from them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.chain.setup import Setup
from warpchain.engine.tallies import CONTACTS, COUNTS, DEPTHS, EXTREMES, IMPULSES, LOST
from warpchain.engine.world import World
from warpchain.hdf5_files import Stored
from warpchain.kernels import layout
from warpchain.status import Status
from warpchain.walks.landmarks import RELEASE
from warpchain.walks.moving_plane import angles

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
    """The numbers of one walk; units and meanings stand beside them."""

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


def outcome_of(world: World, setup: Setup, status: Status, driven: Driven, is_released: bool) -> Outcome:
    """The numbers of a walk that has ended in a world with a status."""
    counts, extremes = world.counts, world.extremes
    now = world.time
    held = (driven.drive_time if is_released else now) - driven.full_speed_at
    if is_released:
        counts = {name: before + counts[name] for name, before in zip(COUNTS, driven.counts.tolist(), strict=True)}
        greatest = np.fmax(driven.extremes, [*extremes.values()])
        extremes = dict(zip(EXTREMES, greatest.tolist(), strict=True))
    is_at_rest = status == Status.AT_REST
    first, last = world.first_sample, world.last_sample
    released = first if is_released else np.full_like(first, np.nan)
    columns = [layout.CENTER_X, layout.CENTER_Y, layout.WIDTH, layout.HEIGHT, layout.LOWEST]
    # Δx is x of the centre of mass, because the sprocket's centre is at x = 0; on a slope, along the floor
    return Outcome(
        status=status,
        dx=float(last[layout.CENTER_X]) / along_floor(setup) if is_at_rest else math.nan,
        walk_time=now if is_released else 0.0,
        simulated_time=driven.drive_time + now,
        hold_time=max(0.0, held) if driven.has_sprocket else math.nan,
        drift=driven.drift,
        softened_at=world.watched(layout.SOFTENED_AT),
        bounces=counts["bounces"],
        steps_accepted=counts["accepted"],
        steps_rejected=counts["rejected"],
        impulses={kind: counts[kind] for kind in CONTACTS},
        greatest_opening=extremes["opening"],
        greatest_penetration={kind: extremes[kind] for kind in CONTACTS},
        energy=_energy(world, setup, is_released),
        **_fall(world, is_at_rest) if is_released and setup.scene.plane == "tilting" else _NO_FALL,
        **_ending(world, is_released, "self_contact_at", "self_contact", layout.SELF_CONTACT_AT),
        **_ending(world, is_released, "strands_met_at", "strands_met", layout.STRANDS_MET_AT),
        **_ending(world, is_released, "collapsed_at", "collapse", layout.COLLAPSED_AT),
        sprocket_height=driven.raised if driven.has_sprocket else math.nan,
        release=dict(zip(RELEASE, released[columns].tolist(), strict=True)),
        release_speed=float(released[layout.LOOP_SPEED]),
    )


def along_floor(setup: Setup) -> float:
    """Part of a distance along the floor by which x grows."""
    return math.cos(math.radians(setup.scene.slope))


def datum(world: World, setup: Setup) -> float:
    """Energy [J] of the chain's mass on the floor below the release, from which potential energies count."""
    x = world.first_sample[layout.CENTER_X]
    return setup.link_values.total_mass * setup.parameters.gravity * float(setup.floor.heights(x))


def _energy(world: World, setup: Setup, is_released: bool) -> dict[str, float]:
    """Where the energy of the walk went [J]; NaN before the release. Keys: `ENERGIES`."""
    first, last, below = world.first_sample, world.last_sample, datum(world, setup)
    lost = {name: loss for name, loss in world.losses.items() if name in LOST}
    ledger = {
        "kinetic_at_release": float(first[layout.KINETIC]),
        "potential_at_release": float(first[layout.GRAVITATIONAL] + first[layout.SPRING]) - below,
        "kinetic_at_end": float(last[layout.KINETIC]),
        "potential_at_end": float(last[layout.GRAVITATIONAL] + last[layout.SPRING]) - below,
        **lost,
    }
    at_release = ledger["kinetic_at_release"] + ledger["potential_at_release"]
    at_end = ledger["kinetic_at_end"] + ledger["potential_at_end"]
    ledger["residual"] = at_release - at_end - sum(lost.values())
    return ledger if is_released else dict.fromkeys(ledger, math.nan)


_NO_FALL: Final[Mapping[str, Any]] = {
    **dict.fromkeys(("lateral_drift", "final_tilt", "final_yaw", "greatest_tilt", "fell_at"), math.nan),
    **dict.fromkeys(("fell_over", "fell_before_collapse"), -1),
}
"""Of a plane that is fixed or was never released."""


def _fall(world: World, is_at_rest: bool) -> Mapping[str, Any]:
    """What became of the plane."""
    last = world.last_sample
    tilt, yaw = angles(last[layout.PLANE_COLUMN :])
    rows = (layout.COLLAPSED_AT, layout.FELL_AT, layout.GREATEST_LEAN)
    collapsed_at, fell_at, lean = map(world.watched, rows)
    return {
        "lateral_drift": float(last[layout.CENTER_Z]) if is_at_rest else math.nan,
        "final_tilt": float(tilt),
        "final_yaw": float(yaw),
        "greatest_tilt": math.asin(min(1.0, lean)),
        "fell_at": fell_at,
        "fell_over": int(not math.isnan(fell_at)),
        "fell_before_collapse": int(fell_at < (math.inf if math.isnan(collapsed_at) else collapsed_at)),
    }


def _ending(world: World, is_released: bool, moment: str, event: str, first: int) -> dict[str, Any]:
    """When an event came, after how many bounces begun, and how long after the last impulse on the floor.

    Given is the first of its three entries of :attr:`State.watch`.
    """
    at, bounces, flight = (world.watched(row) if is_released else math.nan for row in range(first, first + 3))
    return {
        moment: at,
        f"bounces_before_{event}": -1 if math.isnan(bounces) else int(bounces),
        f"flight_before_{event}": flight if math.isfinite(flight) else math.nan,
    }
