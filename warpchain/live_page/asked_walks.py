"""Computes the walks that a live page requests in JSON.

A set-up is a mapping of names of fields to values, like the keywords of `warpchain.walk`, and beside these: `preset`;
`seed`; `index`, the number of a walk of the server's sweep, of which the other values are changed; and `push`, a list
of `[time, link, x, y]`: an impulse [N s] on the centre of a link at a time [s] of the walk, which continues from there.
"""

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from pydantic import Field, Strict

from warpchain.chain.resolution import resolve
from warpchain.chain.setup import DEFAULT_PRESET, Setup
from warpchain.inputs.fields import by_section
from warpchain.inputs.validation import InputError, checked, shown
from warpchain.live_page.messages import Frames, change_of_velocity, recipes, summary
from warpchain.pictures.player import player_data
from warpchain.results.walk_result import WalkResult
from warpchain.run.single_walk import walk as run_walk
from warpchain.walks.walk_phases import Progress

if TYPE_CHECKING:
    from warpchain.results.sweep_result import SweepResult

MOST_LINKS: Final = 400
"""Most links of a chain on the page; longer ones need kernels of their own, and minutes."""
MOST_SECONDS: Final = 60.0
"""Most time [s] for which a walk of the page is computed, beside that of the compilation of kernels."""
MOST_NUMBERS: Final = 4_000_000
"""Most coordinates that the page gets of a walk."""
INTERVAL: Final = 4e-3
"""Time [s] between two frames: one for each picture of a screen, if the walk is played four times slower."""
_PUSHES: Final = Annotated[
    list[Annotated[tuple[float, int, float, float], Strict(False)]], Field(min_length=1, max_length=8)
]

Asked = Mapping[str, Any]
Send = Callable[[dict[str, Any]], None]
IsGone = Callable[[], bool]


class GoneError(Exception):
    """Nobody waits for the walk any more: the page asked for something else, or was closed."""


@dataclass
class Walker:
    """Runs the walks of a page, of several threads at once; an `index` names a walk of the `sweep` in the `folder`."""

    sweep: "SweepResult | None" = None
    folder: Path = Path()
    _last: tuple[str, WalkResult | None] = ("", None)  # what was asked, and the walk, which may be pushed next

    def setup(self, asked: Asked) -> tuple[Setup, int | None]:
        """Set-up and seed of a walk without its pushes; an `InputError` refuses it in the words of `warpchain.walk`."""
        settings = {name: value for name, value in asked.items() if name != "push"}
        index, seed, preset = (settings.pop(name, None) for name in ("index", "seed", "preset"))
        sections = by_section(settings)
        links = sections["scene"].get("links")
        if isinstance(links, int | float) and links > MOST_LINKS:
            raise InputError(
                f"scene.links: expected at most {MOST_LINKS} on a live page, got {shown(links)}; use fewer"
            )
        if others := sorted(sections["options"].keys() - {"method", "tolerance"}):
            raise InputError(f"options.{others[0]}: not possible on a live page; remove it, or use `warpchain walk`")
        if index is None:
            chosen = DEFAULT_PRESET if preset is None else preset
            return resolve(chosen, **sections, seed=seed, loads=False), seed
        if self.sweep is None:
            raise InputError("index: no sweep is open; start `warpchain live FOLDER`")
        if seed is not None or preset is not None:
            raise InputError("index: the walk has its own preset and seed; remove preset and seed")
        block, place = self.sweep.located(index)
        setup = block.setup_at(place)
        if not settings:
            return setup, block.origin.seed
        own = setup.sections | {"options": setup.options.beside(sections["options"])}
        given = {name: own[name] | values for name, values in sections.items()}
        return resolve(setup.preset, **given, seed=None, loads=False), None

    def walk(self, asked: Asked, watch: Callable[[Progress], None], record: Mapping[str, Any]) -> WalkResult:
        """The walk of a set-up, pushes included."""
        key, (last, found) = json.dumps([asked, record], sort_keys=True), self._last
        if key == last and found is not None:
            return found
        if "push" in asked:
            pushes = checked(asked["push"], "push", _PUSHES)
            unpushed = {name: value for name, value in asked.items() if name != "push"}
            earlier = {**unpushed, "push": pushes[:-1]} if pushes[:-1] else unpushed
            before = self.walk(earlier, lambda progress: watch(replace(progress, frame_time=np.empty(0))), record)
            moment, link, *impulse = pushes[-1]
            kick, state = change_of_velocity(before.setup, link, impulse), before.state(moment)
            velocity = state.velocity.copy()
            velocity[link, :2] += kick
            found = run_walk(start=replace(state, velocity=velocity), on_progress=watch, **record)
        else:
            setup, seed = self.setup(asked)
            found = run_walk(setup=setup, seed=seed, on_progress=watch, **record)
        self._last = key, found
        return found

    def play(self, asked: Asked, send: Send, is_gone: IsGone) -> None:
        """Run a walk and send what the page draws: frames as they come, and at the end results and lines to copy."""
        setup, _ = self.setup(asked)
        watch, frames = _watch(is_gone), Frames(setup)

        def show(progress: Progress) -> None:
            watch(progress)
            if frames.joints.size > MOST_NUMBERS:
                raise InputError("scene.walk_limit: the walk is too long for a live page; use less, e.g. 10")
            send({"phase": progress.phase, **frames.message(progress)})

        walk = self.walk(asked, show, {"frame_interval": INTERVAL, "record_before": 0.0})
        send(
            {
                "end": summary(walk) | recipes(asked, walk, self.folder),
                "whole": player_data(walk) if len(walk.frame_time) else None,
            }
        )

    def sample(self, asked: Asked, send: Send, is_gone: IsGone) -> None:
        """Run a walk of which only results and path are sent: x, y in tenths of a millimetre, some 200 of them."""
        setup, seed = self.setup(asked)
        walk = run_walk(setup=setup, seed=seed, frame_interval=None, on_progress=_watch(is_gone))
        path = np.rint(walk.center[:: max(1, len(walk.center) // 200)] * 1e4).astype(int).tolist()
        send({"end": summary(walk), "path": path})


def _watch(is_gone: IsGone) -> Callable[[Progress], None]:
    """What ends a walk after its time, without that of compiling kernels, or when it is no longer wanted."""
    ends: list[float] = []

    def watch(progress: Progress) -> None:
        if is_gone():
            raise GoneError
        if progress.phase == "compile":
            return
        if not ends:
            ends.append(time.monotonic() + MOST_SECONDS)
        if time.monotonic() > ends[0]:
            problem = f"more than {MOST_SECONDS:g} s of computing, too much for a live page"
            raise InputError(f"scene.walk_limit: {problem}; use less, e.g. 10, or fewer links")

    return watch
