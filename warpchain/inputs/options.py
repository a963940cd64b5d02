"""How a walk is computed: method, tolerances, limits, device."""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, Literal, Self, get_args

from pydantic import BaseModel, Field, field_validator, model_validator

from warpchain.inputs.validation import STRICT, number_field, refusal, shown, suggestion

LONGEST_DRIVE_INTERVAL: Final = 2e-3
"""Greatest time [s] between two of the small steps in which soft joints become stiff, or multiplied loads fall."""

_LOOSE: Final = {
    "tolerance": 1e-3,
    "soft_tolerance": 3e-3,
    "controller": "pi",
    "soften_pile": True,
    "soften_drive": True,
}
BURST_TOLERANCE: Final = 1e-4
"""Of method `hybrid` unless one says otherwise: its bursts are of order 3, and at 1e-6 slower than `rkf78`.

1e-3 is enough for ensembles of walks and takes half the time, but without any dissipation energy drifts.
"""
METHODS_BY_NEED: Final[Mapping[str, Mapping[str, object]]] = MappingProxyType(
    {
        "standard": MappingProxyType({"method": "hybrid", **_LOOSE}),
        "explicit": MappingProxyType({"method": "os32", **_LOOSE}),
        "reference": MappingProxyType({"method": "rkf78", "tolerance": 1e-6}),
    }
)
"""One word for a method and its settings, see `Options.method`.

The ensembles of `standard` and `explicit` could not be told from those of `reference`, which is the paper's. The first
is the cheapest on a CPU; on a GPU, where it saves nothing, the word means the second.
"""


class Options(BaseModel):
    """How a walk is computed.

    `method` also takes a word of `METHODS_BY_NEED`: then the word's settings are what the fields default to, but with
    a `tolerance` its `soft_tolerance` does not apply. A method that is named itself has the defaults below, `hybrid`
    but for a `tolerance` of `BURST_TOLERANCE`.

    Raises:
        pydantic.ValidationError: a value is unknown or out of bounds, the smallest step is not below the
            contact step, or the device is not supported.
    """

    model_config = STRICT

    method: Literal["rkf78", "dp5", "bs32", "os32", "rodas5p", "hybrid"] = Field(
        default="rkf78",
        description="embedded pair: Fehlberg 7(8), Dormand–Prince 5(4), Bogacki–Shampine 3(2), six stages of order "
        "3(2) for long stable steps, RODAS5P 5(4), which is implicit; "
        "hybrid: rigid joints between impulses, os32 around them",
    )
    tolerance: float = number_field(
        1e-6,
        "1",
        "error allowed in a step, absolute (SI units) and relative alike; of method hybrid 1e-4 by default",
        ge=1e-13,
        le=1e-1,
    )
    soft_tolerance: float | None = number_field(
        None,
        "1",
        "the same where soften_drive or soften_pile has made joints soft or softest; null: tolerance",
        ge=1e-13,
        le=1e-1,
    )
    flight_tolerance: float = number_field(
        1e-3,
        "1",
        "of method hybrid: error allowed in a step between impulses, where joints are taken for rigid",
        ge=1e-13,
        le=1e-1,
    )
    controller: Literal["standard", "pi"] = Field(
        default="standard",
        description="rule for the next step: from this error alone, or proportional–integral; "
        "implicit methods have one of the latter kind for both",
    )
    contact_step: float = number_field(
        2e-5, "s", "longest step near a contact; bounds how deep circles sink in before a contact is seen", gt=0
    )
    soft_contact_step: float = number_field(
        5e-5,
        "s",
        "longest step near a contact where soften_drive makes joints soft, or soften_pile softest, unless "
        "contact_step is longer; long or slow loops take shorter ones just before the release",
        gt=0,
    )
    skin: float = number_field(
        2e-3, "m", "margin of the neighbour list; the list lasts until some joint has moved half of it", gt=0
    )
    step_limit: int = number_field(2_000_000_000, "1", "most steps attempted in one walk", ge=1, le=10**15)
    smallest_step: float = number_field(1e-12, "s", "a step that has to be shorter than this ends the walk", gt=0)
    self_contact: bool = Field(default=True, description="whether links of the chain can touch one another")
    rest_speed: float = number_field(
        0.02, "m/s", "a chain is slow while its centre of mass and its links (rms) are both below this speed", gt=0
    )
    rest_time: float = number_field(0.05, "s", "a chain that has been slow for this long is at rest", gt=0)
    record_interval: float = number_field(1e-3, "s", "time between two samples of a walk", ge=1e-6)
    soften_pile: bool = Field(
        default=False,
        description="whether the joints of a walking loop that has collapsed become soft, and softest once it encloses "
        "half of soften_area",
    )
    soften_area: float = number_field(
        0.9, "1", "a loop has collapsed when it encloses less than this fraction of its area at the release", gt=0, lt=1
    )
    soften_drive: bool = Field(
        default=False,
        description="whether joints are softest until the sprocket has spun up, soft or softer until the release, and "
        "have their own values from 0.03 s after the release",
    )
    device: str = Field(default="cpu", description="where walks run: cpu, cuda (the first GPU) or cuda:N")

    @model_validator(mode="before")
    @classmethod
    def _method_by_need(cls, values: object) -> object:
        if not isinstance(values, Mapping):
            return values
        word = values.get("method", "standard")
        known = (*METHODS_BY_NEED, *get_args(cls.model_fields["method"].annotation))
        if isinstance(word, str) and word not in known:
            raise refusal("method", f"{shown(word)} is unknown; {suggestion(word, known)}")
        if word == "hybrid":
            return {"tolerance": BURST_TOLERANCE, **values}
        if not isinstance(word, str) or word not in METHODS_BY_NEED:
            return values
        if word == "standard" and str(values.get("device")).startswith("cuda"):
            word = "explicit"
        defaults = dict(METHODS_BY_NEED[word])
        if "tolerance" in values:
            defaults.pop("soft_tolerance", None)  # whoever asks for a tolerance means it everywhere
        return {**defaults, **{name: value for name, value in values.items() if name != "method"}}

    @field_validator("device")
    @classmethod
    def _device_supported(cls, device: str) -> str:
        if not re.fullmatch(r"cpu|cuda(:\d{1,3})?", device):
            raise refusal("device", f"{shown(device)} is no device; give cpu, cuda or cuda:N")
        return device

    @model_validator(mode="after")
    def _steps_ordered(self) -> Self:
        if self.smallest_step >= self.contact_step:
            raise refusal(
                "smallest_step",
                f"{self.smallest_step} is not smaller than contact_step {self.contact_step} s; give a smaller step",
            )
        return self

    @model_validator(mode="after")
    def _stiffens_in_small_steps(self) -> Self:
        if self.soften_drive and self.record_interval > LONGEST_DRIVE_INTERVAL:
            raise refusal(
                "soften_drive",
                f"joints stiffen at each record_interval, and {self.record_interval} s is too long for that; "
                f"give a record_interval of at most {LONGEST_DRIVE_INTERVAL} s, or soften_drive: false",
            )
        return self
