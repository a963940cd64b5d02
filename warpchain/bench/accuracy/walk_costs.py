"""What whole walks cost by method: processor time of one core from the release to rest, and how their ledgers close.

The chains start as an ellipse, so that only the walk is timed. All methods walk from the same drawn samples and take
turns, so that other work of the machine slows all of them alike.
"""

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

from warpchain.bench.accuracy.ensembles import ledger_columns, release_frequency
from warpchain.bench.accuracy.method_settings import LOOSE, MethodSetting
from warpchain.bench.problems.hard_starts import ledger_error
from warpchain.inputs.setup import Setup
from warpchain.run.single_walk import run_walk, setup_walk
from warpchain.status import Status
from warpchain.walks.scheduler import compile_kernels
from warpchain.walks.walk_result import WalkResult

PRESET: Final = "paper"


def walk_costs(
    links: int, method_settings: Sequence[MethodSetting], walks: int, report: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Time some walks with each method.

    Args:
        links: n.
        method_settings: How they are computed; the reference is timed beside them in any case.
        walks: Of each; walk k is drawn with the seed k.
        report: Called with a line of progress.

    Returns:
        A row for each method setting, the reference first; what is medians or means of no walk is NaN.
    """
    every = list(dict.fromkeys((LOOSE, *method_settings)))
    report(f"walks of {links} links: compiling")
    compile_kernels([_setup(links, one, 0) for one in every])
    at_rest: dict[MethodSetting, list[tuple[WalkResult, float]]] = {one: [] for one in every}
    for number in range(walks):
        for one in every:
            report(f"walks of {links} links: {number + 1} of {walks}, {one.title}")
            began = time.process_time()
            walk = run_walk(_setup(links, one, number), frame_interval=None)
            if walk.status == Status.AT_REST:
                at_rest[one].append((walk, time.process_time() - began))
    rows = [
        {
            "links": links,
            "frequency": release_frequency(links),
            "preset": PRESET,
            "name": one.name,
            **one.columns,
            "walks": walks,
            "at_rest": len(ended),
            "seconds": _median([seconds for _, seconds in ended]),
            "each": [seconds for _, seconds in ended],
            "attempts": _median([walk.steps_accepted + walk.steps_rejected for walk, _ in ended]),
            "walk_time": _median([walk.walk_time for walk, _ in ended]),
            **ledger_columns([ledger_error(walk) for walk, _ in ended]),
        }
        for one, ended in at_rest.items()
    ]
    return [row | {"reference_seconds": rows[0]["seconds"]} for row in rows]


def _setup(links: int, method_setting: MethodSetting, seed: int) -> Setup:
    scene = {"links": links, "frequency": release_frequency(links), "start": "ellipse"}
    return setup_walk(PRESET, {**scene, **method_setting.options}, seed)


def _median(values: Sequence[float]) -> float:
    return statistics.median(values) if values else float("nan")
