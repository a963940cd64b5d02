# Written by docs/generate_reference.py; change the code, then run that script.
from collections.abc import Mapping, Sequence
from typing import Any, Generic, Literal, TypedDict, TypeVar

import numpy as np
from numpy.typing import NDArray

from warpchain.chain.setup import State
from warpchain.inputs.starts import StartWord

T = TypeVar("T")
Int = int | np.integer[Any]
Float = float | np.integer[Any] | np.floating[Any]
List = Sequence[Any] | NDArray[Any]
Start = StartWord | State
Floor = Literal["flat"] | List

class SolverFields(TypedDict, Generic[T], total=False):
    method: T | str | None
    tolerance: T | Float | None
    soft_tolerance: T | Float | None
    flight_tolerance: T | Float
    controller: T | Literal["standard", "pi"]
    contact_step: T | Float
    soft_contact_step: T | Float
    skin: T | Float
    step_limit: T | Int
    smallest_step: T | Float
    self_contact: T | bool
    rest_speed: T | Float
    rest_time: T | Float
    record_interval: T | Float
    unusual_values: T | bool
    precision: T | Literal["double", "mixed"]
    device: T | str
    soften_area: T | Float

class WalkFields(SolverFields[T], total=False):
    links: T | Int | None
    frequency: T | Float | None
    start: T | Start | None
    phase: T | Float
    clearance: T | Float
    clearance_of: T | Literal["spinning", "hanging"]
    sprocket_radius_is: T | Literal["contact", "pitch"]
    ellipse_aspect: T | Float
    settle_time: T | Float | None
    spin_up_time: T | Float
    load_factor: T | Float | None
    steady_time: T | Float | None
    steady_tolerance: T | Float
    extra_hold: T | Float
    hold_limit: T | Float
    walk_limit: T | Float
    release: T | List | None
    floor: T | Floor
    slope: T | Float
    distance_limit: T | Float | None
    stop_time: T | Float | None
    plane: T | Literal["fixed", "tilting"]
    lateral_speed: T | Float
    tilt: T | Float
    tilt_rate: T | Float
    yaw_rate: T | Float
    charm_link: T | Int
    charm_mass: T | Float
    charm_inertia: T | Float
    charm_radius: T | Float | None
    stiff_joint: T | Int
    joint_friction_factor: T | Float
    mass_gradient: T | Float
    link_masses: T | List | None
    link_inertias: T | List | None
    viscous_frictions: T | List | None
    coulomb_frictions: T | List | None
    link_radii: T | List | None
    link_length: T | Float
    sprocket_radius: T | Float
    inner_mass: T | Float
    outer_mass: T | Float
    inner_inertia: T | Float
    outer_inertia: T | Float
    viscous_friction: T | Float
    coulomb_friction: T | Float
    floor_restitution: T | Float
    floor_friction: T | Float
    gravity: T | Float
    chain_restitution: T | Float
    chain_friction: T | Float
    sprocket_restitution: T | Float
    sprocket_friction: T | Float
    joint_stiffness: T | Float
    joint_damping: T | Float
    friction_smoothing: T | Float
    tangential_restitution: T | Float
    circle_radius: T | Float
    half_width: T | Float
    soften_pile: T | bool
    soften_drive: T | bool
    ell: T | Float
    R: T | Float
    m_inner: T | Float
    m_outer: T | Float
    I_inner: T | Float
    I_outer: T | Float
    beta: T | Float
    tau_c: T | Float
    e_fc: T | Float
    mu_fc: T | Float
    g: T | Float
    e_cc: T | Float
    mu_cc: T | Float
    e_sc: T | Float
    mu_sc: T | Float
    k: T | Float
    b: T | Float
    omega_c: T | Float
    e_t: T | Float
    r: T | Float
    h: T | Float
    n: T | Int
    nu: T | Float

class SweepFields(WalkFields[Any], total=False):
    preset: Literal["paper", "soft"] | None
    scene: Mapping[str, Any] | None
    options: Mapping[str, Any] | None
    parameters: Mapping[str, Any] | None
    samples: Int | None
    until: Float | str | Mapping[str, Float | str] | None
    at_most: Int | None
    sampler: Literal["random", "sobol", "latin_hypercube", "saltelli"] | None
    randomisations: Int | None
    distributions: Mapping[str, Any] | None
    independent: List | None
    grid: Mapping[str, Any] | None
    points: Mapping[str, Any] | None
    same_samples_along: List | None
    record: Mapping[str, Any] | None
    name: str | None
    seed: Int | None

class Columns:
    index: NDArray[Any]
    status: NDArray[Any]
    dx: NDArray[Any]
    walk_time: NDArray[Any]
    simulated_time: NDArray[Any]
    hold_time: NDArray[Any]
    drift: NDArray[Any]
    lateral_drift: NDArray[Any]
    final_tilt: NDArray[Any]
    final_yaw: NDArray[Any]
    greatest_tilt: NDArray[Any]
    fell_at: NDArray[Any]
    fell_over: NDArray[Any]
    fell_before_collapse: NDArray[Any]
    self_contact_at: NDArray[Any]
    bounces_before_self_contact: NDArray[Any]
    flight_before_self_contact: NDArray[Any]
    strands_met_at: NDArray[Any]
    bounces_before_strands_met: NDArray[Any]
    flight_before_strands_met: NDArray[Any]
    collapsed_at: NDArray[Any]
    bounces_before_collapse: NDArray[Any]
    flight_before_collapse: NDArray[Any]
    softened_at: NDArray[Any]
    bounces: NDArray[Any]
    steps_accepted: NDArray[Any]
    steps_rejected: NDArray[Any]
    impulses_floor: NDArray[Any]
    impulses_sprocket: NDArray[Any]
    impulses_self: NDArray[Any]
    greatest_opening: NDArray[Any]
    penetration_floor: NDArray[Any]
    penetration_sprocket: NDArray[Any]
    penetration_self: NDArray[Any]
    energy_kinetic_at_release: NDArray[Any]
    energy_potential_at_release: NDArray[Any]
    energy_kinetic_at_end: NDArray[Any]
    energy_potential_at_end: NDArray[Any]
    loss_joint_friction: NDArray[Any]
    loss_joint_damping: NDArray[Any]
    loss_floor: NDArray[Any]
    loss_self_contact: NDArray[Any]
    loss_softening: NDArray[Any]
    loss_joint_switch: NDArray[Any]
    energy_residual: NDArray[Any]
    sprocket_height: NDArray[Any]
    release_center_x: NDArray[Any]
    release_center_y: NDArray[Any]
    release_width: NDArray[Any]
    release_height: NDArray[Any]
    release_lowest: NDArray[Any]
    release_speed: NDArray[Any]
    energy_at_release: NDArray[Any]
    energy_error: NDArray[Any]
    link_length_drawn: NDArray[Any]
    sprocket_radius_drawn: NDArray[Any]
    inner_mass_drawn: NDArray[Any]
    outer_mass_drawn: NDArray[Any]
    inner_inertia_drawn: NDArray[Any]
    outer_inertia_drawn: NDArray[Any]
    viscous_friction_drawn: NDArray[Any]
    coulomb_friction_drawn: NDArray[Any]
    floor_restitution_drawn: NDArray[Any]
    floor_friction_drawn: NDArray[Any]
    gravity_drawn: NDArray[Any]
    chain_restitution_drawn: NDArray[Any]
    chain_friction_drawn: NDArray[Any]
    sprocket_restitution_drawn: NDArray[Any]
    sprocket_friction_drawn: NDArray[Any]
    joint_stiffness_drawn: NDArray[Any]
    joint_damping_drawn: NDArray[Any]
    friction_smoothing_drawn: NDArray[Any]
    tangential_restitution_drawn: NDArray[Any]
    circle_radius_drawn: NDArray[Any]
    half_width_drawn: NDArray[Any]
    frequency_drawn: NDArray[Any]
    phase_drawn: NDArray[Any]
    clearance_drawn: NDArray[Any]
    ellipse_aspect_drawn: NDArray[Any]
    spin_up_time_drawn: NDArray[Any]
    steady_tolerance_drawn: NDArray[Any]
    extra_hold_drawn: NDArray[Any]
    hold_limit_drawn: NDArray[Any]
    walk_limit_drawn: NDArray[Any]
    slope_drawn: NDArray[Any]
    lateral_speed_drawn: NDArray[Any]
    tilt_drawn: NDArray[Any]
    tilt_rate_drawn: NDArray[Any]
    yaw_rate_drawn: NDArray[Any]
    charm_mass_drawn: NDArray[Any]
    charm_inertia_drawn: NDArray[Any]
    joint_friction_factor_drawn: NDArray[Any]
    mass_gradient_drawn: NDArray[Any]
