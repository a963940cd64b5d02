"""Messages to a live page: frames while a walk is computed, results, and code that repeats the walk."""

import json
import math
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, cast

import numpy as np
import yaml

from warpchain.chain.setup import DEFAULT_PRESET, Setup
from warpchain.inputs.arrays import Array
from warpchain.inputs.fields import SECTIONS, by_section
from warpchain.inputs.validation import json_value
from warpchain.pictures.player import player_data
from warpchain.results.walk_result import WalkResult
from warpchain.walks.walk_numbers import WalkNumbers as Walk
from warpchain.walks.walk_phases import Progress

_OPTIONS: Final = ("links", "frequency", "start")
"""Fields with an option of their own on the command line of `warpchain walk`, which come first there."""


class Film:
    """The frames of a walk that is being computed, for a player."""

    def __init__(self, setup: Setup) -> None:
        """Begin without a frame."""
        self._setup, self._times, self._joints = setup, list[Array](), list[Array]()
        self._masses = setup.link_values.mass[:, None]
        self.size = 0

    def message(self, progress: Progress) -> dict[str, Any]:
        """What is new: all that a player needs with the first frames, after that more frames and a larger view."""
        if not len(progress.frame_time):
            return {}
        is_first, had = not self._times, sum(map(len, self._times))
        self._times.append(progress.frame_time)
        self._joints.append(progress.frame_joints[..., :2])
        self.size += self._joints[-1].size
        times, joints = np.concatenate(self._times), np.concatenate(self._joints)
        links = (joints + np.roll(joints, 1, axis=1)) / 2
        center = (links * self._masses).sum(axis=1) / self._masses.sum()
        height, setup = progress.sprocket_height, self._setup
        is_bare = math.isnan(height)
        walk = SimpleNamespace(
            setup=setup,
            time=times,
            center=center,
            frame_time=times,
            frame_joints=joints,
            joints_lab=None,
            sprocket_center=None if is_bare else np.array([0.0, height]),
            sprocket_radius=math.nan if is_bare else setup.contact_radius,
        )
        data = player_data(cast(Walk, walk), len(times))
        if is_first:
            return {"first": data}
        moving = {name: data[name][had:] for name in ("time", "joints", "center")}
        around = {name: data[name] for name in ("view", "marks", "heights", "floor", "places", "stretches")}
        return {"more": moving | around}


def summary(walk: WalkResult) -> dict[str, Any]:
    """The results that a page shows, and the values of its controls."""
    names = ("dx", "walk_time", "bounces", "energy", "wall_time", "fell_over")
    said = {name: getattr(walk, name) for name in names} | {"status": walk.status.label, "warnings": walk.warnings()}
    values = walk.setup.parameters.model_dump() | walk.setup.scene.model_dump() | {"preset": walk.setup.preset}
    told = {"sentence": walk.status.sentence, "values": values, "seed": walk.seed}
    return cast(dict[str, Any], json_value(said | told))


def recipes(asked: Mapping[str, Any], walk: WalkResult, folder: Path, kicks: Sequence[Array]) -> dict[str, str]:
    """Python lines, command line and YAML file that make the same walk; what cannot is empty."""
    settings = {name: value for name, value in asked.items() if name != "push"}
    index, seed, preset = (settings.pop(name, None) for name in ("index", "seed", "preset"))
    fields = {name: settings[name] for name in sorted(settings, key=lambda name: name not in _OPTIONS)}
    words = ["warpchain", "walk", *([] if index is None else ["--like", str(folder), "--index", f"{index}"])]
    for name, value in {"preset": preset, "seed": seed}.items():
        words += [] if value is None else [f"--{name}", f"{value}"]
    for name, value in fields.items():
        text = value if isinstance(value, str) else json.dumps(value)
        words += [f"--{name}", text] if name in _OPTIONS else ["--set", f"{name}={text}"]
    sections = {name: values for name, values in by_section(fields).items() if values}
    file = yaml.safe_dump({"preset": preset or DEFAULT_PRESET} | sections, sort_keys=False, default_flow_style=None)
    note = "# warpchain walk --config FILE.yaml" + f" --seed {seed}" * (seed is not None)
    if index is not None and fields:  # the fields of the sweep's walk, one by one
        preset, dumps = walk.setup.preset, [vars(walk.setup)[name].model_dump() for name in SECTIONS]
        fields = {name: value for dump in dumps for name, value in dump.items()}
    keywords = {name: value for name, value in {"preset": preset, "seed": seed}.items() if value is not None} | fields
    made = f"walk({', '.join(f'{name}={value!r}' for name, value in keywords.items())})"
    if index is not None and not fields:
        made = f"load({str(folder)!r}).walk({index})"
    lines = ["import warpchain\n", f"walk = warpchain.{made}"]
    for (moment, link, *impulse), kick in zip(asked.get("push", []), kicks, strict=True):
        lines += [
            f"state = walk.state({moment!r})",
            "velocity = state.velocity.copy()",
            f"velocity[{link}, :2] += {kick.tolist()}  # m/s, by an impulse of {impulse} N s",
            "walk = warpchain.walk(start=replace(state, velocity=velocity))",
        ]
    python = "\n".join([*["from dataclasses import replace\n"] * bool(kicks), *lines])
    command, is_whole = shlex.join(words) if not kicks else "", not kicks and index is None
    return {"python": python, "command": command, "yaml": f"{note}\n{file}" if is_whole else ""}
