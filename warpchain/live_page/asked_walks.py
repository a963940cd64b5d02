"""Computes the walks that a live page requests in JSON.

A set-up is a mapping of names of fields to values, like the keywords of `warpchain.walk`, and beside these: `preset`;
`seed`; `index`, the number of a walk of the server's sweep, of which the other values are changed; and `push`, a list
of `[time, link, x, y]`: an impulse [N s] on the centre of a link at a time [s] of the walk, which continues from there.
"""

import json
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from pydantic import Field, Strict

from warpchain.chain.resolution import resolve
from warpchain.chain.setup import DEFAULT_PRESET, Setup
from warpchain.engine.processors import processors
from warpchain.inputs.arrays import Array
from warpchain.inputs.fields import SECTIONS, by_section
from warpchain.inputs.validation import InputError, checked, json_value, shown
from warpchain.live_page.messages import Film, recipes, summary
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
MOST_KEPT: Final = 8
"""Walks that are kept for what is asked next, such as a push."""
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
    _kept: dict[str, WalkResult] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

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
        own = {name: getattr(setup, name).model_dump() for name in SECTIONS}
        own["options"] = setup.options.beside(sections["options"])
        given = {name: own[name] | sections[name] for name in SECTIONS}
        return resolve(setup.preset, **given, seed=None, loads=False), None

    def walk(self, asked: Asked, watch: Callable[[Progress], None], record: Mapping[str, Any]) -> WalkResult:
        """The walk of a set-up, pushes included."""
        key = json.dumps([asked, record], sort_keys=True)
        with self._lock:
            if key in self._kept:
                return self._kept[key]
        if "push" in asked:
            pushes = checked(asked["push"], "push", _PUSHES)
            earlier: dict[str, Any] = {**asked, "push": pushes[:-1]}
            if not pushes[:-1]:
                del earlier["push"]
            before = self.walk(earlier, lambda progress: watch(replace(progress, frame_time=np.empty(0))), record)
            moment, link, *impulse = pushes[-1]
            kick, state = change_of_velocity(before.setup, link, impulse), before.state(moment)
            velocity = state.velocity.copy()
            velocity[link, :2] += kick
            found = run_walk(start=replace(state, velocity=velocity), on_progress=watch, **record)
        else:
            setup, seed = self.setup(asked)
            found = run_walk(setup=setup, seed=seed, on_progress=watch, **record)
        with self._lock:
            self._kept[key] = found
            for name in [*self._kept][:-MOST_KEPT]:
                del self._kept[name]
        return found

    def play(self, asked: Asked, send: Send, is_gone: IsGone) -> None:
        """Run a walk and send what the page draws: frames as they come, and at the end results and lines to copy."""
        setup, _ = self.setup(asked)
        watch, film = _watch(is_gone), Film(setup)

        def show(progress: Progress) -> None:
            watch(progress)
            if film.size > MOST_NUMBERS:
                raise InputError("scene.walk_limit: the walk is too long for a live page; use less, e.g. 10")
            send({"phase": progress.phase, **film.message(progress)})

        walk = self.walk(asked, show, {"frame_interval": INTERVAL, "record_before": 0.0})
        kicks = [change_of_velocity(setup, link, impulse) for _, link, *impulse in asked.get("push", [])]
        said = summary(walk) | recipes(asked, walk, self.folder, kicks)
        send({"end": said, "whole": player_data(walk) if len(walk.frame_time) else None})

    def samples(self, setups: Sequence[Asked], first: int, count: int, send: Send, is_gone: IsGone) -> None:
        """Run samples of the same seeds for each set-up, and send Δx and path of each as it comes."""
        for name in ("index", "push"):
            if any(name in asked for asked in setups):
                raise InputError(f"{name}: not possible with samples; remove it")
        watch = _watch(is_gone, count * len(setups))

        def run(seed: int, side: int) -> dict[str, Any]:
            setup, _ = self.setup({**setups[side], "seed": seed})
            walk = run_walk(setup=setup, seed=seed, frame_interval=None, on_progress=watch)
            path = np.rint(walk.center[:: max(1, len(walk.center) // 200)] * 1e4).astype(int).tolist()
            said = {"seed": seed, "side": side, "dx": walk.dx, "status": walk.status.label, "path": path}
            return dict(json_value(said))

        with ThreadPoolExecutor(processors()) as threads:
            try:
                seeds, sides = range(first, first + count), range(len(setups))
                for each in as_completed([threads.submit(run, seed, side) for seed in seeds for side in sides]):
                    send({"sample": each.result()})
            except BaseException:
                threads.shutdown(wait=False, cancel_futures=True)
                raise
        send({"end": {}})


def _watch(is_gone: IsGone, walks: int = 1) -> Callable[[Progress], None]:
    """What ends walks after their time, without that of compiling kernels, or when they are no longer wanted."""
    ends: list[float] = []

    def watch(progress: Progress) -> None:
        if is_gone():
            raise GoneError
        if progress.phase == "compile":
            return
        if not ends:
            ends.append(time.monotonic() + walks * MOST_SECONDS)
        if time.monotonic() > ends[0]:
            problem = f"more than {walks * MOST_SECONDS:g} s of computing, too much for a live page"
            raise InputError(f"scene.walk_limit: {problem}; use less, e.g. 10, or fewer links")

    return watch


def change_of_velocity(setup: Setup, link: int, impulse: Sequence[float]) -> Array:
    """Change [m/s] of the velocity x, y of a link's centre by an impulse [N s]; an `InputError` if there is no link."""
    masses = setup.link_values.mass
    if not 0 <= link < len(masses):
        raise InputError(f"push: expected a link of 0 to {len(masses) - 1}, got {link}; use one of them")
    return np.asarray(np.array(impulse) / masses[link])
