"""What the command line says of a user's values: names, symbols, warnings, tables, schema, completion."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import pytest

import warpchain
from tests.support import command_line
from tests.support.command_line import Command, process
from warpchain.inputs.methods import METHODS, METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import Scene
from warpchain.inputs.sections import NAME_OF_SYMBOL, SECTION_OF, SECTIONS
from warpchain.store.folder import SweepFolder
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.sweeps.shipped import shipped_sweeps
from warpchain.sweeps.sweep_file import sweep_schema

command = command_line.command

QUICK = "--links 32 --preset soft --method dp5 --start ellipse --set walk_limit=1e-6 --json".split()
ROOT = Path(__file__).parents[2]


def test_parameters_lists_everything(command: Command) -> None:
    """One JSON object has every field of every section with its value, unit, bounds and source."""
    listed = json.loads(command("parameters", "--json").out)
    assert listed.pop("preset") == "paper"
    assert {section: list(entries) for section, entries in listed.items()} == {
        section: list(model.model_fields) for section, model in SECTIONS.items()
    }
    for name, quantity in Parameters.quantities().items():
        entry, bounds = listed["parameters"][name], quantity.bounds
        assert (entry["unit"], entry["value"], entry["meaning"]) == (quantity.unit, quantity.value, quantity.meaning)
        assert NAME_OF_SYMBOL[entry["symbol"]] == name and entry["sigma"] == (quantity.sigma or None)
        ends = {"lower": bounds.lower, "lower_included": bounds.lower_included}
        assert entry["bounds"] == ends | {"upper": bounds.upper, "upper_included": True}
    assert listed["parameters"]["gravity"]["source"].startswith("Table 1, ")
    assert {name: entry["value"] for name, entry in listed["scene"].items()} == dict(Scene())
    options = {name: entry["value"] for name, entry in listed["options"].items()}
    assert options == Options().model_dump() | {"method": "standard"}
    assert listed["options"]["method"]["choices"] == [*METHODS_BY_NEED, *METHODS]
    assert listed["scene"]["phase"]["bounds"]["upper_included"] is False
    assert listed["options"]["skin"]["bounds"]["upper"] is None


def test_parameters_of_a_preset_and_by_name(command: Command) -> None:
    """Names, symbols, dotted names and sections choose entries; a value that only the preset has says so."""
    answer = command("parameters", "k", "floor_friction", "scene.nu", "--preset", "soft", "--json")
    listed = json.loads(answer.out)
    assert listed["parameters"].keys() == {"joint_stiffness", "floor_friction"}
    assert listed["scene"].keys() == {"frequency"} and listed["options"] == {}
    stiffness = listed["parameters"]["joint_stiffness"]
    assert (stiffness["value"], stiffness["source"]) == (preset("soft").joint_stiffness, "preset soft")
    assert json.loads(command("parameters", "scene", "--json").out)["scene"].keys() == Scene.model_fields.keys()


def test_parameters_as_tables(command: Command) -> None:
    """Tables by section have a row for every field with symbol, value, unit, bounds and source, and what it means."""
    lines = command("parameters").out.splitlines()
    rows = {line.split()[0]: " ".join(line.split()) for line in lines if line and not line.startswith(" ")}
    assert rows.keys() >= SECTION_OF.keys()
    assert (
        rows["floor_friction"] == "floor_friction mu_fc 0.27 0.02 [0, 1] measured friction coefficient, floor and chain"
    )
    assert rows["joint_stiffness"].startswith("joint_stiffness k 1e9 N/m (0, 1e12] adjusted")
    assert rows["phase"].startswith("phase 0 [0, 1) chosen here")
    assert rows["load_factor"].startswith("load_factor null [1, 10000] chosen here")
    assert rows["start"].startswith("start rest rest, spinning, ellipse chosen here")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ("parameters floor_frictoin", "'floor_frictoin': unknown name; did you mean parameters.floor_friction?"),
        ("parameters --preset hard", "preset: 'hard' is unknown; presets are paper, soft"),
        (
            "walk --set mu_fc=0.3 --set floor_friction=0.3",
            "parameters.floor_friction: given twice on the command line;",
        ),
        ("schema -o no/schema.json", "no/schema.json: cannot be written"),
        ("sweep", "FILE.yaml: missing; give a sweep file, or --new FILE.yaml"),
        ("sweep figure6", "--output: missing; give a folder for the results with -o DIR"),
        ("sweep figur6 -o new", "figur6: neither a file nor a shipped sweep; did you mean figure6?"),
        (
            "sweep x -o new",
            f"x: neither a file nor a shipped sweep; give one of {', '.join(shipped_sweeps())}",
        ),
        ("sweep --new no/new.yaml", "--new: no/new.yaml: cannot be written (No such file or directory); give"),
        ("sweep --new new.yaml -o new", "--new: given together with other arguments; leave them out"),
    ],
)
def test_bad_input_is_refused_in_one_line(command: Command, tmp_path: Path, arguments: str, line: str) -> None:
    """Status 2, one line on stderr, and nothing else anywhere."""
    answer = command(*arguments.split())
    assert (answer.status, answer.out) == (2, "")
    assert answer.err.startswith(f"error: {line}") and answer.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_symbols_on_the_line_and_in_the_file(command: Command) -> None:
    """A symbol sets what its name sets; the line counts more than the file, however each of them spells it."""
    Path("walk.yaml").write_text("preset: soft\nparameters: {mu_fc: 0.5, g: 9.7}\nscene: {nu: 5}", encoding="utf-8")
    line = "--config walk.yaml --set floor_friction=0.3 --set parameters.tau_c=2e-4"
    walk = json.loads(command("walk", *QUICK, *line.split()).out)
    parameters = walk["parameters"]
    assert (parameters["floor_friction"], parameters["gravity"], walk["scene"]["frequency"]) == (0.3, 9.7, 5.0)
    assert parameters["coulomb_friction"] == 2e-4


def test_a_value_in_another_unit_is_one_line_on_stderr(tmp_path: Path) -> None:
    """The process warns once, walks all the same, and prints its results undisturbed."""
    answer = process("walk", *QUICK, "--set", "ell=12.68", "--seed", "1", folder=tmp_path)
    warning, failure = answer.err.splitlines()
    assert warning == (
        "warning: parameters.link_length: 12.68 m is 1000 times Table 1's 0.01268 m; did you mean 1.268e-2?"
    )
    assert failure.startswith("time_limit: ")
    assert json.loads(answer.out)["status"] == "time_limit"


def test_schema_is_printed_or_written(command: Command) -> None:
    """The command prints the schema as JSON, or writes it to a file and prints the path."""
    assert json.loads(command("schema").out) == sweep_schema()
    answer = command("schema", "-o", "sweep.schema.json")
    assert (answer.status, answer.out, answer.err) == (0, "sweep.schema.json\n", "")
    assert json.loads(Path("sweep.schema.json").read_text(encoding="utf-8")) == sweep_schema()


def test_a_new_sweep_runs_as_it_is(command: Command) -> None:
    """The file that --new writes is a sweep of eight walks, all of which come to rest; it replaces no file."""
    assert command("sweep", "--new", "new.yaml").out == "new.yaml\n"
    text = Path("new.yaml").read_text(encoding="utf-8")
    assert load_sweep("new.yaml").walk_count == 8
    again = command("sweep", "--new", "new.yaml")
    assert (again.status, again.err) == (2, "error: --new: new.yaml exists; give another name\n")
    assert Path("new.yaml").read_text(encoding="utf-8") == text
    run = command("sweep", "new.yaml", "-o", "results", "--json")
    assert run.status == 0 and json.loads(run.out)["statuses"] == {"at_rest": 8, "missing": 0}


def test_completion_installs_itself(tmp_path: Path) -> None:
    """--install-completion writes what bash needs below the home folder."""
    environment = os.environ | {"HOME": str(tmp_path), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    command = [sys.executable, "-m", "warpchain", "--install-completion", "bash"]
    done = subprocess.run(command, env=environment, capture_output=True, encoding="utf-8")
    assert (done.returncode, done.stderr) == (0, "")
    scripts = [path.read_text(encoding="utf-8") for path in tmp_path.rglob("*.sh")]
    assert len(scripts) == 1 and "complete -o default -F _warpchain_completion warpchain" in scripts[0]


def test_a_shipped_sweep_runs_by_its_name(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """From any folder `warpchain.sweep` and the command find a shipped sweep; a folder of its name is no file."""
    loaded: list[Sweep] = []

    def note(out: Path, planned: Sweep, **_: object) -> NoReturn:
        loaded.append(planned)
        raise KeyboardInterrupt

    monkeypatch.setattr(SweepFolder, "open", note)
    Path("figure6").mkdir()
    assert command("sweep", "figure6", "-o", "results").status == 130
    with pytest.raises(KeyboardInterrupt):
        warpchain.sweep("figure6", "results")
    expected = load_sweep(ROOT / "sweeps/figure6.yaml").digest()
    assert [planned.digest() for planned in loaded] == [expected, expected]
    Path("tilt").write_text((ROOT / "sweeps/quickstart.yaml").read_text(encoding="utf-8"), encoding="utf-8")
    assert load_sweep("tilt").name == "quickstart"
