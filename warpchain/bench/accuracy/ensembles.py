"""Ensembles of walks by method: whether their distances Δx differ from the reference's, and what they cost.

Single walks are chaotic, so distributions are compared: each method makes the same number of walks from the same
samples. An ensemble is a sweep in a folder of its own; a killed one goes on. The tests take ensembles for independent:
that is right for walks that forget how they began, and understates the differences of walks that do not.
"""

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from warpchain.bench.accuracy.method_settings import LOOSE, TIGHT, MethodSetting
from warpchain.bench.accuracy.two_samples import bootstrap_interval, kolmogorov_smirnov
from warpchain.bench.record import Column
from warpchain.files import make_folder, write_whole
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.kernels.methods.method import method_names
from warpchain.run.progress_bar import SweepProgress
from warpchain.run.sweep_run import sweep
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
    """Scene and samples of an ensemble, which are the same for all methods; see `warpchain.inputs.scene.Scene`."""

    links: Annotated[int, Column("1", "number of links")]
    preset: Annotated[str, Column("1", "parameters that samples are drawn around")]
    start: Annotated[str, Column("1", "how the chain starts")] = "spinning"
    samples: Annotated[int, Column("1", "walks of each method, the same samples for all")] = 200
    device: Annotated[str, Column("1", "where they ran")] = "cpu"

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

    @property
    def columns(self) -> dict[str, Any]:
        """The ensemble as columns of a table."""
        return {"name": self.name, "title": self.title, "frequency": self.frequency, **asdict(self)}

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
    """Walks of an ensemble unless another number is given."""
    return 60 if links >= LONG else 200


def run_ensemble(
    folder: Path, ensemble: Ensemble, method_setting: MethodSetting, report: Callable[[str], None]
) -> None:
    """Make those walks of a method that are not there yet; their cost is kept in a file beside them.

    Args:
        folder: Of all ensembles.
        ensemble: Scene and samples of the walks.
        method_setting: How the walks are computed.
        report: Called with a line of progress.

    Raises:
        InputError: The folder holds something else, or the device is not there.
    """
    planned = load_sweep(ensemble.content(method_setting))
    place = _place(folder, ensemble, method_setting)
    make_folder(place.parent)
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
        write_whole(cost_file, json.dumps(cost))
        report(f"{who}: {progress.done} of {progress.walks} walks, {progress.rate:.2f} a second")

    sweep(planned, place, on_progress=after_shard)


def summary(folder: Path, ensemble: Ensemble) -> list[dict[str, Any]]:
    """Statistics of the ensembles on disk, a row for each method setting; the references first.

    Walks that did not come to rest are counted, and are in no mean. Unknown is NaN: intervals of fewer than two walks,
    tests against a reference without walks, costs that were not recorded.
    """
    places = sorted(place for place in (folder / ensemble.name).glob("*@*") if place.is_dir())
    found = {MethodSetting.parse(place.name): load(place) for place in places}
    ranks = {name: rank for rank, name in enumerate((*METHODS_BY_NEED, *method_names()))}
    ordered = sorted(
        found,
        key=lambda one: (
            *(one != LOOSE, one != TIGHT, ranks[one.word or one.method], -one.tolerance, len(one.settings)),
            one.name,
        ),
    )
    walks = {one: _walks_at_rest(result) for one, result in found.items()}
    rows: list[dict[str, Any]] = []
    for one in ordered:
        distances, ledgers = walks[one]
        counts = found[one].summary()
        row = {
            **one.columns,
            "at_rest": len(distances),
            "missing": counts["missing"],
            "failed": {k: n for k, n in counts.items() if n and k not in (Status.AT_REST.label, "missing")},
            "mean": float(distances.mean()) if len(distances) else math.nan,
            "mean_interval": bootstrap_interval(distances, np.mean),
            "sd": float(distances.std(ddof=1)) if len(distances) > 1 else math.nan,
            "sd_interval": bootstrap_interval(distances, partial(np.std, ddof=1)),
            **ledger_columns(ledgers),
            "dx": distances.tolist(),
            **_cost(_place(folder, ensemble, one), ensemble.device),
        }
        for against, suffix in ((LOOSE, "loose"), (TIGHT, "tight")):
            agreement = _agreement(distances, walks[against][0] if against in walks else np.empty(0))
            row |= {f"{name}_{suffix}": value for name, value in agreement.items()}
        rows.append(row | {"passes": _passes(row, rows[0] if rows else row)})
    return rows


def _passes(row: dict[str, Any], true: dict[str, Any]) -> bool:
    """Whether a mean is within 1 % of the reference's or in its interval, and no more walks failed."""
    lower, upper = true["mean_interval"]
    close = abs(row["difference_loose"]) < 0.01 or lower <= row["mean"] <= upper
    return bool(close and row["missing"] == 0 and sum(row["failed"].values()) <= sum(true["failed"].values()))


def _agreement(sample: Array, true: Array) -> dict[str, float]:
    """Test of Kolmogorov and Smirnov, and difference of the means: relative, and in units of its standard error."""
    found = dict.fromkeys(("ks", "p", "difference", "errors"), math.nan)
    if len(sample) and len(true):
        found["ks"], found["p"] = kolmogorov_smirnov(sample, true)
        found["difference"] = float(sample.mean() / true.mean() - 1)
    if min(len(sample), len(true)) > 1:
        error = (sample.var(ddof=1) / len(sample) + true.var(ddof=1) / len(true)) ** 0.5
        difference = float(sample.mean() - true.mean())
        found["errors"] = difference / float(error) if difference else 0.0
    return found


def _walks_at_rest(result: SweepResult) -> tuple[Array, Array]:
    """Of the walks at rest: Δx [m], and what the energy ledger leaves open as a fraction of the energy at release."""
    (block,) = result.blocks.values()
    at_rest = block.columns["status"] == Status.AT_REST
    return block.columns["dx"][at_rest], block.columns["energy_error"][at_rest]


def ledger_columns(errors: Sequence[float] | Array) -> dict[str, float]:
    """Median and greatest of some errors of energy ledgers; NaN of none."""
    if len(errors) == 0:
        return {"ledger": math.nan, "greatest_ledger": math.nan}
    return {"ledger": float(np.median(errors)), "greatest_ledger": float(np.max(errors))}


def _cost(place: Path, device: str) -> dict[str, float]:
    """Seconds of one core per walk, or on a GPU walks per second of wall time; NaN for the other."""
    unknown = {"seconds_per_walk": math.nan, "walks_per_second": math.nan}
    if not _cost_file(place).exists():
        return unknown
    cost = json.loads(_cost_file(place).read_text(encoding="utf-8"))
    if device.startswith("cuda"):
        return unknown | {"walks_per_second": cost["walks"] / cost["wall_seconds"]}
    return unknown | {"seconds_per_walk": cost["core_seconds"] / cost["walks"]}


def _place(folder: Path, ensemble: Ensemble, method_setting: MethodSetting) -> Path:
    """Folder of the sweep of a method."""
    return folder / ensemble.name / method_setting.name


def _cost_file(place: Path) -> Path:
    """Beside the sweep's folder, which holds nothing but the sweep."""
    return place.with_name(place.name + ".cost.json")
