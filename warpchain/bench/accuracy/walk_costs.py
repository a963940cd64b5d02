"""What whole walks cost by method: processor time of one core from the release to rest, and how their ledgers close.

The chains start as an ellipse, so that nothing is timed but the walk. All methods walk from the same drawn samples and
take turns, so that whatever else the machine does falls on all alike.
"""

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from warpchain.bench.accuracy.ensembles import ledger_errors, release_frequency
from warpchain.bench.accuracy.method_settings import LOOSE, MethodSetting
from warpchain.inputs.setup import Setup
from warpchain.run.single_walk import run_walk, setup_walk
from warpchain.status import Status
from warpchain.walks.scheduler import compile_kernels

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
        A row for each method_setting, the reference first; what is medians or means of no walk is NaN.
    """
    every = list(dict.fromkeys((LOOSE, *method_settings)))
    report(f"walks of {links} links: compiling")
    compile_kernels([_setup(links, one, 0) for one in every])
    seconds: dict[MethodSetting, list[float]] = {one: [] for one in every}
    ends: dict[MethodSetting, list[Any]] = {one: [] for one in every}
    for number in range(walks):
        for one in every:
            report(f"walks of {links} links: {number + 1} of {walks}, {one.title}")
            began = time.process_time()
            ends[one].append(run_walk(_setup(links, one, number), frame_interval=None))
            seconds[one].append(time.process_time() - began)
    rows = []
    for one in every:
        at_rest = [
            (end, cost) for end, cost in zip(ends[one], seconds[one], strict=True) if end.status == Status.AT_REST
        ]
        errors = np.array([_ledger_error(end) for end, _ in at_rest])
        rows.append(
            {
                "links": links,
                "frequency": release_frequency(links),
                "preset": PRESET,
                "name": one.name,
                "title": one.title,
                "method": one.method,
                "tolerance": one.tolerance,
                "settings": dict(one.settings),
                "walks": walks,
                "at_rest": len(at_rest),
                "seconds": _median([cost for _, cost in at_rest]),
                "each": [cost for _, cost in at_rest],
                "attempts": _median([end.steps_accepted + end.steps_rejected for end, _ in at_rest]),
                "walk_time": _median([end.walk_time for end, _ in at_rest]),
                **ledger_errors(errors),
            }
        )
    for row in rows:
        row["reference_seconds"] = rows[0]["seconds"]
    return rows


def _setup(links: int, method_setting: MethodSetting, seed: int) -> Setup:
    scene = {"links": links, "frequency": release_frequency(links), "start": "ellipse"}
    return setup_walk(PRESET, {**scene, **method_setting.options}, seed)


def _ledger_error(walk: Any) -> float:
    """What the energy ledger leaves open, as a fraction of the energy at release."""
    return float(
        abs(walk.energy["residual"]) / (walk.energy["kinetic_at_release"] + walk.energy["potential_at_release"])
    )


def _median(values: Sequence[float]) -> float:
    return statistics.median(values) if values else float("nan")
