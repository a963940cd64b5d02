"""How a walk is computed: method, tolerances, limits, device."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from warpchain.inputs.methods import BURST_TOLERANCE, METHODS, METHODS_BY_NEED
from warpchain.inputs.validation import InputError, Section, Whole, number_field, shown, suggestion
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


def replaced_by(options: Mapping[str, object]) -> set[str]:
    """Options of a walk that some given ones bring anew.

    A method brings its own settings, and a tolerance also holds where joints are soft, as in a new walk.
    """
    replaced = {"soft_tolerance", "precision"} if "tolerance" in options else set()
    if "method" in options:
        replaced |= {"tolerance", "soft_tolerance", "precision"}.union(*METHODS_BY_NEED.values())
    return replaced


def _known_method(method: str) -> str:
    """The word or integrator, if there is one of this name."""
    known = (*METHODS_BY_NEED, *method_names())
    if method not in known:
        raise ValueError(f"{shown(method)} is unknown; {suggestion(method, known)}")
    return method


def _supported_device(device: str) -> str:
    """The device, if it is written as one."""
    if not re.fullmatch(rf"cpu|cuda(:\d{{1,3}})?|{FIBERS}", device):
        raise ValueError(f"{shown(device)} is no device; give cpu, cuda or cuda:N")
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
    """error allowed in a step, absolute (SI units) and relative; default of hybrid: 1e-4"""
    soft_tolerance: float | None = number_field(None, "1", **TOLERANCES)
    """tolerance while soften_drive or soften_pile softens joints; null: as tolerance"""
    flight_tolerance: float = number_field(1e-3, "1", **TOLERANCES)
    """tolerance of hybrid between impulses, while joints are rigid"""
    controller: Literal["standard", "pi"] = "standard"
    """rule for the next step: standard takes the error of the last step, pi those of the last two; hybrid takes one
    while joints are rigid"""
    contact_step: float = number_field(2e-5, "s", gt=0)
    """longest step near a contact; bounds how deep circles sink in before the contact is found"""
    soft_contact_step: float = number_field(5e-5, "s", gt=0)
    """longest step near a contact while joints are softened on the sprocket (soften_drive) or softest in the pile
    (soften_pile); without effect if contact_step is longer"""
    skin: float = number_field(2e-3, "m", gt=0)
    """margin of the neighbour list, which is built anew when a joint has moved half of it"""
    step_limit: Whole = number_field(2_000_000_000, "1", ge=1, le=10**15)
    """most steps attempted in one walk"""
    smallest_step: float = number_field(1e-12, "s", gt=0)
    """the walk ends if a step must be shorter than this"""
    self_contact: bool = True
    """whether links of the chain can touch one another"""
    rest_speed: float = number_field(0.02, "m/s", gt=0)
    """a chain is slow while its centre of mass and its links (rms) are both below this speed"""
    rest_time: float = number_field(0.05, "s", gt=0)
    """a chain that has been slow for this long is at rest"""
    record_interval: float = number_field(1e-3, "s", ge=1e-6)
    """time between two samples of a walk"""
    soften_pile: bool = False
    """whether joints become soft when the walking loop has collapsed, and softest when it encloses less than half of
    soften_area"""
    soften_area: float = number_field(0.9, "1", gt=0, lt=1)
    """a loop has collapsed when it encloses less than this fraction of its area at the release"""
    soften_drive: bool = False
    """whether joints are softened on the sprocket: softest until it has spun up, then at least soft; within 0.03 s
    after the release they return to their own values"""
    precision: Literal["double", "mixed"] = "double"
    """of steps on springs; mixed: changes within a step are in single precision, the state in double; default: mixed
    if tolerance and soft_tolerance are at least 1e-5"""
    device: Annotated[str, AfterValidator(_supported_device)] = "cpu"
    """where walks run: cpu, cuda (the first GPU) or cuda:N"""

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
        if word == "standard" and isinstance(device, str) and on_gpu(device):
            word = "explicit"
        defaults = {"method": word, **METHODS_BY_NEED.get(word, {})}
        if word == HYBRID:
            defaults["tolerance"] = BURST_TOLERANCE
        if "tolerance" in values:
            defaults.pop("soft_tolerance", None)  # an explicit tolerance is meant everywhere
        all_values = {**defaults, **{name: value for name, value in values.items() if name != "method"}}
        return {"precision": "mixed" if _tightest(all_values) >= LEAST_MIXED_BY_DEFAULT else "double", **all_values}

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        if on_gpu(self.device) and find_method(self.method).has_rigid_flight:
            raise InputError(f"method: {shown(self.method)} runs on a CPU only; give explicit, or device: cpu")
        tightest = _tightest({"tolerance": self.tolerance, "soft_tolerance": self.soft_tolerance})
        if self.precision == "mixed" and tightest < LEAST_MIXED:
            problem = f"mixed does not follow a tolerance of {tightest:g}"
            raise InputError(f"precision: {problem}; give double, or a tolerance of at least {LEAST_MIXED:g}")
        if self.smallest_step >= self.contact_step:
            raise InputError(f"smallest_step: {self.smallest_step} s is not below contact_step; give less")
        if self.soften_drive and self.record_interval > LONGEST_DRIVE_INTERVAL:
            problem = f"joints stiffen at each record_interval, and {self.record_interval} s is too long for that"
            raise InputError(
                f"soften_drive: {problem}; give at most {LONGEST_DRIVE_INTERVAL} s, or soften_drive: false"
            )
        return self
