"""Unit and meaning of the numbers that ``warpchain bench accuracy`` writes, by table."""

from typing import Final

_ERRORS: Final = {
    "position_error": ("m", "greatest distance of a link's centre from where the reference has it, at the end"),
    "velocity_error": ("m/s", "greatest difference of a link's velocity from the reference's, at the end"),
    "momentum_error": (
        "1",
        "impact: of the floor's impulse on the chain, rms over the impacts; sprocket: of the angular momentum about "
        "its centre; relative to the reference's",
    ),
    "momentum_bias": ("1", "mean relative error of the vertical impulse or the angular momentum, with its sign"),
}

_PROBLEM: Final = {
    "problem": ("1", "flight: a circulating ellipse thrown; impact: it hits the floor; sprocket: one turn at 15 Hz"),
    "links": ("1", "number of links"),
}

_MACHINE: Final = {"machine": ("1", "index in machines")}

_CONTESTANT: Final = {
    "method": ("1", "method of the engine"),
    "tolerance": ("1", "its tolerance"),
    "settings": ("1", "other options that differ from their defaults, in SI units"),
    "title": ("1", "the same for people"),
}

_LEDGER: Final = {
    "ledger": ("1", "what the energy ledger of a walk leaves open, of the energy at release, median"),
    "greatest_ledger": ("1", "the same, greatest"),
}

COLUMNS: Final[dict[str, dict[str, tuple[str, str]]]] = {
    "references": {
        **_PROBLEM,
        "duration": ("s", "simulated time of each start"),
        "starts": ("1", "number of starts"),
        **{name: (unit, f"{text}: dp5 at 1e-11 against rkf78 at 1e-12") for name, (unit, text) in _ERRORS.items()},
        **_MACHINE,
    },
    "points": {
        **_PROBLEM,
        "method": ("1", "method of the engine, or of SciPy on the NumPy model"),
        "tolerance": ("1", "tolerance asked for, absolute in SI units and relative alike"),
        "status": ("1", "how it ended"),
        **_ERRORS,
        "simulated": ("s", "simulated time of all starts together"),
        "seconds": ("s", "processor time of that, median of the rounds; of a run that failed, up to then"),
        "evaluations": ("1", "evaluations of the chain's equations in it; null if the method does not count them"),
        "accepted": ("1", "accepted steps in it"),
        "rejected": ("1", "rejected steps in it; null if the solver does not tell"),
        **_MACHINE,
    },
    "walks": {
        "links": ("1", "number of links"),
        "frequency": ("Hz", "turns of a sprocket per second that the speed along the ellipse stands for"),
        "preset": ("1", "parameters that the walks are drawn around; walk k has the seed k, whatever the method"),
        **_CONTESTANT,
        "name": ("1", "as --methods takes it"),
        "walks": ("1", "walks that were timed, the methods in turn"),
        "at_rest": ("1", "those of them that came to rest: the medians are theirs"),
        "seconds": ("s", "processor time of one core from the release to rest, median"),
        "each": ("s", "the same of each walk"),
        "reference_seconds": ("s", "the same of rkf78 at 1e-6 in the same run, median"),
        "attempts": ("1", "steps tried, accepted or not, median"),
        "walk_time": ("s", "simulated time from the release to rest, median"),
        **_LEDGER,
        **_MACHINE,
    },
    "ensembles": {
        "name": ("1", "folder of the ensembles"),
        "links": ("1", "number of links"),
        "frequency": ("Hz", "turns of the sprocket per second at the release"),
        "preset": ("1", "parameters that samples are drawn around"),
        "start": ("1", "how the chain starts"),
        "samples": ("1", "walks of each method, the same samples for all"),
        "device": ("1", "where they ran"),
        **_CONTESTANT,
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
        **_MACHINE,
    },
    "hard_cases": {
        "group": ("1", "kind of difficulty"),
        "case": ("1", "short name"),
        "what": ("1", "what happens"),
        "method": ("1", "method of the engine"),
        "status": ("1", "how it ended; refused if nothing was run"),
        "result": ("1", "what came out"),
        "seconds": ("s", "processor time, compilation apart"),
        "simulated": ("s", "simulated time"),
        "attempts": ("1", "steps tried"),
        "energy_error": ("1", "what the energy ledger leaves open, as a fraction of the energy"),
        "sound": ("1", "whether status, result and energy are such as the case may have"),
        **_MACHINE,
    },
}
