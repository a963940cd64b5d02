"""Which motions a sweep records in addition to the numbers of its walks: time series and frames of all joints."""

from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, Discriminator, Field, Strict, Tag, model_validator

from warpchain.chain.keep import FRAME_INTERVAL, LONGEST_INTERVAL, NOTHING, Keep
from warpchain.inputs.options import Options
from warpchain.inputs.validation import STRICT, InputError, number_field

SERIES_INTERVAL: Final = 1e-3
"""Default time [s] between two samples of a series."""

_Numbers = Annotated[
    tuple[Annotated[int, Field(ge=0, le=2**30)], ...],
    Strict(False),
    Field(min_length=1),
    AfterValidator(lambda given: tuple(sorted(set(given)))),
]
_Samples = Annotated[
    Annotated[Literal["all"], Tag("(all)")] | Annotated[_Numbers, Tag("(numbers)")],
    Discriminator(lambda given: "(numbers)" if isinstance(given, list | tuple) else "(all)"),
]


def _interval(default: float) -> Any:
    text = "time between two, a whole multiple of `record_interval`"
    return number_field(default, "s", text, gt=0, le=LONGEST_INTERVAL)


class Series(BaseModel):
    """How often the centre of mass is kept, and of which samples of each cell."""

    model_config = STRICT

    interval: float = _interval(SERIES_INTERVAL)
    samples: _Samples = Field(
        "all",
        description="`all` or numbers of samples, such as `[0, 1]`, the same in each cell",
        validate_default=False,
    )

    def includes(self, sample: int) -> bool:
        """Whether a sample is chosen."""
        return self.samples == "all" or sample in self.samples

    def steps(self, options: Options, path: str) -> int:
        """The interval in units of `options.record_interval`, if whole; else an `InputError` beginning with `path`."""
        ratio = self.interval / options.record_interval
        steps = round(ratio)
        if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
            raise InputError(
                f"{path}.interval: expected a multiple of options.record_interval, got {self.interval} s; use one"
            )
        return steps


class Frames(Series):
    """How often all joints are kept, and of which samples of each cell."""

    interval: float = _interval(FRAME_INTERVAL)
    before: float | None = number_field(
        None,
        "s",
        "time before the release that is kept as well, with the loads of the joints",
        gt=0,
        le=LONGEST_INTERVAL,
    )


_SWITCH: Final = BeforeValidator(
    lambda given: ({} if given else None) if isinstance(given, bool) else given, json_schema_input_type=bool | Frames
)


class Recording(BaseModel):
    """What a sweep keeps of the motion of its walks.

    Raises:
        pydantic.ValidationError: a value is refused, or frames are chosen of samples whose series are not.
    """

    model_config = STRICT

    series: Annotated[Series | None, _SWITCH] = Field(default=None, description="time series of the centre of mass")
    frames: Annotated[Frames | None, _SWITCH] = Field(default=None, description="positions of all joints")

    @model_validator(mode="after")
    def _frames_beside_series(self) -> Self:
        series, frames = self.series and self.series.samples, self.frames and self.frames.samples
        if frames and series != "all" and (not series or frames == "all" or not set(frames) <= set(series)):
            raise InputError("frames: expected only samples with series; add these samples to series")
        return self

    @property
    def choices(self) -> dict[str, Series]:
        """The choices that are made, by their keys in a sweep file."""
        return {name: choice for name, choice in (("series", self.series), ("frames", self.frames)) if choice}

    def keep(self, sample: int, options: Options) -> Keep:
        """What is kept of a sample of a cell with these options."""
        if not self.choices:
            return NOTHING
        chosen = {name: choice for name, choice in self.choices.items() if choice.includes(sample)}
        every = {name: choice.steps(options, f"sweep.record.{name}") for name, choice in chosen.items()}
        before = self.frames.before if self.frames and "frames" in chosen else None
        return Keep(series_every=every.get("series"), frame_every=every.get("frames"), before=before or 0.0)

    def canonical(self) -> dict[str, Any]:
        """Its form in a sweep file."""
        return {"series": False} | self.model_dump(mode="json", exclude_none=True)
