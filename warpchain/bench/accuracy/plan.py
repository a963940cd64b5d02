"""``warpchain bench accuracy``: error against cost of every method, its walks, ensembles, reversing joints, hard cases.

There are five parts, and each can be run by itself: what the others have left in the folder stays. Numbers are kept in
one JSON file with the machine they were measured on; figures and a page are drawn from it.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from warpchain.bench.accuracy.columns import COLUMNS
from warpchain.bench.accuracy.ensembles import Ensemble, default_samples, run_ensemble, summary
from warpchain.bench.accuracy.method_settings import LOOSE, TIGHT, MethodSetting, default_method_settings
from warpchain.bench.accuracy.walk_costs import walk_costs
from warpchain.bench.problems.hard_cases import HARD_CASES
from warpchain.bench.problems.reversals import reversals
from warpchain.bench.problems.scipy_solvers import PATIENCE, scipy_points
from warpchain.bench.problems.work_precision import PROBLEMS, TOLERANCES, make_problem, make_reference, points
from warpchain.bench.record import machine, plain
from warpchain.engine.devices import start_device
from warpchain.files import checked_output, make_folder, write_whole
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.inputs.scene import Scene, check_scene
from warpchain.inputs.validation import InputError, shown, suggestion, validated
from warpchain.kernels.methods.method import method_names
from warpchain.sweeps.plan import load_sweep

PARTS: Final = ("work-precision", "reversals", "walks", "ensembles", "hard-cases")
CASES: Final = tuple(case.name for case in HARD_CASES)
FILE: Final = "accuracy.json"
FORMAT: Final = "warpchain accuracy"
VERSION: Final = 4
SCIPY_TOLERANCES: Final = (1e-3, 1e-6, 1e-9)
"""Those of the tolerances that SciPy's solvers, which take a minute each, are run at."""
WITH_SCIPY: Final = (
    f"SciPy's solvers run on the NumPy model, once each, {PATIENCE:g} s at most: what took longer is missing. "
    "DOP853 does the flight and the impacts, Radau (with the pattern of its Jacobian) the flight; a turn of the "
    "sprocket has 100,000 contacts, too many for Python."
)
WITHOUT_SCIPY: Final = (
    "SciPy's solvers are missing: they were left out on demand, or SciPy is not installed "
    "(pip install 'warpchain[scipy]')."
)

KEYS: Final = {
    "references": ("problem", "links"),
    "points": ("problem", "links", "method", "tolerance"),
    "reversals": ("start", "friction_smoothing", "method", "tolerance"),
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
    """What is to be run, checked when it is made.

    Attributes:
        parts: Some of `PARTS`.
        methods: Each as `MethodSetting.parse` reads it; None: `default_method_settings`. Tolerances and other options
            in them are for walks and ensembles.
        tolerances: Of the work–precision diagrams.
        links: Numbers of links in the diagrams, the walks and the ensembles.
        problems: Some of `PROBLEMS`.
        presets: Of the ensembles.
        start: Of the ensembles.
        samples: Walks of each ensemble; None: 200, and 60 from 100 links on.
        device: Where the ensembles run; the other parts are measured on one CPU core.
        tight: Make the ensembles of `TIGHT` as well.
        cases: Names of hard cases.
        rounds: Measurements of each run in the diagrams, and walks of each method that are timed.
        scipy: Run SciPy's solvers as well, if SciPy is installed.

    Raises:
        InputError: Something is unknown or impossible.
    """

    parts: Sequence[str] = PARTS
    methods: Sequence[str] | None = None
    tolerances: Sequence[float] = TOLERANCES
    links: Sequence[int] = (60, 150)
    problems: Sequence[str] = PROBLEMS
    presets: Sequence[str] = ("soft", "paper")
    start: str = "spinning"
    samples: int | None = None
    device: str = "cpu"
    tight: bool = False
    cases: Sequence[str] = CASES
    rounds: int = 5
    scipy: bool = True

    def __post_init__(self) -> None:
        """Refuse what cannot be run."""
        for option, given, known in (
            ("--parts", self.parts, PARTS),
            ("--problems", self.problems, PROBLEMS),
            ("--cases", self.cases, CASES),
        ):
            for name in given:
                if name not in known:
                    raise InputError(f"{option}: {shown(name)} is unknown; {suggestion(name, known)}")
        for tolerance in self.tolerances:
            validated(Options, {"tolerance": tolerance}, "--tolerances")
        for name in self.presets:
            preset(name)
        device = validated(Options, {"device": self.device}, "options").device
        for count in self.links:
            scene = validated(Scene, {"links": count}, "--links")
            if "work-precision" in self.parts and "sprocket" in self.problems:
                check_scene(scene, preset("paper"))
        method_settings = self.method_settings
        if "ensembles" in self.parts:
            start_device(device)
            for ensemble in self.ensembles:
                for one in method_settings:
                    load_sweep(ensemble.content(one))

    @cached_property
    def method_settings(self) -> tuple[MethodSetting, ...]:
        """How walks are computed."""
        if self.methods is None:
            return default_method_settings(self.device)
        return tuple(MethodSetting.parse(text, self.device) for text in self.methods)

    @property
    def method_names(self) -> tuple[str, ...]:
        """Of the method settings, each once."""
        chosen = {one.method for one in self.method_settings}
        return tuple(name for name in method_names() if name in chosen)

    @property
    def ensembles(self) -> tuple[Ensemble, ...]:
        """Of every number of links with every preset."""
        return tuple(
            Ensemble(count, name, self.start, self.samples or default_samples(count), self.device)
            for count in self.links
            for name in self.presets
        )


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
    make_folder(folder)
    checked_output(folder / FILE)  # reading a pipe would wait for ever
    here = machine()
    if find_spec("scipy") is not None:
        here["scipy"] = version("scipy")
    _record(folder, here, {})
    for links in plan.links if "work-precision" in plan.parts else ():
        for name in plan.problems:
            _record(folder, here, _problem_rows(plan, name, links, report))
    if "reversals" in plan.parts:
        for found in reversals(plan.method_names, plan.scipy and find_spec("scipy") is not None, report):
            _record(folder, here, {"reversals": [asdict(row) for row in found]})
    for links in plan.links if "walks" in plan.parts else ():
        _record(folder, here, {"walks": walk_costs(links, plan.method_settings, plan.rounds, report)})
    for case in HARD_CASES if "hard-cases" in plan.parts else ():
        for method in plan.method_names if case.name in plan.cases else ():
            report(f"{case.what}, {method}")
            about = {"group": case.group, "case": case.name, "what": case.what, "method": method}
            _record(folder, here, {"hard_cases": [about | asdict(case.outcome(method))]})
    for ensemble in plan.ensembles if "ensembles" in plan.parts else ():
        on = here if ensemble.device == "cpu" else here | {"device": start_device(ensemble.device).warp.name}
        references = (LOOSE, TIGHT) if plan.tight else (LOOSE,)
        for one in dict.fromkeys((*references, *plan.method_settings)):
            run_ensemble(folder / "ensembles", ensemble, one, report)
            row = ensemble.columns | {"methods": summary(folder / "ensembles", ensemble)}
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
    """A document without rows."""
    columns = {part: {name: column._asdict() for name, column in table.items()} for part, table in COLUMNS.items()}
    tables: Document = {table: [] for table in KEYS}
    return {"format": FORMAT, "version": VERSION, "machines": [], "notes": {}, "columns": columns, **tables}


def _record(folder: Path, on: dict[str, str], tables: Mapping[str, Sequence[Row]]) -> None:
    """Put rows, measured on a machine, into the document of a folder; those with the same keys are replaced.

    The file is read again each time, so that another process that measures another part loses nothing.
    """
    document = load_document(folder) if (folder / FILE).exists() else _empty()
    if on not in document["machines"]:
        document["machines"].append(on)
    for table, rows in tables.items():
        known = {tuple(row[key] for key in KEYS[table]): row for row in document[table]}
        for row in rows:
            known[tuple(row[key] for key in KEYS[table])] = row | {"machine": document["machines"].index(on)}
        document[table] = list(known.values())
    has_scipy = any("SciPy" in row["method"] for row in document["points"])
    document["notes"]["scipy"] = WITH_SCIPY if has_scipy else WITHOUT_SCIPY
    write_whole(folder / FILE, json.dumps(plain(document), indent=1, allow_nan=False, ensure_ascii=False))


def _problem_rows(plan: Plan, name: str, links: int, report: Report) -> dict[str, list[Row]]:
    """Run a problem with all methods: the row of its reference and those of its points."""
    report(f"{name}, {links} links: reference")
    problem = make_problem(name, links)
    true = make_reference(problem)
    found = points(problem, true, plan.method_names, plan.tolerances, plan.rounds, report)
    if plan.scipy and find_spec("scipy") is not None:
        found += scipy_points(problem, true, [x for x in plan.tolerances if x in SCIPY_TOLERANCES], report)
    row = {"problem": name, "links": links, "duration": problem.duration, "starts": len(problem.starts)}
    return {"references": [row | asdict(true.trust)], "points": [asdict(point) for point in found]}
