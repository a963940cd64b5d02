"""``warpchain bench accuracy``: error against cost of every method, its walks and ensembles of them, the hard cases.

Four parts, each of which can be run by itself: what the others have left in the folder stays. Numbers are kept in one
JSON file with the machine they were measured on, figures and a page are drawn from it.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from warpchain.bench.accuracy.columns import COLUMNS
from warpchain.bench.accuracy.ensembles import Ensemble, default_samples, run_ensemble, summary
from warpchain.bench.accuracy.method_settings import LOOSE, TIGHT, MethodSetting, default_method_settings
from warpchain.bench.accuracy.walk_costs import walk_costs
from warpchain.bench.cpu_steps import machine
from warpchain.bench.problems.hard_cases import HARD_CASES
from warpchain.bench.problems.work_precision import (
    PROBLEMS,
    TOLERANCES,
    Errors,
    make_problem,
    make_reference,
    methods,
    points,
)
from warpchain.engine.devices import start_device
from warpchain.files import replacing
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.inputs.scene import Scene, check_scene
from warpchain.inputs.validation import InputError, shown, suggestion, validated
from warpchain.sweeps.plan import load_sweep

PARTS: Final = ("work-precision", "walks", "ensembles", "hard-cases")
FILE: Final = "accuracy.json"
FORMAT: Final = "warpchain accuracy"
VERSION: Final = 2
SCIPY_TOLERANCES: Final = (1e-3, 1e-6, 1e-9)
"""Those of the tolerances that SciPy's solvers, which take a minute each, are run at."""

KEYS: Final = {
    "references": ("problem", "links"),
    "points": ("problem", "links", "method", "tolerance"),
    "walks": ("links", "name"),
    "ensembles": ("name",),
    "hard_cases": ("case", "method"),
}
"""Tables of the document and the columns that tell their rows apart."""

Row = dict[str, Any]
Report = Callable[[str], None]
Document = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is to be run, checked; see `make_plan`."""

    parts: tuple[str, ...]
    method_settings: tuple[MethodSetting, ...]
    tolerances: tuple[float, ...]
    links: tuple[int, ...]
    problems: tuple[str, ...]
    ensembles: tuple[Ensemble, ...]
    tight: bool
    cases: tuple[str, ...]
    rounds: int
    scipy: bool

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods, each once."""
        chosen = {one.method for one in self.method_settings}
        return tuple(name for name in methods() if name in chosen)


def make_plan(
    *,
    parts: Sequence[str] = PARTS,
    method_settings: Sequence[str] | None = None,
    tolerances: Sequence[float] = TOLERANCES,
    links: Sequence[int] = (60, 150),
    problems: Sequence[str] = PROBLEMS,
    presets: Sequence[str] = ("soft", "paper"),
    start: str = "spinning",
    samples: int | None = None,
    device: str = "cpu",
    tight: bool = False,
    cases: Sequence[str] | None = None,
    rounds: int = 5,
    scipy: bool = True,
) -> Plan:
    """Check what is asked for, before anything is run.

    Args:
        parts: Some of `PARTS`.
        method_settings: Methods, each as `MethodSetting.parse` reads it; None: `default_method_settings`. Tolerances
            and other settings are for walks and ensembles.
        tolerances: Of the work–precision diagrams.
        links: Numbers of links in the diagrams, the walks and the ensembles.
        problems: Some of `PROBLEMS`.
        presets: Of the ensembles.
        start: Of the ensembles.
        samples: Walks of each ensemble; None: 200, and 60 from 100 links on.
        device: Where the ensembles run; the other parts are measured on one CPU core.
        tight: Make the ensembles of `TIGHT` as well.
        cases: Names of hard cases; None: all.
        rounds: Measurements of each run in the diagrams, and walks of each method that are timed.
        scipy: Run SciPy's solvers as well.

    Raises:
        InputError: Something is unknown or impossible.
    """
    names = [case.name for case in HARD_CASES]
    for option, given, known in (
        ("--parts", parts, PARTS),
        ("--problems", problems, PROBLEMS),
        ("--cases", cases or (), names),
    ):
        for name in given:
            if name not in known:
                raise InputError(f"{option}: {shown(name)} is unknown; {suggestion(name, known)}")
    for tolerance in tolerances:
        validated(Options, {"tolerance": tolerance}, "--tolerances")
    for name in presets:
        preset(name)
    validated(Options, {"device": device}, "options")
    plan = Plan(
        parts=tuple(parts),
        method_settings=default_method_settings(device)
        if method_settings is None
        else tuple(MethodSetting.parse(text, device) for text in method_settings),
        tolerances=tuple(tolerances),
        links=tuple(validated(Scene, {"links": count}, "--links").links for count in links),
        problems=tuple(problems),
        ensembles=tuple(
            Ensemble(count, name, start, default_samples(count) if samples is None else samples, device)
            for count in links
            for name in presets
        ),
        tight=tight,
        cases=tuple(names if cases is None else cases),
        rounds=rounds,
        scipy=scipy,
    )
    if "work-precision" in parts and "sprocket" in problems:
        for count in plan.links:
            check_scene(Scene(links=count), preset("paper"))
    if "ensembles" in parts:
        start_device(validated(Options, {"device": device}, "options").device)
        for ensemble in plan.ensembles:
            for method_setting in plan.method_settings:
                load_sweep(ensemble.content(method_setting))
    return plan


def run_accuracy(folder: Path, plan: Plan, report: Report) -> Document:
    """Run a plan; the document in the folder grows with each problem, ensemble and case.

    Args:
        folder: Of the results; results of other parts, methods and cases in it are kept.
        plan: What is run.
        report: Called with a line of progress.

    Returns:
        The document as it is in the file: None for what is no finite number.

    Raises:
        InputError: The folder holds another kind of file under the name of the document.
        OSError: The folder cannot be read or written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    here = machine()
    if find_spec("scipy") is not None:
        here["scipy"] = version("scipy")
    _record(folder, here, {})
    if "work-precision" in plan.parts:
        for links in plan.links:
            for name in plan.problems:
                _record(folder, here, _problem_rows(plan, name, links, report), _scipy_note(plan))
    if "walks" in plan.parts:
        for links in plan.links:
            _record(folder, here, {"walks": walk_costs(links, plan.method_settings, plan.rounds, report)})
    if "hard-cases" in plan.parts:
        for case in HARD_CASES:
            for method in plan.methods if case.name in plan.cases else ():
                report(f"{case.what}, {method}")
                outcome = asdict(_outcome(case, method))
                row = {"group": case.group, "case": case.name, "what": case.what, "method": method, **outcome}
                _record(folder, here, {"hard_cases": [row]})
    if "ensembles" in plan.parts:
        for ensemble in plan.ensembles:
            on = here if ensemble.device == "cpu" else here | {"device": start_device(ensemble.device).name}
            about = {
                "name": ensemble.name,
                "title": ensemble.title,
                "frequency": ensemble.frequency,
                **asdict(ensemble),
            }
            references = (LOOSE, TIGHT) if plan.tight else (LOOSE,)
            for method_setting in dict.fromkeys((*references, *plan.method_settings)):
                run_ensemble(folder / "ensembles", ensemble, method_setting, report)
                row = about | {"methods": summary(folder / "ensembles", ensemble)}
                _record(folder, on, {"ensembles": [row]})
    return load_document(folder)


def load_document(folder: Path) -> Document:
    """Read what earlier runs have left in a folder.

    Raises:
        InputError: The file is not what its name says, or of another version.
        OSError: It cannot be read.
    """
    path = folder / FILE
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        raise InputError(f"{path}: not a JSON file; give another folder") from None
    if not isinstance(document, dict) or document.get("format") != FORMAT or document.get("version") != VERSION:
        raise InputError(f"{path}: not written by this version of bench accuracy; give another folder")
    return document


def _empty() -> Document:
    columns = {
        part: {name: {"unit": unit, "meaning": meaning} for name, (unit, meaning) in table.items()}
        for part, table in COLUMNS.items()
    }
    tables: Document = {table: [] for table in KEYS}
    return {"format": FORMAT, "version": VERSION, "machines": [], "notes": {}, "columns": columns, **tables}


def _record(folder: Path, on: dict[str, str], tables: Mapping[str, Sequence[Row]], scipy_note: str = "") -> None:
    """Put rows, measured on a machine, into the document of a folder; those with the same keys are replaced.

    The file is read again each time, so that another process that measures another part loses nothing.
    """
    document = load_document(folder) if (folder / FILE).exists() else _empty()
    if on not in document["machines"]:
        document["machines"].append(on)
    place = document["machines"].index(on)
    for table, rows in tables.items():
        for row in rows:
            keys = [[other[key] for key in KEYS[table]] for other in document[table]]
            own = [row[key] for key in KEYS[table]]
            at = keys.index(own) if own in keys else len(keys)
            document[table][at : at + 1] = [row | {"machine": place}]
    if not any("SciPy" in row["method"] for row in document["points"]) or scipy_note.startswith("SciPy's solvers run"):
        document["notes"] |= {"scipy": scipy_note} if scipy_note else {}
    with replacing(folder / FILE) as part:
        part.write_text(json.dumps(_plain(document), indent=1, allow_nan=False, ensure_ascii=False), encoding="utf-8")


def _problem_rows(plan: Plan, name: str, links: int, report: Report) -> dict[str, list[Row]]:
    """Run a problem with all methods: the row of its reference and those of its points."""
    report(f"{name}, {links} links: reference")
    problem = make_problem(name, links)
    true = make_reference(problem)
    found = points(problem, true, plan.methods, plan.tolerances, plan.rounds, report)
    if plan.scipy and find_spec("scipy") is not None:
        from warpchain.bench.problems.scipy_solvers import scipy_points

        found += scipy_points(problem, true, [x for x in plan.tolerances if x in SCIPY_TOLERANCES], report)
    row = {"problem": name, "links": links, "duration": problem.duration, "starts": len(problem.starts)}
    return {"references": [row | _error_columns(true.trust)], "points": [asdict(point) for point in found]}


def _error_columns(errors: Errors) -> dict[str, float]:
    """Errors under the names that `Point` has for them."""
    return {
        "position_error": errors.position,
        "velocity_error": errors.velocity,
        "momentum_error": errors.momentum,
        "momentum_bias": errors.bias,
    }


def _outcome(case: Any, method: str) -> Any:
    """What a method makes of a hard case; one that refuses it says so in its own words."""
    from warpchain.bench.problems.hard_cases import Outcome

    try:
        return case.subject.run(method)
    except InputError as error:
        return Outcome("refused", str(error), 0.0, 0.0, 0, math.nan, False)


def _scipy_note(plan: Plan) -> str:
    """What is there of SciPy and what is not."""
    if not plan.scipy:
        return "SciPy's solvers were left out on demand."
    if find_spec("scipy") is None:
        return "SciPy is not installed, so its solvers are missing: pip install 'warpchain[scipy]'."
    from warpchain.bench.problems.scipy_solvers import PATIENCE

    return (
        f"SciPy's solvers run on the NumPy model, once each, {PATIENCE:g} s at most: what took longer is missing. "
        "DOP853 does the flight and the impacts, Radau (with the pattern of its Jacobian) the flight; a turn of the "
        "sprocket has 100,000 contacts, too many for Python."
    )


def _plain(value: Any) -> Any:
    """As JSON has it: null for what is no finite number."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
