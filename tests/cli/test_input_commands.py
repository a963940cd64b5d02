"""What the command line says of a user's values: names, symbols, warnings, tables, schema, completion."""

import json
from pathlib import Path
from typing import NoReturn

import pytest

import warpchain
from tests.support.command_line import Command
from warpchain.inputs.fields import SECTION_OF
from warpchain.store.folder import SweepFolder
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.sweeps.sweep_file import sweep_schema

ROOT = Path(__file__).parents[2]


def test_parameters_as_a_table(command: Command) -> None:
    """A row for every field with symbol, value, unit, bounds and meaning; names, symbols and sections choose."""
    lines = command("parameters").out.splitlines()
    rows = {line.split()[0]: " ".join(line.split()) for line in lines if line and not line.startswith(" ")}
    assert rows.keys() == {"name", *SECTION_OF}
    assert rows["floor_friction"] == "floor_friction mu_fc 0.27 [0, 10] friction coefficient, floor and chain"
    assert rows["load_factor"].startswith("load_factor null [1, 10000] factor by which gravity")
    some = command("parameters", "k", "scene.nu", "--preset", "soft").out.splitlines()
    assert [line.split()[:3] for line in some[1:]] == [["joint_stiffness", "k", "1e7"], ["frequency", "nu", "15"]]


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
    assert (again.status, again.err) == (2, "error: --new: new.yaml already exists; use another name\n")
    assert Path("new.yaml").read_text(encoding="utf-8") == text
    run = command("sweep", "new.yaml", "-o", "results", "--json")
    assert run.status == 0 and json.loads(run.out)["statuses"] == {"at_rest": 8, "missing": 0}


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
