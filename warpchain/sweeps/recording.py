"""What a sweep keeps of the motion of its walks, beside their rows: time series, and frames of all joints."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from warpchain.inputs.options import Options
from warpchain.inputs.validation import InputError

SERIES_INTERVAL: Final = 1e-3
"""Default time [s] between two samples of a series."""
FRAME_INTERVAL: Final = 2e-3
"""Default time [s] between two frames."""


@dataclass(frozen=True)
class Choice:
    """How often a series or frames are kept, and for which samples of each cell.

    Attributes:
        interval: time [s] between two.
        samples: numbers of the samples, sorted; None: all.
        before: time [s] before the release in which they are kept as well, with the loads of the joints; 0: none.
    """

    interval: float
    samples: tuple[int, ...] | None = None
    before: float = 0.0

    def includes(self, sample: int) -> bool:
        """Whether a sample is chosen."""
        return self.samples is None or sample in self.samples

    def covers(self, other: "Choice") -> bool:
        """Whether every sample of another choice is chosen."""
        return self.samples is None or (other.samples is not None and set(other.samples) <= set(self.samples))

    def steps(self, options: Options, path: str) -> int:
        """The interval in units of `options.record_interval`.

        Raises:
            InputError: it is no whole multiple; the message begins with `path`, where the choice was given.
        """
        ratio = self.interval / options.record_interval
        steps = round(ratio)
        if steps < 1 or abs(ratio - steps) > 1e-6 * ratio:
            raise InputError(
                f"{path}.interval: {self.interval} s is no whole multiple of options.record_interval "
                f"{options.record_interval} s; give one"
            )
        return steps

    def canonical(self) -> dict[str, Any]:
        """Its form in a sweep file."""
        before = {"before": self.before} if self.before > 0 else {}
        return {"interval": self.interval, "samples": "all" if self.samples is None else list(self.samples), **before}


@dataclass(frozen=True)
class Recording:
    """What a sweep keeps of the motion of its walks.

    Attributes:
        series: time series of the centre of mass; None: none.
        frames: positions of all joints, only of samples whose series are kept; None: none.
    """

    series: Choice | None = None
    frames: Choice | None = None

    @property
    def choices(self) -> dict[str, Choice]:
        """The choices that are made, by their keys in a sweep file."""
        given = {"series": self.series, "frames": self.frames}
        return {name: choice for name, choice in given.items() if choice is not None}

    def canonical(self) -> dict[str, Any]:
        """Its form in a sweep file."""
        return {"series": False} | {name: choice.canonical() for name, choice in self.choices.items()}

    @classmethod
    def of(cls, canonical: Mapping[str, Any]) -> "Recording":
        """The recording of a canonical form that this package has written; not checked."""
        choices = {name: given for name, given in canonical.items() if given is not False}
        for name, given in choices.items():
            samples = None if given["samples"] == "all" else tuple(given["samples"])
            choices[name] = Choice(**{**given, "samples": samples})
        return cls(**choices)
