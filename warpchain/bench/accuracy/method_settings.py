"""How walks of ``warpchain bench accuracy`` are computed: a method, its tolerance and other options, in one word."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Self

from warpchain.bench.problems.work_precision import methods
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.inputs.validation import InputError, shown, suggestion, validated
from warpchain.kernels.methods.method import find_method

SWITCHES: Final = tuple(
    name for name, field in Options.model_fields.items() if field.annotation is bool and field.default is False
)
"""Options that can be switched on beside a method."""
NUMBERS: Final = tuple(
    name
    for name, field in Options.model_fields.items()
    if field.annotation in (float, float | None) and name != "tolerance"
)
"""Options that can be given a number beside a method."""
CHOICES: Final = ("controller",)
"""Options that can be given a word beside a method."""


@dataclass(frozen=True)
class MethodSetting:
    """How walks are computed.

    Attributes:
        method: Name of the method.
        tolerance: Its tolerance.
        settings: Options that differ from their defaults, in the order of `Options`: True for those of `SWITCHES`, a
            number for those of `NUMBERS`, a word for those of `CHOICES`.
    """

    method: str
    tolerance: float
    settings: tuple[tuple[str, float | str], ...] = ()

    @classmethod
    def of(cls, options: Mapping[str, object]) -> Self:
        """The method_setting with these options; those that have their default values anyway are left out.

        Raises:
            InputError: One of them is unknown or impossible.
        """
        checked = validated(Options, options, "--methods")
        settings = tuple(
            (name, getattr(checked, name))
            for name, field in Options.model_fields.items()
            if name in (*SWITCHES, *NUMBERS, *CHOICES) and getattr(checked, name) != field.default
        )
        return cls(checked.method, checked.tolerance, settings)

    @property
    def options(self) -> dict[str, object]:
        """As `Options` takes them."""
        return {"method": self.method, "tolerance": self.tolerance, **dict(self.settings)}

    @property
    def name(self) -> str:
        """As `parse` reads it, no two alike, and good for a folder: ``dp5@1e-06+soften_pile+soften_area=0.7``."""
        settings = (name if value is True else f"{name}={_exact(value)}" for name, value in self.settings)
        return "+".join([f"{self.method}@{_exact(self.tolerance)}", *settings])

    @property
    def word(self) -> str:
        """The key of `METHODS_BY_NEED` that means the same; empty if none does."""
        return next((word for word in METHODS_BY_NEED if MethodSetting.of({"method": word}) == self), "")

    @property
    def title(self) -> str:
        """For people."""
        settings = (
            name.replace("_", " ") + ("" if value is True else f" {_exact(value)}") for name, value in self.settings
        )
        text = ", ".join([f"{self.method} at {_exact(self.tolerance)}", *settings])
        return f"{self.word}: {text}" if self.word else text

    @classmethod
    def parse(cls, text: str, device: str = "cpu") -> Self:
        """Read ``NAME[@TOLERANCE][+SWITCH][+NAME=VALUE]…``, the first name that of a method or a word for a need there.

        Raises:
            InputError: A name is unknown, or a value is no number or impossible.
        """
        start, *settings = text.split("+")
        method, at, tolerance = start.partition("@")
        known = (*METHODS_BY_NEED, *methods())
        if method not in known:
            raise InputError(f"--methods: {shown(method)} is unknown; {suggestion(method, known)}")
        options: dict[str, object] = {"method": method, "device": device}
        if at:
            options["tolerance"] = _number(text, tolerance, f"after the @; write {method}@1e-6")
        for setting in settings:
            name, equals, value = setting.partition("=")
            if equals and name in NUMBERS:
                options[name] = _number(text, value, f"after {name}=; write one")
            elif equals and name in CHOICES:
                options[name] = value
            elif name in SWITCHES and not equals:
                options[name] = True
            elif name in CHOICES:
                raise InputError(f"--methods: {name} in {shown(text)} has no value; write {name}=WORD")
            elif name in NUMBERS:
                raise InputError(f"--methods: {name} in {shown(text)} has no value; write {name}=NUMBER")
            elif name in SWITCHES:
                raise InputError(f"--methods: {name} in {shown(text)} takes no value; write +{name} to switch it on")
            else:
                raise InputError(
                    f"--methods: {shown(name)} is unknown; {suggestion(name, (*SWITCHES, *NUMBERS, *CHOICES))}"
                )
        return cls.of(options)


def _exact(value: float | str) -> str:
    """A number so that it can be read back, in six digits if they are all it has; a word as it is."""
    if isinstance(value, str):
        return value
    short = f"{value:g}"
    return short if float(short) == value else repr(float(value))


def _number(text: str, number: str, place: str) -> float:
    """The number in a text.

    Raises:
        InputError: There is none at that place.
    """
    try:
        return float(number)
    except ValueError:
        raise InputError(f"--methods: {shown(text)} has no number {place}") from None


LOOSE: Final = MethodSetting("rkf78", 1e-6)
"""What the others are tested against."""
TIGHT: Final = MethodSetting("rkf78", 1e-9)
"""What they are tested against as well where it is there, and it costs."""


def default_method_settings(device: str = "cpu") -> tuple[MethodSetting, ...]:
    """The words, and every method of the device with the settings of `explicit`, each once.

    At 1e-6 and without softer joints the implicit method and those of low order walk for half a minute and longer.
    """
    words = [MethodSetting.parse(word, device) for word in METHODS_BY_NEED]
    there = (method for method in methods() if device == "cpu" or find_method(method).runs_on_gpus)
    alike = [MethodSetting.of({**METHODS_BY_NEED["explicit"], "method": method}) for method in there]
    return tuple(dict.fromkeys((*words, *alike)))
