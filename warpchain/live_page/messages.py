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

from warpchain.chain.setup import Setup
from warpchain.inputs.arrays import Array
from warpchain.inputs.fields import by_section
from warpchain.inputs.validation import InputError, json_value
from warpchain.pictures.player import player_data
from warpchain.results.walk_result import WalkResult
from warpchain.walks.walk_numbers import WalkNumbers as Walk
from warpchain.walks.walk_phases import Progress

_OPTIONS: Final = ("preset", "seed", "links", "frequency", "start")
"""Names with an option of their own on the command line of `warpchain walk`, which come first there."""


_NO_FIELDS: Final = ("preset", "seed", "index", "push")
"""What a set-up has beside fields of a walk."""


class Frames:
    """The frames of a walk that is being computed, for a player."""

    def __init__(self, setup: Setup) -> None:
        """Begin without a frame."""
        self._setup, self._times = setup, np.empty(0)
        self.joints: Array = np.empty((0, setup.scene.links, 2))

    def message(self, progress: Progress) -> dict[str, Any]:
        """What is new: all that a player needs with the first frames, after that more frames and a larger view."""
        had, setup = len(self._times), self._setup
        self._times = np.append(self._times, progress.frame_time)
        if len(self._times) == had:
            return {}
        self.joints = np.concatenate([self.joints, progress.frame_joints[..., :2]])
        links = (self.joints + np.roll(self.joints, 1, axis=1)) / 2
        has_sprocket = not math.isnan(progress.sprocket_height)
        walk = SimpleNamespace(
            setup=setup,
            time=self._times,
            frame_time=self._times,
            frame_joints=self.joints,
            joints_lab=None,
            center=np.average(links, axis=1, weights=setup.link_values.mass),
            sprocket_center=np.array([0.0, progress.sprocket_height]) if has_sprocket else None,
            sprocket_radius=setup.contact_radius if has_sprocket else math.nan,
        )
        data = player_data(cast(Walk, walk), len(self._times))
        new = {name: data[name][had:] for name in ("time", "joints", "center")}
        return {"more" if had else "first": data | new}


def change_of_velocity(setup: Setup, link: int, impulse: Sequence[float]) -> Array:
    """Change [m/s] of the velocity x, y of a link's centre by an impulse [N s]; an `InputError` if there is no link."""
    masses = setup.link_values.mass
    if not 0 <= link < len(masses):
        raise InputError(f"push: expected a link of 0 to {len(masses) - 1}, got {link}; use one of them")
    return np.asarray(np.array(impulse) / masses[link])


def summary(walk: WalkResult) -> dict[str, Any]:
    """The results that a page shows, and the values of its controls."""
    names = ("dx", "walk_time", "bounces", "energy", "wall_time", "fell_over")
    said = {name: getattr(walk, name) for name in names} | {"status": walk.status.label, "warnings": walk.warnings()}
    own = walk.setup.sections
    values = own["parameters"] | own["scene"] | {"preset": walk.setup.preset}
    told = {"sentence": walk.status.sentence, "values": values, "seed": walk.seed}
    return cast(dict[str, Any], json_value(said | told))


def recipes(asked: Mapping[str, Any], walk: WalkResult, folder: Path) -> dict[str, str]:
    """Python lines, command line and YAML file that make the same walk; what cannot is empty."""
    fields = {name: asked[name] for name in (*_OPTIONS, *asked) if name in asked and name not in _NO_FIELDS}
    given = {name: asked[name] for name in ("preset", "seed") if asked.get(name) is not None} | fields
    index, pushes = asked.get("index"), asked.get("push", [])
    words = ["warpchain", "walk", *([] if index is None else ["--like", str(folder), "--index", f"{index}"])]
    for name, value in given.items():
        text = value if isinstance(value, str) else json.dumps(value)
        words += [f"--{name}", text] if name in _OPTIONS else ["--set", f"{name}={text}"]
    sections = {"preset": walk.setup.preset} | {name: values for name, values in by_section(fields).items() if values}
    file = yaml.safe_dump(sections, sort_keys=False, default_flow_style=None)
    note = "# warpchain walk --config FILE.yaml" + (f" --seed {given['seed']}" if "seed" in given else "")
    if index is not None and fields:  # the fields of the sweep's walk, one by one
        parameters, scene, options = walk.setup.sections.values()
        given = {"preset": walk.setup.preset} | parameters | scene | options
    made = f"walk({', '.join(f'{name}={value!r}' for name, value in given.items())})"
    if index is not None and not fields:
        made = f"load({str(folder)!r}).walk({index})"
    lines = ["from dataclasses import replace\n"] * bool(pushes) + ["import warpchain\n", f"walk = warpchain.{made}"]
    for moment, link, *impulse in pushes:
        kick = change_of_velocity(walk.setup, link, impulse).tolist()
        lines += [
            f"state = walk.state({moment!r})",
            "velocity = state.velocity.copy()",
            f"velocity[{link}, :2] += {kick}  # m/s, by an impulse of {impulse} N s",
            "walk = warpchain.walk(start=replace(state, velocity=velocity))",
        ]
    return {
        "python": "\n".join(lines),
        "command": "" if pushes else shlex.join(words),
        "yaml": "" if pushes or index is not None else f"{note}\n{file}",
    }
