"""The options of a walk: integrator, tolerances, softening, limits and device."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from warpchain.inputs.methods import BURST_TOLERANCE, METHODS, METHODS_BY_NEED, meant_by
from warpchain.inputs.validation import InputError, Section, Whole, number_field, shown, suggestion, validated
from warpchain.kernels.methods.explicit_tableaus import HYBRID
from warpchain.kernels.methods.method import find_method, method_names

LONGEST_DRIVE_INTERVAL: Final = 2e-3
"""Greatest time [s] between two of the small steps in which soft joints become stiff, or multiplied loads fall."""

TOLERANCES: Final[Mapping[str, Any]] = {"ge": 1e-13, "le": 1e-1}

LEAST_MIXED: Final = 1e-6
"""Least tolerance that steps in mixed precision follow: below it their rounding takes part in the error."""

LEAST_MIXED_BY_DEFAULT: Final = 1e-5
"""Least tolerance at which they are the default."""

FIBERS: Final = "fibers"
"""Device that runs a GPU's kernels on a CPU, slowly, so that tests pass through all that the host does for a GPU."""


def on_gpu(device: str) -> bool:
    """Whether a device runs a GPU's kernels."""
    return device != "cpu"


def _known_method(method: str) -> str:
    """The word or integrator, if there is one of this name."""
    known = (*METHODS_BY_NEED, *method_names())
    if method not in known:
        raise ValueError(f"unknown method {shown(method)}; {suggestion(method, known)}")
    return method


def _supported_device(device: str) -> str:
    """The device, if it is written as one."""
    if not re.fullmatch(rf"cpu|cuda(:\d{{1,3}})?|{FIBERS}", device):
        raise ValueError(f"expected cpu, cuda or cuda:N, got {shown(device)}; use one of them")
    return device


def _tightest(values: Mapping[str, object]) -> float:
    """The lesser of a walk's tolerances on springs; what is no number is refused elsewhere."""
    given = [values.get("tolerance", 1e-6), values.get("soft_tolerance")]
    return min((float(value) for value in given if isinstance(value, int | float)), default=0.0)


class Options(Section):
    """How a walk is computed.

    `method` is an integrator or a word of `METHODS_BY_NEED`. A word supplies its own defaults; an explicit `tolerance`
    also replaces its `soft_tolerance`. An integrator has the defaults below, except that the default `tolerance` of
    `hybrid` is `BURST_TOLERANCE`.
    """

    method: Annotated[str, AfterValidator(_known_method)] = Field(
        default="standard",
        json_schema_extra={"enum": [*METHODS_BY_NEED, *METHODS]},
        description=f"{', '.join(METHODS_BY_NEED)}: an integrator with its settings; "
        + "; ".join(f"{name}: {title}" for name, title in METHODS.items()),
    )
    tolerance: float = number_field(1e-6, "1", **TOLERANCES)
    """local error allowed in a step, absolute (SI units) and relative; the default of hybrid is 1e-4"""
    soft_tolerance: float | None = number_field(None, "1", **TOLERANCES)
    """tolerance while soften_drive or soften_pile softens the joints; null: the same as tolerance"""
    flight_tolerance: float = number_field(1e-3, "1", **TOLERANCES)
    """tolerance of hybrid between impulses, while the joints are rigid"""
    controller: Literal["standard", "pi"] = "standard"
    """step-size controller: standard uses the last error (integral control), pi the last two (proportional–integral);
    hybrid always uses integral control while the joints are rigid"""
    contact_step: float = number_field(2e-5, "s", gt=0)
    """longest step near a contact; it bounds the penetration before a contact is detected"""
    soft_contact_step: float = number_field(5e-5, "s", gt=0)
    """longest step near a contact while joints are softened on the sprocket (soften_drive) or have their softest values
    in the pile (soften_pile); it has no effect if contact_step is longer"""
    skin: float = number_field(2e-3, "m", gt=0)
    """margin of the neighbour list, which is rebuilt before a pair of links that it lacks can touch"""
    step_limit: Whole = number_field(2_000_000_000, "1", ge=1, le=10**15)
    """largest number of attempted steps in one walk"""
    smallest_step: float = number_field(1e-12, "s", gt=0)
    """step size below which the walk ends as step_too_small"""
    self_contact: bool = True
    """whether links of the chain collide with one another"""
    rest_speed: float = number_field(0.02, "m/s", gt=0)
    """speed below which the centre of mass and the links (RMS) must both stay for the chain to count as slow"""
    rest_time: float = number_field(0.05, "s", gt=0)
    """time for which a chain must be slow to count as at rest"""
    record_interval: float = number_field(1e-3, "s", ge=1e-6)
    """time between two points of a walk's time series"""
    soften_pile: bool = False
    """whether joints are softened once the walking loop encloses less than soften_area of its area at the release, and
    get their softest values below half of that threshold"""
    soften_area: float = number_field(0.9, "1", gt=0, lt=1)
    """softening threshold of soften_pile: fraction of the loop's area at the release"""
    soften_drive: bool = False
    """whether joints are softened on the sprocket: softest until it has spun up, then as soft as the loop's tension
    allows; within 0.03 s after the release they regain their own values"""
    unusual_values: bool = False
    """whether lengths, masses, moments of inertia and gravity far from Table 1's are meant; otherwise a value more than
    10 times as large, or less than a tenth, is refused as a probable mistake of its unit"""
    precision: Literal["double", "mixed"] = "double"
    """precision of steps on springs; mixed: changes within a step are in single precision, and the state in double;
    the default is mixed if tolerance and soft_tolerance are at least 1e-5"""
    device: Annotated[str, AfterValidator(_supported_device)] = "cpu"
    """device that runs the walks: cpu, cuda (the first GPU) or cuda:N"""

    @classmethod
    def chosen(cls, given: Mapping[str, object], *, tilts: bool = False, loads: bool = False) -> Self:
        """The checked options that a user gives for a walk whose plane tilts, or whose joint loads are recorded.

        `standard` then means `explicit`, as it does on a GPU: rigid flights have neither.
        """
        method = meant_by(given.get("method", "standard"), can_be_rigid=not (tilts or loads))
        return validated(cls, {**given, "method": method}, "options")

    def beside(self, given: Mapping[str, object]) -> dict[str, object]:
        """The values of these options that stay beside some given ones.

        A method brings its own settings, and a tolerance also holds where joints are soft, as in a new walk.
        """
        replaced = {"soft_tolerance", "precision"} if "tolerance" in given else set()
        if "method" in given:
            replaced |= {"tolerance", "soft_tolerance", "precision"}.union(*METHODS_BY_NEED.values())
        return self.model_dump(exclude=replaced)

    @property
    def is_mixed(self) -> bool:
        """Whether stages of steps are in single precision."""
        return self.precision == "mixed"

    @model_validator(mode="before")
    @classmethod
    def _with_defaults_of_method(cls, values: object) -> object:
        if not isinstance(values, Mapping):
            return values
        word, device = values.get("method", "standard"), values.get("device")
        if not isinstance(word, str):
            return values
        word = str(meant_by(word, can_be_rigid=not (isinstance(device, str) and on_gpu(device))))
        defaults = {"method": word, **METHODS_BY_NEED.get(word, {})}
        if word == HYBRID:
            defaults["tolerance"] = BURST_TOLERANCE
        if "tolerance" in values:
            defaults.pop("soft_tolerance", None)  # an explicit tolerance is meant everywhere
        all_values = {**defaults, **{name: value for name, value in values.items() if name != "method"}}
        return {"precision": "mixed" if _tightest(all_values) >= LEAST_MIXED_BY_DEFAULT else "double", **all_values}

    def check_together(self) -> None:
        """See `Section`."""
        if on_gpu(self.device) and find_method(self.method).has_rigid_flight:
            raise InputError(f"method: {shown(self.method)} runs only on a CPU; use explicit, or device: cpu")
        tightest = _tightest({"tolerance": self.tolerance, "soft_tolerance": self.soft_tolerance})
        if self.precision == "mixed" and tightest < LEAST_MIXED:
            problem = f"mixed cannot meet a tolerance of {tightest:g}"
            raise InputError(f"precision: {problem}; use double, or a tolerance of at least {LEAST_MIXED:g}")
        if self.smallest_step >= self.contact_step:
            raise InputError(f"smallest_step: expected less than contact_step, got {self.smallest_step} s; use less")
        if self.soften_drive and self.record_interval > LONGEST_DRIVE_INTERVAL:
            problem = f"joints stiffen at each record_interval, and {self.record_interval} s is too long for that"
            raise InputError(f"soften_drive: {problem}; use at most {LONGEST_DRIVE_INTERVAL} s, or soften_drive: false")
