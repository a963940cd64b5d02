"""Scene and options of a walk, and the one door through which a user's values come in.

`Scene` says what happens (how long a chain, how fast, from which height), `Options` how it is computed.
Values from keyword arguments go through `resolve`, those from a YAML file through `load_setup`; both check
everything once and raise only `InputError`.
"""

import math
import os
import re
from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Literal, Self, get_args

import yaml
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from warpchain.parameters import InputError, Parameters, refusal, shown, suggestion, validated
from warpchain.parameters import preset as parameter_preset

_STRICT: Final = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


LONGEST_STIFFENING_INTERVAL: Final = 2e-3
"""Greatest time [s] between two of the small steps in which soft joints on the sprocket become stiff."""


class Scene(BaseModel):
    """What one walk does, from hanging on the sprocket to the end.

    Raises:
        pydantic.ValidationError: a value is unknown or out of bounds, `links` is odd, or the clearance is
            that of a hanging chain although the chain never hangs.
    """

    model_config = _STRICT

    links: int = Field(
        default=60,
        ge=4,
        description="number of links around the loop, even: inner and outer links alternate",
        json_schema_extra={"unit": "1"},
    )
    frequency: float = Field(
        default=15.0,
        ge=0,
        description="turns of the sprocket per second at the release",
        json_schema_extra={"unit": "Hz"},
    )
    start: Literal["rest", "spinning", "ellipse"] = Field(
        default="rest",
        description="at rest on the sprocket, circulating on it, or a circulating ellipse without sprocket",
    )
    phase: float = Field(
        default=0.0,
        ge=0,
        lt=1,
        description="moment of the release as a fraction of a loop period",
        json_schema_extra={"unit": "1"},
    )
    clearance: float = Field(
        default=0.01,
        ge=0,
        description="height of the lowest circle above the floor, of the chain that clearance_of names",
        json_schema_extra={"unit": "m"},
    )
    clearance_of: Literal["spinning", "hanging"] = Field(
        default="spinning",
        description="the chain that clearance is measured at: spinning at the release, or hanging at rest",
    )
    sprocket_radius_is: Literal["contact", "pitch"] = Field(
        default="contact",
        description="what sprocket_radius measures: where circles touch (contact) or joints ride (pitch)",
    )
    ellipse_aspect: float = Field(
        default=1.5,
        ge=0.05,
        le=20,
        description="height over width of the starting ellipse",
        json_schema_extra={"unit": "1"},
    )
    settle_time: float = Field(
        default=0.5,
        ge=0,
        description="time for the chain to settle on the sprocket at rest",
        json_schema_extra={"unit": "s"},
    )
    spin_up_time: float = Field(
        default=2.0,
        gt=0,
        description="time in which the sprocket reaches its frequency",
        json_schema_extra={"unit": "s"},
    )
    steady_time: float = Field(
        default=0.0,
        ge=0,
        description="the loop is steady once it has kept its shape and speed for this long, at least a loop period",
        json_schema_extra={"unit": "s"},
    )
    steady_tolerance: float = Field(
        default=0.01,
        gt=0,
        le=1,
        description="relative change of the loop's height and width that still counts as kept",
        json_schema_extra={"unit": "1"},
    )
    hold_limit: float = Field(
        default=30.0,
        gt=0,
        description="longest time at full frequency to become steady; then the walk ends as not_steady",
        json_schema_extra={"unit": "s"},
    )
    walk_limit: float = Field(
        default=20.0,
        gt=0,
        description="longest time from the release to rest; then the walk ends as time_limit",
        json_schema_extra={"unit": "s"},
    )

    @field_validator("links")
    @classmethod
    def _links_even(cls, links: int) -> int:
        if links % 2:
            raise refusal("links", f"{links} is odd; a chain alternates inner and outer links, so give an even number")
        return links

    @model_validator(mode="after")
    def _hanging_needs_rest(self) -> Self:
        if self.clearance_of == "hanging" and self.start != "rest":
            raise refusal(
                "clearance_of",
                f"'hanging' needs a chain that hangs, but start is {self.start!r}; "
                "give 'spinning' here, or start: rest",
            )
        return self


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

    model_config = _STRICT

    method: Literal["rkf78", "dp5", "bs32", "os32", "rodas4p", "rodas5p", "hybrid"] = Field(
        default="rkf78",
        description="embedded pair: Fehlberg 7(8), Dormand–Prince 5(4), Bogacki–Shampine 3(2), six stages of order "
        "3(2) for long stable steps, RODAS4P 4(3) or RODAS5P 5(4), the last two implicit; "
        "hybrid: rigid joints between impulses, os32 around them",
    )
    tolerance: float = Field(
        default=1e-6,
        ge=1e-13,
        le=1e-1,
        description="error allowed in a step, absolute (SI units) and relative alike; of method hybrid 1e-4 by default",
        json_schema_extra={"unit": "1"},
    )
    soft_tolerance: float | None = Field(
        default=None,
        ge=1e-13,
        le=1e-1,
        description="the same where soften_drive or soften_pile has made joints soft or softest; null: tolerance",
        json_schema_extra={"unit": "1"},
    )
    flight_tolerance: float = Field(
        default=1e-3,
        ge=1e-13,
        le=1e-1,
        description="of method hybrid: error allowed in a step between impulses, where joints are taken for rigid",
        json_schema_extra={"unit": "1"},
    )
    controller: Literal["standard", "pi"] = Field(
        default="standard",
        description="rule for the next step: from this error alone, or proportional–integral; "
        "implicit methods have one of the latter kind for both",
    )
    contact_step: float = Field(
        default=2e-5,
        gt=0,
        description="longest step near a contact; bounds how deep circles sink in before a contact is seen",
        json_schema_extra={"unit": "s"},
    )
    soft_contact_step: float = Field(
        default=5e-5,
        gt=0,
        description="longest step near a contact where soften_drive makes joints soft, or soften_pile softest, unless "
        "contact_step is longer",
        json_schema_extra={"unit": "s"},
    )
    skin: float = Field(
        default=2e-3,
        gt=0,
        description="margin of the neighbour list; the list lasts until some joint has moved half of it",
        json_schema_extra={"unit": "m"},
    )
    step_limit: int = Field(
        default=2_000_000_000,
        ge=1,
        le=10**15,
        description="most steps tried in one walk, accepted and rejected",
        json_schema_extra={"unit": "1"},
    )
    smallest_step: float = Field(
        default=1e-12,
        gt=0,
        description="a step that has to be shorter than this ends the walk",
        json_schema_extra={"unit": "s"},
    )
    self_contact: bool = Field(default=True, description="whether links of the chain can touch one another")
    rest_speed: float = Field(
        default=0.02,
        gt=0,
        description="a chain is slow while its centre of mass and its links (rms) are both below this speed",
        json_schema_extra={"unit": "m/s"},
    )
    rest_time: float = Field(
        default=0.05,
        gt=0,
        description="a chain that has been slow for this long is at rest",
        json_schema_extra={"unit": "s"},
    )
    record_interval: float = Field(
        default=1e-3,
        ge=1e-6,
        description="time between two recorded points of the centre of mass",
        json_schema_extra={"unit": "s"},
    )
    soften_pile: bool = Field(
        default=False,
        description="whether the joints of a walking loop that has collapsed become soft, and softest once it encloses "
        "half of soften_area",
    )
    soften_area: float = Field(
        default=0.9,
        gt=0,
        lt=1,
        description="a loop has collapsed when it encloses less than this fraction of its area at the release",
        json_schema_extra={"unit": "1"},
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
        if self.soften_drive and self.record_interval > LONGEST_STIFFENING_INTERVAL:
            raise refusal(
                "soften_drive",
                f"joints stiffen at each record_interval, and {self.record_interval} s is too long for that; "
                f"give a record_interval of at most {LONGEST_STIFFENING_INTERVAL} s, or soften_drive: false",
            )
        return self


def joint_radius(scene: Scene, parameters: Parameters) -> float:
    """Distance from the sprocket's centre at which the joints ride, in m."""
    if scene.sprocket_radius_is == "pitch":
        return parameters.sprocket_radius
    return parameters.sprocket_radius + parameters.circle_radius


def contact_radius(scene: Scene, parameters: Parameters) -> float:
    """Radius of the sprocket that the circles of the links touch, in m.

    Raises:
        InputError: the sprocket radius is that of the joints and leaves nothing to touch.
    """
    if scene.sprocket_radius_is == "contact":
        return parameters.sprocket_radius
    if parameters.sprocket_radius <= parameters.circle_radius:
        raise InputError(
            f"parameters.sprocket_radius: {parameters.sprocket_radius} is not greater than the circle radius "
            f"{parameters.circle_radius}, as sprocket_radius_is: pitch needs; give a larger radius"
        )
    return parameters.sprocket_radius - parameters.circle_radius


def fewest_links(scene: Scene, parameters: Parameters) -> int:
    """Least even number of links whose loop can hang round the sprocket.

    A link whose joints are both at least ρ from the centre is seen from there under an angle of at most
    2 asin(ℓ / 2ρ), and a loop round the sprocket needs 2π in all: n ≥ π / asin(ℓ / 2ρ), with ρ of
    `joint_radius`.
    """
    sine = parameters.link_length / (2 * joint_radius(scene, parameters))
    around = math.ceil(math.pi / math.asin(sine)) if sine < 1 else 2
    return max(4, around + around % 2)


def check_scene(scene: Scene, parameters: Parameters) -> None:
    """Check what a scene and its parameters must fulfil together.

    A scene that starts as an ellipse has no sprocket, so nothing is asked of it.

    Raises:
        InputError: the chain is too short for its sprocket, or `contact_radius` finds none.
    """
    if scene.start == "ellipse":
        return
    contact_radius(scene, parameters)
    fewest = fewest_links(scene, parameters)
    if scene.links < fewest:
        raise InputError(
            f"scene.links: {scene.links} links of {parameters.link_length} m do not reach round the sprocket "
            f"whose joints ride at {joint_radius(scene, parameters):g} m; give at least {fewest}"
        )


@dataclass(frozen=True)
class Setup:
    """Everything that says what one walk is: checked, complete, and named by the preset it started from."""

    preset: str
    parameters: Parameters
    scene: Scene
    options: Options


def resolve(
    preset: str,
    *,
    scene: Mapping[str, object],
    options: Mapping[str, object],
    parameters: Mapping[str, object],
) -> Setup:
    """Check a user's values and complete them.

    Args:
        preset: name of the parameter preset to start from.
        scene: fields of `Scene` that differ from their defaults.
        options: fields of `Options` that differ from their defaults.
        parameters: fields of `Parameters` that differ from the preset.

    Raises:
        InputError: anything is wrong; one line with the field's path and the remedy.
    """
    for path, values in (("scene", scene), ("options", options), ("parameters", parameters)):
        if not isinstance(values, Mapping):
            raise InputError(f"{path}: {shown(values)} is not a mapping; give names with values")
    setup = Setup(
        preset=preset,
        parameters=parameter_preset(preset).with_values(parameters),
        scene=validated(Scene, scene, "scene"),
        options=validated(Options, options, "options"),
    )
    check_scene(setup.scene, setup.parameters)
    return setup


_SECTIONS: Final = ("scene", "options", "parameters")


def load_setup(path: str | os.PathLike[str]) -> Setup:
    """Read a setup from a YAML file with the keys `preset` (required), `scene`, `options`, `parameters`.

    `1e9` is a number, as in YAML 1.2, and so is `1_000`; `060` and `1:30`, which the versions of YAML read
    differently, are text and therefore refused.

    Raises:
        InputError: the file cannot be read, is not YAML, gives a key twice, or holds what `resolve` refuses.
    """
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise InputError(f"{path}: no mapping at the top; give the keys preset, {', '.join(_SECTIONS)}")
    for key in content:
        if key != "preset" and key not in _SECTIONS:
            raise InputError(f"{shown(key)}: unknown key; {suggestion(key, ('preset', *_SECTIONS))}")
    if "preset" not in content:
        raise InputError("preset: missing; name the parameters to start from, such as preset: paper")
    # A section with nothing under it is read as None; it changes nothing.
    sections = {name: {} if content.get(name) is None else content[name] for name in _SECTIONS}
    return resolve(content["preset"], **sections)


def read_yaml(path: str | os.PathLike[str]) -> object:
    """Content of a YAML file, see `load_setup` for its numbers.

    Raises:
        InputError: the file cannot be read, is not YAML or gives a key twice.
    """
    try:
        return yaml.load(Path(path).read_text(encoding="utf-8"), Loader=_Loader)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; give the path of a readable YAML file") from None
    except yaml.MarkedYAMLError as error:
        line = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        raise InputError(f"{path}{line}: {error.problem or error.context}; correct the YAML") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}; correct the YAML") from None


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader, but a repeated key is an error and a number means what it looks like."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        """Mapping of a node; PyYAML itself lets the last of several equal keys win."""
        seen = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if isinstance(key, yaml.ScalarNode) and (key.tag, key.value) in seen:
                problem = f"key {shown(key.value)} is given twice"
                raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
            seen.add((key.tag, str(key.value)))
        return super().construct_mapping(node, deep)


# YAML 1.1, PyYAML's dialect, reads 060 as 48 and 1:30 as 90, and takes 1e9 for text.
_INTEGER: Final = re.compile(r"[-+]?(?:0|[1-9][0-9_]*)$")
_FLOAT: Final = re.compile(
    r"""[-+]?(?:\.[0-9]+|[0-9]+\.[0-9]*)(?:[eE][-+]?[0-9]+)?$
      | [-+]?[0-9]+[eE][-+]?[0-9]+$
      | [-+]?\.(?:inf|Inf|INF)$
      | \.(?:nan|NaN|NAN)$""",
    re.VERBOSE,
)
_NUMBERS: Final = {"tag:yaml.org,2002:int": _INTEGER, "tag:yaml.org,2002:float": _FLOAT}
_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag not in _NUMBERS]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
for _tag, _pattern in _NUMBERS.items():
    _Loader.add_implicit_resolver(_tag, _pattern, list("-+.0123456789"))
