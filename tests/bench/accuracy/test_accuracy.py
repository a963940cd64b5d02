"""`warpchain bench accuracy`: its measures against independent ones, its files, and the command itself."""

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.reports.test_sweep_page import Document
from tests.support import command_line
from tests.support.command_line import Answer, Command, process
from warpchain.bench.accuracy.columns import COLUMNS
from warpchain.bench.accuracy.ensembles import Ensemble, run_ensemble, summary
from warpchain.bench.accuracy.figures import figures
from warpchain.bench.accuracy.method_settings import LOOSE, TIGHT, MethodSetting, default_method_settings
from warpchain.bench.accuracy.plan import FILE, Plan, load_document
from warpchain.bench.accuracy.walk_costs import walk_costs
from warpchain.bench.problems.hard_starts import SOFT, dropped
from warpchain.bench.problems.scipy_solvers import GAVE_UP, scipy_points
from warpchain.bench.problems.work_precision import (
    Problem,
    errors,
    evaluations,
    make_problem,
    make_reference,
    points,
)
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.kernels.methods.method import find_method, method_names
from warpchain.oracle import motion_equations

command = command_line.command

TINY = "--links 8 --methods rkf78,dp5 --problems flight --tolerances 1e-3,1e-6 --no-scipy --rounds 1 --presets soft"
WALKS = "--start ellipse --samples 3"


def silent(text: str) -> None:
    """Progress that nobody looks at."""


@pytest.fixture(scope="module")
def short() -> Problem:
    """A flight of 8 links for a millisecond."""
    return replace(make_problem("flight", 8), duration=1e-3)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[Answer, Path]:
    """What a tiny run of all parts but the reversals answers, and its folder."""
    folder = tmp_path_factory.mktemp("accuracy")
    parts = "--parts work-precision,walks,ensembles,hard-cases"
    line = f"bench accuracy -o new/deep {TINY} {WALKS} {parts} --cases links-4,refused,hopeless-damping"
    return process(*line.split(), folder=folder), folder / "new/deep"


# --- work and precision ---


def test_errors_shrink_with_the_tolerance_and_scipy_agrees(short: Problem) -> None:
    """Tighter tolerances err less, and SciPy on the NumPy model ends where the reference does."""
    true = make_reference(short)
    assert true.trust.position_error < 1e-12 and true.trust.velocity_error < 1e-9
    found = points(short, true, ["dp5"], [1e-3, 1e-6, 1e-9], 2, silent)
    distances = [point.position_error for point in found]
    assert distances[0] > 3 * distances[1] > 30 * distances[2] > 0
    assert all(point.status == "finished" and point.seconds > 0 and point.simulated == 1e-3 for point in found)
    theirs = scipy_points(short, true, [1e-9], silent)
    assert [point.method for point in theirs] == ["DOP853 (SciPy)", "Radau (SciPy)"]
    for point in theirs:
        assert point.position_error < 1e-9 and point.velocity_error < 1e-6
        assert point.evaluations is not None and point.evaluations > 100


def test_scipy_that_takes_too_long_is_given_up(short: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run beyond the patience ends with a status of its own and no errors."""
    monkeypatch.setattr("warpchain.bench.problems.scipy_solvers.PATIENCE", 1e-9)
    true = make_reference(short)
    (point, _) = scipy_points(short, true, [1e-3], silent)
    assert point.status == GAVE_UP and math.isnan(point.position_error)


def test_errors_are_distances(short: Problem) -> None:
    """A link moved by (3, 4) µm is 5 µm off, whatever its angle; so are velocities."""
    (start,) = short.starts
    moved = start[0].copy(), start[1].copy()
    moved[0][3] += [3e-6, 4e-6, 1.0]
    moved[1][5] += [0.3, -0.4, 9.0]
    found = errors(short, [moved], [start])
    assert (found.position_error, found.velocity_error) == (pytest.approx(5e-6), pytest.approx(0.5))
    assert math.isnan(found.momentum_error)


def test_the_impulse_is_what_gravity_does_not_explain() -> None:
    """A thing in free fall has had no impulse; one that gained a momentum more has had that."""
    state = dropped(links=8)
    problem = Problem("impact", 8, SOFT, (state,), 0.01, "floor")
    falling = state[0], state[1] - [0.0, SOFT.gravity * 0.01, 0.0]
    impulse = problem.momenta([falling])
    assert impulse is not None and np.abs(impulse).max() < 1e-15
    mass = motion_equations.link_masses(8, SOFT).sum()
    struck = falling[0], falling[1] + [0.2, 0.5, 0.0]
    assert problem.momenta([struck]) == pytest.approx(np.array([[0.2 * mass, 0.5 * mass]]))
    harder = falling[0], falling[1] + [0.2, 0.6, 0.0]
    found = errors(problem, [harder], [struck])
    assert found.momentum_error == pytest.approx(0.1 / math.hypot(0.2, 0.5))
    assert found.momentum_bias == pytest.approx(0.2)


def test_angular_momentum_of_a_circling_loop() -> None:
    """A circle of links that turns as a whole has Σ (m r² + I) Ω about its centre."""
    angle = 2 * np.pi * np.arange(8) / 8
    circle = np.column_stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), angle])
    turning = 7.0 * np.column_stack([-circle[:, 1], circle[:, 0], np.ones(8)])
    problem = Problem("sprocket", 8, SOFT, ((circle, turning),), 0.1, "sprocket", 1.0)
    inertia = (motion_equations.link_masses(8, SOFT) * 0.01 + motion_equations.link_inertias(8, SOFT)).sum()
    assert problem.momenta([(circle, turning)]) == pytest.approx(np.array([[7.0 * inertia]]))


def test_evaluations_are_counted_by_stages() -> None:
    """13 a step, 12 a rejected one for Fehlberg's pair; 6 an attempt for Dormand and Prince's, but after impulses."""
    assert evaluations("rkf78", 10, 3, 5) == 13 * 10 + 12 * 3
    assert evaluations("dp5", 10, 3, 0) == 6 * 13 + 1
    assert evaluations("dp5", 10, 3, 4) == 6 * 13 + 1 + 4
    assert evaluations("bs32", 10, 3, 99) == 3 * 13 + 1 + 10
    assert evaluations("rodas5p", 10, 3, 5) == 8 * 10 + 7 * 3
    for method in method_names():
        assert (evaluations(method, 10, 3, 0) is None) == find_method(method).has_rigid_flight


@pytest.mark.slow
def test_impacts_and_sprocket_converge_to_what_they_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """With contacts, impulse and angular momentum agree to the accuracy that the methods are told apart by.

    Impacts end after their first millisecond, before chaos: 1e-12 of a start is 2e-5 of the impulse then. At tolerances
    of 0.5 to 2e-6 ``dp5`` errs by 0.4 to 0.8 %, SciPy by 1.6 % with a standard deviation of 0.2 %.
    """
    monkeypatch.setattr(
        "warpchain.bench.problems.scipy_solvers.PATIENCE", math.inf
    )  # 30 s of a core alone are more of a shared one
    impact, sprocket = replace(make_problem("impact", 20), duration=1e-3), make_problem("sprocket", 60)
    for problem, close in ((impact, 0.03), (sprocket, 1e-3)):
        true = make_reference(problem)
        assert true.trust.momentum_error < close / 3
        found = points(problem, true, ["dp5"], [1e-6], 1, silent) + scipy_points(problem, true, [1e-6], silent)
        assert len(found) == (2 if problem is impact else 1)
        for point in found:
            assert point.status == "finished" and abs(point.momentum_bias) <= 1.5 * point.momentum_error
            assert point.momentum_error < close


# --- ensembles ---


def test_an_ensemble_goes_on_and_is_summed_up(tmp_path: Path) -> None:
    """Methods added later join those that are there, whose walks and costs stay; statistics are those of the walks."""
    ensemble = Ensemble(links=8, preset="soft", start="ellipse", samples=3)
    for method_setting in (LOOSE, TIGHT):
        run_ensemble(tmp_path, ensemble, method_setting, silent)
    before = summary(tmp_path, ensemble)
    shards = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.h5")}
    assert shards
    for method_setting in (MethodSetting("dp5", 1e-4), LOOSE, TIGHT):
        run_ensemble(tmp_path, ensemble, method_setting, silent)
    after = summary(tmp_path, ensemble)
    assert [(row["method"], row["tolerance"]) for row in after] == [("rkf78", 1e-6), ("rkf78", 1e-9), ("dp5", 1e-4)]
    assert repr(after[:2]) == repr(before)
    assert all(path.stat().st_mtime_ns == time for path, time in shards.items())
    for row in after:
        distances = np.array(row["dx"])
        assert row["at_rest"] == 3 and row["failed"] == {} and row["missing"] == 0
        assert row["mean"] == pytest.approx(distances.mean()) and row["sd"] == pytest.approx(distances.std(ddof=1))
        assert row["mean_interval"][0] <= row["mean"] <= row["mean_interval"][1]
        assert 0 < row["seconds_per_walk"] < 100 and math.isnan(row["walks_per_second"])
        assert row["difference_loose"] == pytest.approx(row["mean"] / after[0]["mean"] - 1)
        assert 0 < row["p_loose"] <= 1
        assert 0 < row["ledger"] <= row["greatest_ledger"]
    loose, tight, coarse = (row["ledger"] for row in after)
    assert tight < loose < 1e-3 and 10 * loose < coarse < 0.1
    assert after[0]["difference_loose"] == after[0]["ks_loose"] == 0 and after[0]["passes"]


def test_method_settings_that_differ_in_the_last_digit_have_different_names() -> None:
    """Names and titles hold every digit of tolerances and settings, so no two share a folder or a row."""
    next_tolerance, next_area = math.nextafter(1e-4, 1), math.nextafter(0.7, 1)
    alike = [
        MethodSetting("rkf78", tolerance, (("soften_pile", True), ("soften_area", area)))
        for tolerance in (1e-4, next_tolerance)
        for area in (0.7, next_area)
    ]
    assert len({one.name for one in alike}) == len({one.title for one in alike}) == len(alike)
    assert [MethodSetting.parse(one.name) for one in alike] == alike


def test_method_settings_are_read_as_they_are_named() -> None:
    """A name with tolerance and settings, in any order, is read back from itself, which a folder's name needs."""
    for one in (
        MethodSetting("dp5", 1e-6),
        MethodSetting("hybrid", 1e-6),
        MethodSetting("bs32", 1e-9),
        MethodSetting("os32", 1e-3, (("soft_tolerance", 3e-3), ("controller", "pi"))),
        MethodSetting("rkf78", 2e-3, (("soften_pile", True), ("soften_area", 0.7), ("soften_drive", True))),
    ):
        assert MethodSetting.parse(one.name) == one
    assert MethodSetting.parse("dp5") == MethodSetting("dp5", 1e-6)
    assert MethodSetting.parse("hybrid") == MethodSetting("hybrid", 1e-4)
    assert one == MethodSetting.parse("rkf78@2e-3+soften_drive+soften_area=0.7+soften_pile")
    assert one.title == "rkf78 at 0.002, soften pile, soften area 0.7, soften drive"
    content = Ensemble(8, "soft").content(MethodSetting.parse("dp5@1e-3+soften_pile+soften_area=0.5"))
    expected = {"method": "dp5", "tolerance": 1e-3, "soften_pile": True, "soften_area": 0.5, "device": "cpu"}
    assert content["options"] == expected


@pytest.mark.parametrize("word", METHODS_BY_NEED)
def test_words_are_what_the_options_make_of_them(word: str) -> None:
    """A word means the options that it means in a walk, takes other settings, and is found again in a title."""
    one = MethodSetting.parse(word)
    assert Options.model_validate(one.options) == Options.model_validate({"method": word})
    assert one.word == word and one.title.startswith(f"{word}: {one.method} at ")
    changed = MethodSetting.parse(f"{word}@3e-5+contact_step=1e-5")
    wanted = {"method": word, "tolerance": 3e-5, "contact_step": 1e-5}
    assert Options.model_validate(changed.options) == Options.model_validate(wanted)
    assert changed.word == ""


def test_defaults_are_words_and_every_method() -> None:
    """Each method has its turn, the words among them, none of them twice."""
    chosen = default_method_settings()
    assert len(set(chosen)) == len(chosen)
    assert {one.method for one in chosen} == set(method_names())
    assert {one.word for one in chosen} - {""} == set(METHODS_BY_NEED)
    on_gpu = default_method_settings("cuda")
    assert len(set(on_gpu)) == len(on_gpu) and {one.method for one in on_gpu} == {"rkf78", "dp5", "bs32", "os32"}


def test_the_tight_reference_is_an_extra() -> None:
    """The dear ensembles of rkf78 at 1e-9 are made on demand only."""
    assert not Plan(parts=["ensembles"], methods=["standard"]).tight
    assert Plan(parts=["ensembles"], methods=["standard"], tight=True).tight


# --- whole walks ---


def test_walks_are_timed_in_turn_and_compared_with_the_reference() -> None:
    """Methods take turns with the same samples, the reference among them; rows hold medians of walks at rest."""
    said: list[str] = []
    hopeless = MethodSetting.parse("dp5+smallest_step=1.9e-5")
    rows = walk_costs(8, [MethodSetting.parse("dp5@1e-4"), hopeless, LOOSE], 2, said.append)
    reference, loose, failed = rows
    assert [row["name"] for row in rows] == [LOOSE.name, "dp5@0.0001", hopeless.name]
    assert [line.split(", ", 1)[1] for line in said[1:]] == [row["title"] for row in rows] * 2
    walks = [
        warpchain.walk(links=8, start="ellipse", method="dp5", tolerance=1e-4, seed=seed, frame_interval=None)
        for seed in (0, 1)
    ]
    released = [walk.energy["kinetic_at_release"] + walk.energy["potential_at_release"] for walk in walks]
    errors = [abs(walk.energy["residual"]) / energy for walk, energy in zip(walks, released, strict=True)]
    assert loose["at_rest"] == 2
    assert (loose["ledger"], loose["greatest_ledger"]) == (np.mean(errors), max(errors))
    assert loose["walk_time"] == np.mean([walk.walk_time for walk in walks])
    assert loose["attempts"] == np.mean([walk.steps_accepted + walk.steps_rejected for walk in walks])
    assert reference["ledger"] < loose["ledger"] / 10
    for row in (reference, loose):
        assert row["seconds"] == np.mean(row["each"]) and min(row["each"]) > 0
        assert row["reference_seconds"] == reference["seconds"]
    assert failed["at_rest"] == 0 and failed["walks"] == 2 and math.isnan(failed["seconds"])


# --- the command and its files ---


def test_command_writes_everything(results: tuple[Answer, Path]) -> None:
    """Paths of the results, a figure for each problem and ensemble and for the table, and of the page are printed."""
    answer, folder = results
    assert (answer.status, answer.err) == (0, "")
    names = [Path(line).name for line in answer.out.splitlines()]
    pictures = ["work_precision_flight_8.png", "walks_8.png", "ensemble_n8-15Hz-soft-ellipse-cpu-3.png"]
    assert names == [FILE, *pictures, "hard_cases.png", "accuracy.html"]
    for name in names[1:-1]:
        assert (folder / name).read_bytes().startswith(b"\x89PNG")


def test_json_has_a_unit_for_every_number(results: tuple[Answer, Path]) -> None:
    """Every column of every table has unit and meaning, all numbers are finite or null, the machine is named."""
    document = load_document(results[1])
    tables: dict[str, list[dict[str, Any]]] = {name: document[name] for name in COLUMNS}
    assert tables.pop("reversals") == [] and all(tables.values())
    ensembles = tables.pop("ensembles")
    tables["ensembles"] = [one for row in ensembles for one in row["methods"]]
    for name, rows in tables.items():
        columns = document["columns"][name]
        assert columns == {key: {"unit": unit, "meaning": text} for key, (unit, text) in COLUMNS[name].items()}
        for row in rows:
            assert set(row) - {"method"} <= set(columns)
    points = {(row["method"], row["tolerance"]): row for row in document["points"]}
    assert set(points) == {(method, tolerance) for method in ("rkf78", "dp5") for tolerance in (1e-3, 1e-6)}
    for method in ("rkf78", "dp5"):
        assert points[method, 1e-6]["position_error"] < 0.5 * points[method, 1e-3]["position_error"]
        assert points[method, 1e-3]["momentum_error"] is None
    assert [row["case"] for row in document["hard_cases"]] == ["hopeless-damping"] * 2 + ["links-4"] * 2 + [
        "refused"
    ] * 2
    (machine,) = document["machines"]
    assert machine["processor"] and machine["warp-lang"] and machine["scipy"]


def test_page_says_the_same_and_stands_alone(results: tuple[Answer, Path]) -> None:
    """The page has each part that was run with their figures and tables, the machine, and loads nothing."""
    text = (results[1] / "accuracy.html").read_text(encoding="utf-8")
    page = Document(text)
    assert list(page.texts) == ["", "work-and-precision", "whole-walks", "ensembles", "hard-cases", "machines"]
    assert len(page.images) == 4 and all(image.startswith("data:image/png;base64,") for image in page.images)
    assert len(page.rows["work-and-precision"]) == 1 + 4
    assert [row[:2] for row in page.rows["ensembles"][1:]] == [
        ["reference: rkf78 at 1e-06", "3"],
        ["dp5 at 1e-06", "3"],
    ]
    assert [row[:4] for row in page.rows["whole-walks"][1:]] == [
        ["8", "reference: rkf78 at 1e-06", "1", "1"],
        ["8", "dp5 at 1e-06", "1", "1"],
    ]
    assert len(page.rows["hard-cases"]) == 1 + 6
    assert "warp-lang" in page.texts["machines"]
    assert not re.findall(r"https?:|@import|url\(|<link|<script", text)
    assert "nan" not in page.texts["work-and-precision"].lower()


def test_other_parts_and_methods_stay(command: Command, tmp_path: Path) -> None:
    """A part that is run again leaves the other parts and the other methods as they were."""
    line = "bench accuracy -o new --parts hard-cases --cases links-4,refused --methods"
    assert command(*line.split(), "dp5").status == 0
    first = load_document(tmp_path / "new")
    assert command(*line.split(), "rkf78").status == 0
    line = f"bench accuracy -o new --parts work-precision {TINY} --json"
    answer = command(*line.split())
    document = json.loads(answer.out)
    assert answer.status == 0 and document == load_document(tmp_path / "new")
    kept = {(row["case"], row["method"]): row for row in document["hard_cases"]}
    assert set(kept) == {(case, method) for case in ("links-4", "refused") for method in ("dp5", "rkf78")}
    for row in first["hard_cases"]:
        assert kept[row["case"], row["method"]] == row
    assert len(document["points"]) == 4
    assert {picture.name for picture in figures(document)} == {"work_precision_flight_8", "hard_cases"}


REFUSED = {
    "--links 61": "--links.links: 61 is odd",
    "--links many": "--links: 'many' is no whole number",
    "--links 20": "scene.links: 20 links of",
    "--methods rk4": "--methods: 'rk4' is unknown",
    "--methods dp5@soon": "--methods: 'dp5@soon' has no number after the @",
    "--methods dp5+soft": "--methods: 'soft' is unknown",
    "--methods quick": "--methods: 'quick' is unknown; give one of standard, explicit, reference, rkf78",
    "--methods dp5+skin": "--methods: skin in 'dp5+skin' has no value; write skin=NUMBER",
    "--methods dp5+controller": "--methods: controller in 'dp5+controller' has no value; write controller=WORD",
    "--methods dp5+controller=p": "--methods.controller: 'p' is unknown",
    "--methods dp5+skin=thin": "--methods: 'dp5+skin=thin' has no number after skin=",
    "--methods dp5+skin=-1": "--methods.skin: -1.0 is not greater than 0",
    "--methods dp5+soften_pile=1": "--methods: soften_pile in 'dp5+soften_pile=1' takes no value",
    "--methods dp5@1": "--methods.tolerance: 1.0 is greater than 0.1",
    "--tolerances 0": "--tolerances.tolerance: 0.0 is less than 1e-13",
    "--tolerances tight": "--tolerances: 'tight' is no number",
    "--parts all": "--parts: 'all' is unknown",
    "--problems jump": "--problems: 'jump' is unknown",
    "--presets hard": "preset: 'hard' is unknown",
    "--cases pile": "--cases: 'pile' is unknown; give one of pile-slow-walk,",
    "--device gpu": "options.device: 'gpu' is no device",
    "--start up": "'--start'",
    "--samples 0": "'--samples'",
    "--methods ,": "--methods: nothing in it",
}
"""Bad arguments → what the line of refusal holds."""


@pytest.mark.parametrize("arguments", REFUSED)
def test_bad_input_is_refused_in_one_line(command: Command, tmp_path: Path, arguments: str) -> None:
    """Status 2, one line that names what is wrong, and no folder."""
    answer = command("bench", "accuracy", "-o", "new", *arguments.split())
    assert (answer.status, answer.out) == (2, "")
    assert answer.err.startswith("error: ") and answer.err.count("\n") == 1
    assert REFUSED[arguments] in answer.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", ["", "[1", "[]", '{"format": "warpchain accuracy", "version": 99}'])
def test_a_foreign_file_is_not_overwritten(command: Command, tmp_path: Path, content: str) -> None:
    """A file that is no such document, or of another version, is refused and left as it is."""
    (tmp_path / FILE).write_text(content)
    answer = command("bench", "accuracy", "-o", ".", "--parts", "hard-cases", "--cases", "refused")
    assert (answer.status, answer.out) == (2, "")
    assert FILE in answer.err and answer.err.count("\n") == 1
    assert (tmp_path / FILE).read_text() == content


def test_bench_itself_still_measures_steps(command: Command) -> None:
    """`bench` without a sub-command is what it was, and both tell of each other in help."""
    assert "--rounds" in command("bench", "--help").out and "accuracy" in command("bench", "--help").out
    assert command("bench", "--links", "61").err.startswith("error: bench.links: 61 is odd")
    assert "--tolerances" in command("bench", "accuracy", "--help").out
