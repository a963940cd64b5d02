"""Ensembles of walks by method: whether their distances Δx can be told from the reference's, and what they cost.

Single walks are chaotic, so each method makes the same number of walks from the same samples, each ensemble a sweep in
a folder of its own that can be killed and goes on. The tests take the ensembles for independent ones, which is right
for walks that forget their beginnings and makes differences look less certain than they are if they don't.
"""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.bench.accuracy.method_settings import LOOSE, TIGHT, MethodSetting
from warpchain.bench.accuracy.two_samples import bootstrap_interval, kolmogorov_smirnov, means, standard_deviations
from warpchain.bench.problems.work_precision import methods
from warpchain.files import replacing
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.run.sweep_run import SweepProgress, sweep
from warpchain.status import Status
from warpchain.store.sweep_result import SweepResult, load
from warpchain.sweeps.plan import load_sweep
from warpchain.walks.scheduler import compile_kernels

Array = NDArray[np.float64]
SEED: Final = 20180602
LONG: Final = 100
"""From this number of links on, walks are released at 20 Hz instead of 15 and there are 60 instead of 200 of them."""


@dataclass(frozen=True)
class Ensemble:
    """What the walks of an ensemble are, method and tolerance apart.

    Attributes:
        links: n.
        preset: Parameters that samples are drawn around.
        start: See `warpchain.inputs.scene.Scene`.
        samples: Number of walks.
        device: Where they run.
    """

    links: int
    preset: str
    start: str = "spinning"
    samples: int = 200
    device: str = "cpu"

    @property
    def frequency(self) -> float:
        """Turns of the sprocket per second at the release [Hz]."""
        return release_frequency(self.links)

    @property
    def name(self) -> str:
        """Unique, good for a folder."""
        device = self.device.replace(":", "")
        return f"n{self.links}-{self.frequency:g}Hz-{self.preset}-{self.start}-{device}-{self.samples}"

    @property
    def title(self) -> str:
        """For people."""
        return f"{self.links} links, {self.frequency:g} Hz, {self.preset}, {self.start}, {self.samples} walks"

    def content(self, method_setting: MethodSetting) -> dict[str, Any]:
        """The sweep of a method."""
        return {
            "version": 1,
            "name": f"{self.title}, {method_setting.name}",
            "seed": SEED,
            "preset": self.preset,
            "samples": self.samples,
            "scene": {"links": self.links, "frequency": self.frequency, "start": self.start},
            "options": {**method_setting.options, "device": self.device},
        }


def release_frequency(links: int) -> float:
    """Turns of the sprocket per second [Hz] of a chain of this length."""
    return 20.0 if links >= LONG else 15.0


def default_samples(links: int) -> int:
    """Number of walks unless one says otherwise."""
    return 60 if links >= LONG else 200


def run_ensemble(
    folder: Path, ensemble: Ensemble, method_setting: MethodSetting, report: Callable[[str], None]
) -> None:
    """Make the walks of a method, or what is left of them, and note what they cost beside them.

    Args:
        folder: Of all ensembles.
        ensemble: What the walks are.
        method_setting: How they are computed.
        report: Called with a line of progress.

    Raises:
        InputError: The folder holds something else, or the device is not there.
    """
    planned = load_sweep(ensemble.content(method_setting))
    place = _place(folder, ensemble, method_setting)
    place.parent.mkdir(parents=True, exist_ok=True)
    who = f"{ensemble.title}, {method_setting.title}"
    report(f"{who}: compiling")
    compile_kernels([planned.planned(0).setup])
    cost_file = _cost_file(place)
    earlier = json.loads(cost_file.read_text(encoding="utf-8")) if place.exists() and cost_file.exists() else {}
    began = time.process_time()

    def after_shard(progress: SweepProgress) -> None:
        cost = {
            "walks": earlier.get("walks", 0) + progress.done - progress.before,
            "core_seconds": earlier.get("core_seconds", 0.0) + time.process_time() - began,
            "wall_seconds": earlier.get("wall_seconds", 0.0) + progress.seconds,
        }
        with replacing(cost_file) as part:
            part.write_text(json.dumps(cost), encoding="utf-8")
        report(f"{who}: {progress.done} of {progress.walks} walks, {progress.rate:.2f} a second")

    sweep(planned, place, on_progress=after_shard)


def summary(folder: Path, ensemble: Ensemble) -> list[dict[str, Any]]:
    """What the ensembles on disk say, one row for each method_setting; the references first.

    Walks that did not come to rest are counted and in no mean. NaN stands for what cannot be known: intervals of fewer
    than two walks, tests against a reference without walks, cost of walks made without a record of it.
    """
    found: dict[MethodSetting, SweepResult] = {}
    for place in sorted((folder / ensemble.name).glob("*@*")):
        if place.is_dir():
            found[MethodSetting.parse(place.name)] = load(place)
    ranks = {name: rank for rank, name in enumerate((*METHODS_BY_NEED, *methods()))}
    ordered = sorted(
        found,
        key=lambda one: (
            *(one != LOOSE, one != TIGHT, ranks[one.word or one.method], -one.tolerance, len(one.settings)),
            one.name,
        ),
    )
    distances = {one: _distances(result) for one, result in found.items()}
    rows = []
    for one in ordered:
        at_rest = distances[one]
        counts = found[one].summary()
        row: dict[str, Any] = {
            "method": one.method,
            "tolerance": one.tolerance,
            "settings": dict(one.settings),
            "title": one.title,
            "at_rest": len(at_rest),
            "missing": counts["missing"],
            "failed": {k: n for k, n in counts.items() if n and k not in (Status.AT_REST.label, "missing")},
            "mean": float(at_rest.mean()) if len(at_rest) else float("nan"),
            "mean_interval": bootstrap_interval(at_rest, means),
            "sd": float(at_rest.std(ddof=1)) if len(at_rest) > 1 else float("nan"),
            "sd_interval": bootstrap_interval(at_rest, standard_deviations),
            **ledger_errors(_ledgers(found[one])),
            "dx": at_rest.tolist(),
        }
        for against, suffix in ((LOOSE, "loose"), (TIGHT, "tight")):
            true = distances.get(against, np.empty(0))
            both = len(true) > 0 and len(at_rest) > 0
            row[f"ks_{suffix}"], row[f"p_{suffix}"] = kolmogorov_smirnov(at_rest, true) if both else (float("nan"),) * 2
            row[f"difference_{suffix}"] = float(at_rest.mean() / true.mean() - 1) if both else float("nan")
            row[f"errors_{suffix}"] = _in_standard_errors(at_rest, true)
        rows.append(row | _cost(_place(folder, ensemble, one), ensemble.device))
    for row in rows:
        row["passes"] = _passes(row, rows[0])
    return rows


def _passes(row: dict[str, Any], true: dict[str, Any]) -> bool:
    """Whether a mean is within 1 % of the reference's or in its interval, and no more walks failed."""
    lower, upper = true["mean_interval"]
    close = abs(row["difference_loose"]) < 0.01 or lower <= row["mean"] <= upper
    return bool(close and row["missing"] == 0 and sum(row["failed"].values()) <= sum(true["failed"].values()))


def _in_standard_errors(sample: Array, true: Array) -> float:
    """Difference of two means in units of its standard error; NaN with fewer than two values."""
    if min(len(sample), len(true)) < 2:
        return float("nan")
    error = (sample.var(ddof=1) / len(sample) + true.var(ddof=1) / len(true)) ** 0.5
    difference = float(sample.mean() - true.mean())
    return difference / float(error) if difference else 0.0


def _distances(result: SweepResult) -> Array:
    """Δx [m] of the walks at rest."""
    (block,) = result.blocks.values()
    values: Array = block.columns["dx"][block.columns["status"] == Status.AT_REST]
    return values


def ledger_errors(errors: Array) -> dict[str, float]:
    """Median and greatest error of energy ledgers (k,), under the names of the tables; NaN of none."""
    if len(errors) == 0:
        return {"ledger": float("nan"), "greatest_ledger": float("nan")}
    return {"ledger": float(np.median(errors)), "greatest_ledger": float(errors.max())}


def _ledgers(result: SweepResult) -> Array:
    """What the energy ledgers of the walks at rest leave open, as fractions of the energy at release."""
    (block,) = result.blocks.values()
    at_rest = block.columns["status"] == Status.AT_REST
    errors: Array = np.abs(block.columns["energy_residual"] / block.columns["energy_at_release"])[at_rest]
    return errors


def _cost(place: Path, device: str) -> dict[str, float]:
    """Seconds of one core per walk, or on a GPU walks per second of wall time; NaN for the other."""
    nan = float("nan")
    if not _cost_file(place).exists():
        return {"seconds_per_walk": nan, "walks_per_second": nan}
    cost = json.loads(_cost_file(place).read_text(encoding="utf-8"))
    if device.startswith("cuda"):
        return {"seconds_per_walk": nan, "walks_per_second": cost["walks"] / cost["wall_seconds"]}
    return {"seconds_per_walk": cost["core_seconds"] / cost["walks"], "walks_per_second": nan}


def _place(folder: Path, ensemble: Ensemble, method_setting: MethodSetting) -> Path:
    return folder / ensemble.name / method_setting.name


def _cost_file(place: Path) -> Path:
    """Beside the sweep's folder, which holds nothing but the sweep."""
    return place.with_name(place.name + ".cost.json")
