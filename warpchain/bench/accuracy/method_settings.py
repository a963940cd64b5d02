"""How walks of ``warpchain bench accuracy`` are computed: a method, its tolerance and other options, in one word."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Self

from warpchain.bench.record import Column
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.inputs.validation import InputError, shown, suggestion, validated
from warpchain.kernels.methods.method import find_method, method_names

_KINDS: Final[dict[object, str]] = {bool: "", float: "NUMBER", float | None: "NUMBER"}
SETTINGS: Final = {
    name: _KINDS.get(field.annotation, "WORD")
    for name, field in Options.model_fields.items()
    if name == "controller" or (field.annotation in _KINDS and name not in ("tolerance", "self_contact"))
}
"""Options that can be given beside a method → kind of their value; nothing for those that are switched on."""

SETTING_COLUMNS: Final = {
    "method": Column("1", "method of the engine"),
    "tolerance": Column("1", "its tolerance"),
    "settings": Column("1", "other options that differ from their defaults, in SI units"),
    "title": Column("1", "the same for people"),
}
"""Columns of tables whose rows are about a method setting."""


@dataclass(frozen=True)
class MethodSetting:
    """How walks are computed.

    Attributes:
        method: Name of the method.
        tolerance: Its tolerance.
        settings: Options of `SETTINGS` that differ from their defaults, in the order of `Options`.
    """

    method: str
    tolerance: float
    settings: tuple[tuple[str, float | str], ...] = ()

    @classmethod
    def of(cls, options: Mapping[str, object]) -> Self:
        """The setting with these options; those that have their default values anyway are left out.

        Raises:
            InputError: One of them is unknown or impossible.
        """
        checked = validated(Options, options, "--methods")
        values = {name: getattr(checked, name) for name in SETTINGS}
        changed = {name: value for name, value in values.items() if value != Options.model_fields[name].default}
        return cls(checked.method, checked.tolerance, tuple(changed.items()))

    @property
    def options(self) -> dict[str, object]:
        """As `Options` takes them."""
        return {"method": self.method, "tolerance": self.tolerance, **dict(self.settings)}

    @property
    def columns(self) -> dict[str, Any]:
        """Values of `SETTING_COLUMNS`."""
        return {
            "method": self.method,
            "tolerance": self.tolerance,
            "settings": dict(self.settings),
            "title": self.title,
        }

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
        known = (*METHODS_BY_NEED, *method_names())
        if method not in known:
            raise InputError(f"--methods: {shown(method)} is unknown; {suggestion(method, known)}")
        options: dict[str, object] = {"method": method, "device": device}
        if at:
            options["tolerance"] = _number(text, tolerance, f"after the @; write {method}@1e-6")
        for setting in settings:
            name, equals, value = setting.partition("=")
            if name not in SETTINGS:
                raise InputError(f"--methods: {shown(name)} is unknown; {suggestion(name, SETTINGS)}")
            kind = SETTINGS[name]
            if bool(equals) != bool(kind):
                hint = f"has no value; write {name}={kind}" if kind else f"takes no value; write +{name} to set it"
                raise InputError(f"--methods: {name} in {shown(text)} {hint}")
            if kind == "NUMBER":
                options[name] = _number(text, value, f"after {name}=; write one")
            else:
                options[name] = value if kind else True
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
    """The words, and every method of a device with the settings of `explicit`, each once.

    At 1e-6 and without softer joints the implicit method and those of low order walk for half a minute and longer.
    """
    words = [MethodSetting.parse(word, device) for word in METHODS_BY_NEED]
    there = [name for name in method_names() if device == "cpu" or find_method(name).runs_on_gpus]
    alike = [MethodSetting.of({**METHODS_BY_NEED["explicit"], "method": name}) for name in there]
    return tuple(dict.fromkeys((*words, *alike)))
