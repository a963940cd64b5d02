"""Fills in the tables of README.md and draws its figures, from the folder that has those of its sweeps."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

import warpchain
from studies.common import publish, run_study, table, write_rows
from studies.video.calibration import CAMERA, Calibration, Wanted, calibrate, set_of_videos
from studies.video.drawing import SYMBOLS, corner, coverage_figure, line_figure
from warpchain import video

FOLDER = Path(__file__).parent
FIVE, TWENTY = (60, 5.0), (60, 20.0)
SETS: dict[str, Wanted] = {
    "1 video: 20 Hz": {TWENTY: 1},
    "2 videos: 5, 20 Hz": {FIVE: 1, TWENTY: 1},
    "4 videos: 2 of each": {FIVE: 2, TWENTY: 2},
}
PAIR = SETS["2 videos: 5, 20 Hz"]
CALIPERS = 5e-5  # Standard error of a roller's radius that was measured with calipers [m]
HEIGHTS = {"one for all videos": "one_height", "one for each video": "own_heights", "that of a fixed sprocket": "vice"}
"""How the heights of the releases of hidden chains were chosen → the block of video_truths."""
OTHERS = {"e_t = 0.3": "tangential", "links 5 % heavier": "heavier"}
EXACT = replace(CAMERA, scale=1e-6, floor=1e-6, origin=1e-6, roll=1e-6, outline=1e-6, release=1e-6, clock=1e-6)
"""A camera without errors other than noise, and those of the loop's speed."""


def percent(share: float) -> str:
    """Two digits."""
    return f"{100 * share:.2g} %"


def experiments_table(training: video.TrainingSet) -> str:
    """Widths for each video and each pair of videos of a chain in the middle, and R if r was measured."""
    every = training.experiments
    sets: list[Wanted] = [*({one: 1} for one in every), *({one: 1, two: 1} for one, two in combinations(every, 2))]
    middle, found = training.values.mean(axis=0), []
    nearest = int((((training.values - middle) / training.values.std(axis=0)) ** 2).sum(axis=1).argmin())
    for wanted in sets:
        seen = set_of_videos(training, nearest, wanted, np.zeros(9), np.random.default_rng(0))
        alone = training.posterior(seen, CAMERA)
        measured = alone.given(circle_radius=(middle[alone.names.index("circle_radius")], CALIPERS))
        radius = (measured.sigma / middle)[alone.names.index("sprocket_radius")]
        found.append((" + ".join(f"{n}/{f:g}" for n, f in wanted), *(alone.sigma / middle), radius))
    singles, pairs = found[: len(every)], sorted(found[len(every) :], key=lambda row: row[2])
    rows = ((name, *map(percent, numbers)) for name, *numbers in [*singles, *pairs])
    return table(("links/Hz", *SYMBOLS.values(), "R, r by calipers"), rows)


def calibration_rows(found: Calibration) -> Iterator[str]:
    """Of each parameter width, bias in standard deviations, and coverage of 68 and 95 %."""
    sizes = zip(found.width, found.bias, found.coverage(1), found.coverage(1.96), strict=True)
    return (f"{percent(width)}, {bias:+.1f}, {100 * a:.0f}, {100 * z:.0f}" for width, bias, a, z in sizes)


def file_rows(found: Mapping[tuple[str, str], Calibration]) -> Iterator[dict[str, object]]:
    """Rows of the file: of each truth, set of videos and parameter what the page has in one cell."""
    for (truth, videos), one in found.items():
        at = {"truth": truth, "videos": videos, "chains": one.chains, "refused": one.refused}
        for row in zip(one.names, one.width, one.bias, one.coverage(1), one.coverage(1.96), strict=True):
            yield at | dict(zip(("parameter", "width", "bias", "within_68", "within_95"), row, strict=True))


def pitfalls_table(training: video.TrainingSet, truths: video.TrainingSet) -> str:
    """Coverage of 95 % intervals with one error of the camera at twice its σ, allowed for or not."""
    errors = {
        "none": (np.zeros(9), 0.0),
        "floor 1 mm too low": (1e-3 * np.eye(9)[1], 0.0),
        "scale 0.5 %": (5e-3 * np.eye(9)[0], 0.0),
        "axis of the sprocket 1 mm off": (1e-3 * np.eye(9)[2], 0.0),
        "camera rolled by 0.3°": (5.2e-3 * np.eye(9)[3], 0.0),
        "clock 0.4 % fast": (4e-3 * np.eye(9)[8], 0.0),
        "one frame in 40 dropped": (np.eye(9)[8] / -40, 0.0),
        "release 4 ms off": (np.zeros(9), 4e-3),
    }
    rows = []
    for name, (shared, delay) in errors.items():
        for believed, which in ((CAMERA, "allowed for"), (EXACT, "not")):
            found = calibrate(training, truths, PAIR, shared=shared, delay=delay, believed=believed)
            cells = (f"{100 * share:.0f}" for share in found.coverage(1.96))
            rows.append((name, which, *cells, percent(found.refused)))
    return table(("error", "errors of the camera", *SYMBOLS.values(), "refused"), rows)


def lines_table(training_sets: Mapping[str, video.TrainingSet]) -> str:
    """Friction lines of chains of some training_sets, each recorded once."""
    rows, random = [], np.random.default_rng(2)
    for name, training in training_sets.items():
        for at, (links, frequency) in enumerate(training.experiments):
            found = []
            for chain, values in enumerate(training.values[:256]):
                clip = training.videos[chain][at][chain % len(training.videos[chain][at])].seen(
                    CAMERA, CAMERA.errors(random), random
                )
                line = video.friction_line(clip, CAMERA)
                found.append((line.friction - values[0], line.error, values[0]))
            error, sigma, friction = np.array(found).T
            inside = [f"{100 * (np.abs(error) < size * sigma).mean():.0f}" for size in (1, 1.96)]
            width = float(np.median(sigma / friction))
            rows.append((name, f"{links:g}/{frequency:g}", percent(width), f"{np.median(error / sigma):+.2f}", *inside))
    return table(("chains", "links/Hz", "σ of μ", "bias / σ", "within σ / %", "within 1.96 σ / %"), rows)


def main(folder: Path) -> None:
    """Calibrate, compare, draw."""
    results: dict[str, warpchain.SweepResult] = {}

    def training_set_of(sweep: str, block: str = "main") -> video.TrainingSet:
        results[sweep] = results.get(sweep) or warpchain.load(folder / sweep)
        return video.TrainingSet.of(results[sweep].blocks[block])

    training = training_set_of("video_pair")
    hidden = {kind: training_set_of("video_truths", block) for kind, block in HEIGHTS.items()}
    others = {kind: training_set_of("video_truths", block) for kind, block in OTHERS.items()}
    others["paper's joints"] = training_set_of("video_truths_paper")

    def found_in(truths: Mapping[str, video.TrainingSet]) -> dict[tuple[str, str], Calibration]:
        sets = {(kind, name): wanted for kind in truths for name, wanted in SETS.items()}
        return {
            (kind, name): calibrate(training, truths[kind], wanted)
            for (kind, name), wanted in sets.items()
            if max(wanted.values()) <= len(truths[kind].videos[0][0])
        }

    def rows_of(found: Mapping[tuple[str, str], Calibration]) -> str:
        head = ("truth", "videos", *SYMBOLS.values(), "chains", "refused")
        rows = ((*at, *calibration_rows(one), str(one.chains), percent(one.refused)) for at, one in found.items())
        return table(head, rows)

    known, unlike = found_in(hidden), found_in(others)
    write_rows(FOLDER / "results" / "calibration.csv", file_rows(known | unlike), *results.values())
    own = hidden["one for each video"]
    tables = {
        "experiments": experiments_table(training),
        "calibration": rows_of(known),
        "other chains": rows_of(unlike),
        "pitfalls": pitfalls_table(training, own),
        "lines": lines_table({"video_pair": training} | others),
    }
    pairs = {kind: known[kind, "2 videos: 5, 20 Hz"] for kind in hidden}
    publish(FOLDER, tables, {"coverage": coverage_figure(pairs)}, dpi=130)
    outlines = {(5, 1.906): (-59.9, 62.1, 13.4, 335.8), (20, 7.648): (-68.7, 62.1, 13.4, 330.0)}
    seen = [
        video.read(
            FOLDER / f"hidden/60_links_{hz}_Hz.txt", links=60, frequency=hz, unit="mm", outline=outline, speed=speed
        )
        for (hz, speed), outline in outlines.items()
    ]
    answer, line = training.posterior(seen), video.friction_line(seen[1])
    print(f"\nthe hidden chain\n{answer}\n{line}")
    print(f"with r by calipers\n{answer.given(circle_radius=(4.05e-3, CALIPERS))}")
    publish(FOLDER, {}, {"corner": corner(answer)}, dpi=110)
    publish(FOLDER, {}, {"line": line_figure(line)})


if __name__ == "__main__":
    run_study(main)
