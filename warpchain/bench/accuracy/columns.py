"""Unit and meaning of the numbers that ``warpchain bench accuracy`` writes, by table."""

from collections.abc import Mapping
from typing import Final

from warpchain.bench.accuracy.ensembles import Ensemble
from warpchain.bench.accuracy.method_settings import SETTING_COLUMNS
from warpchain.bench.problems.hard_cases import Outcome
from warpchain.bench.problems.reversals import Reversal
from warpchain.bench.problems.work_precision import Errors, Point
from warpchain.bench.record import Column, columns_of

_POINT: Final = columns_of(Point)

_LEDGER: Final = {
    "ledger": ("1", "what the energy ledger of a walk leaves open, of the energy at release, median"),
    "greatest_ledger": ("1", "the same, greatest"),
}

_TABLES: Final[dict[str, Mapping[str, tuple[str, str]]]] = {
    "references": {
        "problem": _POINT["problem"],
        "links": _POINT["links"],
        "duration": ("s", "simulated time of each start"),
        "starts": ("1", "number of starts"),
        **{
            name: (unit, f"{text}: dp5 at 1e-11 against rkf78 at 1e-12")
            for name, (unit, text) in columns_of(Errors).items()
        },
    },
    "points": _POINT,
    "reversals": columns_of(Reversal),
    "walks": {
        "links": ("1", "number of links"),
        "frequency": ("Hz", "turns of a sprocket per second that the speed along the ellipse stands for"),
        "preset": ("1", "parameters that the walks are drawn around; walk k has the seed k, whatever the method"),
        **SETTING_COLUMNS,
        "name": ("1", "as --methods takes it"),
        "walks": ("1", "walks that were timed, the methods in turn"),
        "at_rest": ("1", "those of them that came to rest: the medians are theirs"),
        "seconds": ("s", "processor time of one core from the release to rest, median"),
        "each": ("s", "the same of each walk"),
        "reference_seconds": ("s", "the same of rkf78 at 1e-6 in the same run, median"),
        "attempts": ("1", "attempted steps, accepted or not, median"),
        "walk_time": ("s", "simulated time from the release to rest, median"),
        **_LEDGER,
    },
    "ensembles": {
        "name": ("1", "folder of the ensembles"),
        "frequency": ("Hz", "turns of the sprocket per second at the release"),
        **columns_of(Ensemble),
        **SETTING_COLUMNS,
        "at_rest": ("1", "walks that came to rest: those that the statistics are of"),
        "missing": ("1", "walks not run yet"),
        "failed": ("1", "walks that ended otherwise, by status"),
        "mean": ("m", "mean Δx"),
        "mean_interval": ("m", "its 95 % bootstrap interval"),
        "sd": ("m", "standard deviation of Δx, divisor count − 1"),
        "sd_interval": ("m", "its 95 % bootstrap interval"),
        **_LEDGER,
        "dx": ("m", "Δx of the walks at rest"),
        "ks_loose": ("1", "greatest distance of the distribution functions of Δx from that of rkf78 at 1e-6"),
        "p_loose": ("1", "probability of one at least as great (exact two-sample Kolmogorov–Smirnov test)"),
        "difference_loose": ("1", "mean Δx over that of rkf78 at 1e-6, less 1"),
        "errors_loose": ("1", "difference of the means in units of its standard error"),
        "ks_tight": ("1", "as ks_loose, against rkf78 at 1e-9"),
        "p_tight": ("1", "as p_loose, against rkf78 at 1e-9"),
        "difference_tight": ("1", "as difference_loose, against rkf78 at 1e-9"),
        "errors_tight": ("1", "as errors_loose, against rkf78 at 1e-9"),
        "seconds_per_walk": ("s", "processor time of one core per walk, time on the sprocket included; null on a GPU"),
        "walks_per_second": ("1/s", "walks per second of wall time on a GPU; null on a CPU"),
        "passes": ("1", "mean within 1 % of rkf78's at 1e-6 or in its interval, and no more walks failed"),
    },
    "hard_cases": {
        "group": ("1", "kind of difficulty"),
        "case": ("1", "short name"),
        "what": ("1", "what happens"),
        "method": SETTING_COLUMNS["method"],
        **columns_of(Outcome),
    },
}

COLUMNS: Final = {
    table: {name: Column(*column) for name, column in {**columns, "machine": ("1", "index in machines")}.items()}
    for table, columns in _TABLES.items()
}
"""Table → column → unit and meaning."""
