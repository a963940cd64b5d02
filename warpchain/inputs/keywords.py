"""Types of keyword arguments, for editors and type checkers; what is checked when a program runs stands in the models.

Type checkers cannot read pydantic's models for this. A test compares the two, name by name and type by type.
"""

from collections.abc import Sequence
from typing import Any, Literal, TypedDict

import numpy as np

Whole = int | np.integer[Any]
"""A whole number."""
Number = float | np.floating[Any] | np.integer[Any]
"""A number."""
Truth = bool | np.bool_
"""A truth value."""

Floor = Literal["flat"] | Sequence[Sequence[Number]]
"""A floor: flat, or points x, y."""

Preset = Literal["paper", "soft"]
"""A key of `warpchain.inputs.parameters.PRESETS`."""
Method = Literal["standard", "explicit", "reference", "rkf78", "dp5", "bs32", "os32", "hybrid"]
"""What a user may write for `method`; see `warpchain.inputs.methods`."""
Sampler = Literal["random", "sobol", "latin_hypercube", "saltelli"]
"""One of `warpchain.sweeps.designs.SAMPLERS`."""


class ParameterSymbols(TypedDict, total=False):
    """Symbols of fields of `Parameters`, which may be given instead of their names."""

    ell: Number
    R: Number
    m_inner: Number
    m_outer: Number
    I_inner: Number
    I_outer: Number
    beta: Number
    tau_c: Number
    e_fc: Number
    mu_fc: Number
    g: Number
    e_cc: Number
    mu_cc: Number
    e_sc: Number
    mu_sc: Number
    k: Number
    b: Number
    omega_c: Number
    e_t: Number
    r: Number
    h: Number


class ParameterSettings(ParameterSymbols, total=False):
    """Fields of `Parameters`."""

    link_length: Number
    sprocket_radius: Number
    inner_mass: Number
    outer_mass: Number
    inner_inertia: Number
    outer_inertia: Number
    viscous_friction: Number
    coulomb_friction: Number
    floor_restitution: Number
    floor_friction: Number
    gravity: Number
    chain_restitution: Number
    chain_friction: Number
    sprocket_restitution: Number
    sprocket_friction: Number
    joint_stiffness: Number
    joint_damping: Number
    friction_smoothing: Number
    tangential_restitution: Number
    circle_radius: Number
    half_width: Number


class OtherScene(TypedDict, total=False):
    """Fields of `Scene` that are no named arguments of `warpchain.walk`."""

    phase: Number
    clearance: Number
    clearance_of: Literal["spinning", "hanging"]
    sprocket_radius_is: Literal["contact", "pitch"]
    ellipse_aspect: Number
    settle_time: Number | None
    spin_up_time: Number
    load_factor: Number | None
    steady_time: Number | None
    steady_tolerance: Number
    further_hold: Number
    hold_limit: Number
    walk_limit: Number
    floor: Floor
    slope: Number
    distance_limit: Number | None
    plane: Literal["fixed", "tilting"]
    lateral_speed: Number
    tilt: Number
    tilt_rate: Number
    yaw_rate: Number


class SceneSettings(OtherScene, total=False):
    """Fields of `Scene`, and symbols of two of them."""

    n: Whole
    nu: Number
    links: Whole
    frequency: Number
    start: Literal["rest", "spinning", "ellipse"]


class OtherOptions(TypedDict, total=False):
    """Fields of `Options` that are no named arguments of `warpchain.simulate`, and make sense there."""

    soft_tolerance: Number | None
    flight_tolerance: Number
    controller: Literal["standard", "pi"]
    contact_step: Number
    soft_contact_step: Number
    skin: Number
    step_limit: Whole
    smallest_step: Number
    rest_speed: Number
    rest_time: Number
    record_interval: Number
    soften_area: Number


class WalkOptions(OtherOptions, total=False):
    """Fields of `Options` that are no named arguments of `warpchain.walk`."""

    self_contact: Truth
    soften_pile: Truth
    soften_drive: Truth
    device: str


class OptionSettings(WalkOptions, total=False):
    """Fields of `Options`."""

    method: Method
    tolerance: Number


class WalkSettings(ParameterSettings, OtherScene, WalkOptions, total=False):
    """Fields that are no named arguments of `warpchain.walk`."""
