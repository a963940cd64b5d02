"""The fields of a scene: the chain's length, how it is spun and released, the floor, and when a walk ends."""

import math
from typing import Annotated, Final, Literal

from pydantic import Field, Strict

from warpchain.inputs.compound_fields import FloorField, Rows
from warpchain.inputs.options import on_gpu
from warpchain.inputs.starts import DESCRIBED, STARTS, StartWord
from warpchain.inputs.validation import InputError, Section, Whole, number_field

MOST_LINKS: Final = 100_000
"""A chain of so many links takes 0.4 GB, and kernels of its own."""
MOST_LINKS_ON_GPU: Final = 1024
"""A chain is a block of threads there, one for each link, and CUDA has no larger blocks."""
HIGHEST: Final = 1e6
"""Greatest height, where numbers still tell a nanometre [m]."""
FASTEST_TAP: Final = 1e3
"""Greatest speed [m/s] and rate [rad/s] of the plane at the release, far beyond that of any loop."""
LONGEST: Final = 1e6
"""Greatest time, in which numbers still tell a nanosecond, a short step [s]."""
STEEPEST: Final = 80.0
"""Greatest angle of a slope [°]."""
RIGHT_ANGLE: Final = math.pi / 2
OF_LINKS: Final = ("link_masses", "link_inertias", "viscous_frictions", "coulomb_frictions", "link_radii")
"""Fields with a number for each link or joint."""
TAP: Final = ("lateral_speed", "tilt", "tilt_rate", "yaw_rate")
"""What a release may give to a plane that tilts. Each is 0 by default: an upright plane that nothing disturbs stays
upright, so that a scene with a tilting plane alone is the paper's."""

_COMPOUND: Final = "compound"
"""Marks a field whose value may be a list or a mapping."""
_Numbers = Annotated[Annotated[tuple[Annotated[float, Field(ge=0, le=1e12)], ...], Strict(False)] | None, _COMPOUND]
"""A number for each link or joint; null: what the parameters say."""


class Scene(Section):
    """What happens in one walk, from hanging on the sprocket to the end."""

    links: Whole = number_field(60, "1", symbol="n", ge=4, le=MOST_LINKS)
    """number of links of the closed chain; must be even if inner and outer links alternate"""
    frequency: float = number_field(15.0, "Hz", symbol="ν", ge=0, le=300.0)  # more is in turns a minute
    """frequency of the sprocket at the release, in revolutions per second"""
    start: StartWord = Field(default="rest", description=f"how a walk begins; {DESCRIBED}")
    phase: float = number_field(0.0, "1", ge=0, lt=1)
    """moment of the release, as a fraction of a loop period"""
    clearance: float = number_field(0.01, "m", ge=0, le=HIGHEST)
    """height of the lowest contact circle above the floor; clearance_of says of which chain"""
    clearance_of: Literal["spinning", "hanging"] = "spinning"
    """whether clearance refers to the spinning chain at the release, or to the chain that hangs at rest"""
    sprocket_radius_is: Literal["contact", "pitch"] = "contact"
    """whether sprocket_radius is that of the contact surface, or that of the pitch circle on which the joints ride"""
    ellipse_aspect: float = number_field(1.5, "1", ge=0.05, le=20)
    """aspect ratio of the initial ellipse: its height divided by its width"""
    settle_time: float | None = number_field(None, "s", ge=0, le=LONGEST)
    """time for which the chain settles on the sprocket at rest; null: 0.1, or 2 if the clearance is that of the hanging
    chain"""
    spin_up_time: float = number_field(0.3, "s", gt=0, le=LONGEST)
    """time in which the sprocket accelerates smoothly to its frequency"""
    load_factor: float | None = number_field(None, "1", ge=1, le=1e4)  # some hundred make joints stretch
    """factor by which gravity, joint friction and rotary inertia are scaled up while the loop settles; null: automatic,
    at most 50; 1: no scaling"""
    steady_time: float | None = number_field(None, "s", ge=0, le=LONGEST)
    """time for which the loop must keep its shape and speed, under unscaled loads, to count as steady; null: one loop
    period or, if the loads were never scaled, the time that slow waves need to cross the loop"""
    steady_tolerance: float = number_field(0.01, "1", gt=0, le=1)
    """largest relative change of the loop's height, width and horizontal position that counts as steady"""
    extra_hold: float = number_field(0.0, "s", ge=0, le=LONGEST)
    """time for which a steady loop is held longer before its release"""
    hold_limit: float = number_field(30.0, "s", gt=0, le=LONGEST)
    """longest hold at full frequency; a loop that is not steady by then ends the walk as not_steady"""
    walk_limit: float = number_field(20.0, "s", gt=0, le=LONGEST)
    """longest time from the release to rest; a chain that still moves then ends the walk as time_limit"""
    release: Annotated[Rows | None, _COMPOUND] = None
    """motion of the sprocket after the release, as rows [time in s, x and y in m from its first position, frequency in
    Hz]; the sprocket is removed after the last row, or at the release if null"""
    floor: Annotated[FloorField, _COMPOUND] = "flat"
    """flat, or a profile of points [[x, y], …] in m whose first and last segments extend to infinity; a point
    [x, y, e, μ] gives the segment that starts there its own restitution and friction"""
    slope: float = number_field(0.0, "°", ge=-STEEPEST, le=STEEPEST)
    """inclination of the infinite floor; positive slopes descend in the walking direction"""
    distance_limit: float | None = number_field(None, "m", gt=0, le=HIGHEST)
    """distance along the floor from x = 0 at which a walk ends as distance_limit; null: no limit"""
    stop_time: float | None = number_field(None, "s", gt=0, le=LONGEST)
    """time after the release at which a walk that is not at rest ends, as planned, as finished and without Δx; null:
    no such time"""
    plane: Literal["fixed", "tilting"] = "fixed"
    """whether the plane of the chain stays upright, or can move sideways, turn and fall over"""
    lateral_speed: float = number_field(0.0, "m/s", ge=-FASTEST_TAP, le=FASTEST_TAP)
    """sideways speed of the centre of mass at the release (tilting plane only); positive to the right of the walking
    direction"""
    tilt: float = number_field(0.0, "rad", ge=-RIGHT_ANGLE, le=RIGHT_ANGLE)
    """tilt angle of the plane at the release, about the walking direction (tilting plane only); positive: the top leans
    to the left"""
    tilt_rate: float = number_field(0.0, "rad/s", ge=-FASTEST_TAP, le=FASTEST_TAP)
    """rate of change of the tilt angle at the release (tilting plane only)"""
    yaw_rate: float = number_field(0.0, "rad/s", ge=-FASTEST_TAP, le=FASTEST_TAP)
    """rate at which the plane turns about its upright axis at the release (tilting plane only); positive: anticlockwise
    from above"""
    charm_link: Whole = number_field(0, "1", ge=0, le=MOST_LINKS - 1)
    """index of the link that carries an added point mass, a charm"""
    charm_mass: float = number_field(0.0, "kg", ge=0, le=1e6)
    """mass of the charm, added at the centre of charm_link"""
    charm_inertia: float = number_field(0.0, "kg m²", ge=0, le=1e12)
    """moment of inertia of the charm about that centre"""
    charm_radius: float | None = number_field(None, "m", gt=0, le=1e3)
    """radius of the contact circles of charm_link; null: unchanged"""
    stiff_joint: Whole = number_field(0, "1", ge=0, le=MOST_LINKS - 1)
    """index of the link at whose end the joint with changed friction is"""
    joint_friction_factor: float = number_field(1.0, "1", ge=0, le=1e6)
    """factor applied to the viscous and Coulomb friction of stiff_joint; its stiffness does not change"""
    mass_gradient: float = number_field(0.0, "1", gt=-1, lt=1)
    """relative change of mass and inertia along the chain, linear from 1 − this to 1 + this times their own values"""
    link_masses: _Numbers = number_field(None, "kg")
    """mass of each link; null: that of inner and outer links"""
    link_inertias: _Numbers = number_field(None, "kg m²")
    """moment of inertia of each link; null: that of inner and outer links"""
    viscous_frictions: _Numbers = number_field(None, "N m s")
    """viscous friction of each joint; null: viscous_friction for all"""
    coulomb_frictions: _Numbers = number_field(None, "N m")
    """Coulomb friction of each joint; null: coulomb_friction for all"""
    link_radii: _Numbers = number_field(None, "m")
    """radius of the contact circles of each link; null: circle_radius for all"""

    @property
    def is_on_sprocket(self) -> bool:
        """Whether the chain starts on a sprocket."""
        return STARTS[self.start].on_sprocket

    @property
    def is_level(self) -> bool:
        """Whether the floor is y = 0."""
        return self.floor == "flat" and self.slope == 0

    def check_together(self) -> None:
        """See `Section`."""
        for name in ("charm_link", "stiff_joint"):
            if (given := getattr(self, name)) >= self.links:
                raise InputError(
                    f"{name}: expected 0 to {self.links - 1}, the links of the chain, got {given}; use one of them"
                )
        for name in OF_LINKS:
            values = getattr(self, name)
            if values is not None and len(values) != self.links:
                raise InputError(
                    f"{name}: expected {self.links} numbers, one per link, got {len(values)}; change either"
                )
            if values is not None and name.startswith("link") and min(values) == 0:
                raise InputError(f"{name}[{values.index(0)}]: expected more than 0, got 0; use more")
        if self.slope != 0 and self.floor != "flat":
            raise InputError("slope: not possible with a profile; use slope: 0, or floor: flat")
        if self.plane == "tilting" and not self.is_level:
            raise InputError("plane: 'tilting' needs a flat floor; use plane: fixed, or floor: flat and slope: 0")
        if self.plane == "fixed" and (name := next((name for name in TAP if getattr(self, name) != 0), "")):
            raise InputError(f"{name}: moves the plane of the chain, which is fixed; use plane: tilting, or 0")
        if self.release is not None and (not self.is_on_sprocket or self.plane == "tilting"):
            word = "plane: tilting" if self.is_on_sprocket else f"start: {self.start}"
            raise InputError(f"release: a motion of the sprocket is not possible with {word}; remove one")
        if self.clearance_of == "hanging" and self.start != "rest":
            raise InputError(f"clearance_of: 'hanging' needs start: rest, got {self.start}; use rest, or 'spinning'")


COMPOUND: Final = tuple(name for name, field in Scene.model_fields.items() if _COMPOUND in field.metadata)
"""Fields whose values may be lists or mappings, so that on an axis of a sweep they have names."""


def check_links_on_gpu(links: int, device: str, field: str) -> None:
    """Check that a device can carry a chain of this many links; else an `InputError` that begins with `field`."""
    if on_gpu(device) and links > MOST_LINKS_ON_GPU:
        raise InputError(
            f"{field}: expected at most {MOST_LINKS_ON_GPU} on a GPU, got {links}; use fewer, or device: cpu"
        )
