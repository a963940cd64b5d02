"""All recorded data of one walk, and the quantities derived from them.

Figures are drawn from a `WalkNumbers`; its subclass `WalkResult` is what users get. The annotations of `Outcome` and
`WalkNumbers` are the one table of a walk's quantities: files, columns of a sweep, units and the reference derive from
them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np

from warpchain.chain.setup import Setup
from warpchain.hdf5_files import Stored, read_fields, stored_fields, write_fields
from warpchain.inputs.arrays import Array
from warpchain.inputs.validation import Named
from warpchain.loop.stationary_loop import BEFORE_RELEASE, LOOP_FIELDS, BeforeRelease, StationaryLoop, average_loop
from warpchain.walks.landmarks import FAULTS, LENGTHS, bounces, energy_error, faults, least
from warpchain.walks.outcome import Outcome

if TYPE_CHECKING:
    import h5py

_FIXED: Final = "if the plane is fixed"


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WalkNumbers(Outcome):
    """All data of one walk with t record times and f frames of a chain of n links; units stand beside the fields."""

    wall_time: Annotated[float, Stored("s", "computing time, without the compilation of kernels")]
    setup: Setup
    seed: int | None
    versions: dict[str, str]
    time: Annotated[Array, Stored("s", "time since the release", "t")]
    center: Annotated[Array, Stored("m", "centre of mass x, y", "t 2")]
    center_velocity: Annotated[Array, Stored("m/s", "velocity of the centre of mass x, y", "t 2")]
    kinetic_energy: Annotated[Array, Stored("J", "kinetic energy", "t")]
    gravitational_energy: Annotated[
        Array, Stored("J", "gravitational energy, measured from the floor below the release", "t")
    ]
    spring_energy: Annotated[Array, Stored("J", "energy of the joint springs", "t")]
    lowest: Annotated[Array, Stored("m", "height of the lowest point of all contact circles", "t")]
    rms_speed: Annotated[Array, Stored("m/s", "RMS speed of the links", "t")]
    frame_time: Annotated[Array, Stored("s", "time since the release", "f")]
    frame_joints: Annotated[
        Array,
        Stored("m", "joint positions x, y; joint i is at the end of link i, and even links are inner links", "f n 2"),
    ]
    frame_forces: Annotated[
        Array,
        Stored(
            "N",
            "force x, y that each joint exerts on the link that ends there, with its present stiffness and damping, "
            "which are softened just after the release and after a collapse",
            "f n 2",
            empty="if not recorded",
        ),
    ]
    frame_moments: Annotated[
        Array,
        Stored(
            "N m", "friction moment that each joint exerts on the link that ends there", "f n", empty="if not recorded"
        ),
    ]
    center_z: Annotated[
        Array, Stored("m", "sideways position z of the centre of mass, positive to the right", "t", _FIXED)
    ]
    tilt: Annotated[Array, Stored("rad", "tilt angle of the plane", "t", _FIXED)]
    yaw: Annotated[Array, Stored("rad", "yaw angle of the plane's x axis, anticlockwise, unwrapped", "t", _FIXED)]
    frame_origin: Annotated[
        Array, Stored("m", "origin of the plane's coordinates in the laboratory frame", "f 3", _FIXED)
    ]
    frame_axes: Annotated[Array, Stored("1", "x and y axes of the plane in the laboratory frame", "f 2 3", _FIXED)]
    before_release: BeforeRelease | None = None
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def sprocket_center(self) -> Array | None:
        """Centre of the sprocket x, y at the release [m], shape (2,); None without one."""
        return None if np.isnan(self.sprocket_height) else np.array([0.0, self.sprocket_height])

    @property
    def sprocket_radius(self) -> float:
        """Radius of the sprocket that links touch [m]; NaN without one."""
        had_none = self.setup.start is not None and np.isnan(self.sprocket_height)
        return np.nan if had_none or not self.setup.scene.is_on_sprocket else self.setup.contact_radius

    @property
    def joints_lab(self) -> Array | None:
        """Joints x, y, z in the laboratory frame [m], (f, n, 3), if the plane tilts; else None, see `frame_joints`."""
        if self.setup.scene.plane == "fixed":
            return None
        return self.frame_origin[:, None, :] + self.frame_joints @ self.frame_axes

    @property
    def energy_error(self) -> float:
        """Size of the energy unaccounted for, relative to the energy at release; above 0.05 the walk is inaccurate."""
        return float(energy_error(self.energy_at_release, self.energy["residual"]))

    def warnings(self) -> list[str]:
        """Why the walk is inaccurate, each with what to try: energy, joints or contacts; empty if it is not."""
        values = vars(self.setup.scene) | vars(self.setup.parameters)
        lengths = {name: least(values[name]) for name in LENGTHS}
        deepest = max(self.greatest_penetration.values())
        found = faults(self.energy_error, self.greatest_opening, deepest, lengths)
        return [FAULTS[name] for name, is_there in found.items() if is_there]

    def mean_loop(self) -> StationaryLoop:
        """The loop on its sprocket just before the release: its mean shape, the forces in it, its kink.

        Raises:
            ValueError: the walk has kept nothing of that time, or too little.
        """
        return average_loop(self.setup, self.before_release, self.sprocket_center)

    def bounce_table(self) -> dict[str, Array]:
        """The bounces off the floor: columns of equal length, for example for `pandas.DataFrame`.

        `start` and `end` of contact [s], to a sample; `impulse_x`, `impulse_y` of the floor on the chain [N s];
        `sticks_at` [s], the first sample until which not all that touched slid one way (NaN: all did). A profile has
        several normals and a tilting plane slides in two directions: their tables have no `sticks_at`. A walk without
        series, or that was never released, has no bounces.
        """
        return bounces(self.time, self.center_velocity, self.setup)

    def unit(self, name: str) -> str:
        """SI unit of a field; an `UnknownNameError` if there is none of that name."""
        return STORED[name].unit

    def meaning(self, name: str) -> str:
        """One line saying what a field is; an `UnknownNameError` if there is none of that name."""
        return STORED[name].described


STORED: Final = Named(stored_fields(WalkNumbers))
"""Fields of `WalkNumbers` that a file keeps: name → unit, meaning, shape."""
NUMBERS: Final = {name: stored for name, stored in STORED.items() if not stored.shape}
"""Those that are numbers, or dictionaries of them."""
MOTION: Final = {name: stored for name, stored in STORED.items() if stored.shape}
"""Those that are arrays."""


def write_motion(group: "h5py.Group", values: Mapping[str, Any], joints: type = np.float64) -> None:
    """Write the arrays of a walk, and `before_release`, into a group; `joints`: precision of what each joint has."""
    write_fields(group, values, MOTION, joints)
    if (before := values[BEFORE_RELEASE]) is not None:
        write_fields(group.create_group(BEFORE_RELEASE, track_order=True), vars(before), LOOP_FIELDS, joints)


def read_motion(group: "h5py.Group", links: int) -> dict[str, Any]:
    """What `write_motion` wrote of a chain of so many links."""
    had = group.get(BEFORE_RELEASE)
    before = None if had is None else BeforeRelease(**read_fields(had, LOOP_FIELDS, links))
    return {**read_fields(group, MOTION, links), BEFORE_RELEASE: before}
