"""What commands refuse: one short printable line that names what is wrong, exit status 2, and nothing written."""

import contextlib
import io
from pathlib import Path

import pytest

from tests.run.test_sweep_run import TINY
from tests.support.command_line import Command
from tests.support.made_sweeps import make_sweep
from tests.support.made_walks import make_walk
from tests.support.sweep_content import content
from warpchain.cli.output import print_sweep
from warpchain.inputs.yaml_files import parse_yaml
from warpchain.sweeps.sweep_file import shipped_sweeps

ESCAPE = "\x1b]0;owned\x07\x1b[2J"

REFUSED = {
    "walk -o new --links 61": "scene.links: expected an even number, got 61",
    "walk --set clearance": "--set: expected NAME=VALUE, got 'clearance'",
    "walk --set scene.gravity=1": "--set 'scene.gravity': unknown name; move it to parameters",
    "walk --set mu_fc=0.3 --set floor_friction=0.3": "parameters.floor_friction: given twice on the command line;",
    "walk -o new --device cuda:98": "options.device: cuda:98 is not available on this machine",
    "walk --config nowhere.yaml": "nowhere.yaml: No such file",
    "walk --set walk_until=1": "--set 'walk_until': unknown name; use stop_time, its new name",
    "walk --record-loads": "No such option: --record-loads (Possible options: --record-joint-forces)",
    "walk --frobnicate": "No such option: --frobnicate; see warpchain walk --help",
    "walk extra": "Got unexpected extra argument(s) (extra); see warpchain walk --help",
    "walk -o walk.h5": "walk.h5: cannot be written (Not a directory); use a folder that exists",
    f"walk -o {'x' * 300}": "xxx",
    "walk --like walk.h5 --seed 3": "--seed: not possible with --like",
    "walk --like walk.h5 --index 3": "--index: not possible for walk.h5, a single walk; remove it",
    "plot text.h5": "text.h5: not an HDF5 file",
    "plot walk.h5 --quantity dx": "--quantity: not possible for a saved walk",
    "plot walk.h5 -o text.h5": "text.h5: cannot be written (File exists); use a folder",
    "animate nowhere.h5": "nowhere.h5: cannot be read (No such file or directory)",
    "animate walk.h5 -o nowhere/walk.gif": "nowhere/walk.gif: cannot be written",
    "foo": "No such command 'foo'; see warpchain --help",
    "info": "Missing argument 'DIR...'; see warpchain info --help",
    "parameters floor_frictoin": "'floor_frictoin': unknown name; did you mean parameters.floor_friction?",
    "schema -o no/schema.json": "no/schema.json: cannot be written",
    "sweep": "FILE.yaml: missing; pass a sweep file, or write one with --new FILE.yaml",
    "sweep figure6": "--output: missing; set a folder for the results with -o DIR",
    "sweep x -o new": f"x: neither a file nor a shipped sweep; use one of {', '.join(shipped_sweeps())}",
    "sweep tiny.yaml -o new --device cuda:98": "options.device: cuda:98 is not available on this machine",
    "sweep --new no/new.yaml": "no/new.yaml: cannot be written (No such file or directory); use",
    "sweep --new new.yaml -o new": "--new: not possible with other arguments; remove them",
    "sweep --new new.yaml --seed 0": "--new: not possible with other arguments; remove them",
    "sweep tiny.yaml -o new --gpus 2 --workers 3": "--workers: not possible with --gpus; remove one",
    "sweep tiny.yaml -o new --gpus 2 --device cpu": "--device: cpu is not possible with --gpus; use cuda",
    "bench --links 61": "bench.links: expected an even number, got 61",
    "bench --device cuda:99 --links 2000": "bench.links: expected at most 1024 on a GPU, got 2000; use fewer",
}
"""Arguments → how the line of refusal begins."""
HOSTILE = [
    ["walk", "--set", f"links={ESCAPE}"],
    ["walk", "--set", f"{ESCAPE}=1"],
    ["walk", "--set", "links=" + "[" * 10_000],
    ["walk", "--set", "links=" + "[" + "a," * 50_000 + "]"],
    ["walk", "--set", "links=" + "9" * 5000],
    ["walk", "--preset", "x" * 100_000],
    ["walk", "--like", "x" * 5000],
    ["walk", f"--{ESCAPE}"],
    ["x" * 100_000],
    ["sweep", ESCAPE, "-o", "out"],
    ["sweep", "\udcff", "-o", "out"],
    ["sweep", "/dev/zero", "-o", "out"],
    ["sweep", "quickstart", "-o", "out", "--device", ESCAPE],
    ["parameters", ESCAPE],
    ["info", ESCAPE],
    ["schema", "-o", f"none/{ESCAPE}"],
]
"""Names, values and paths with control characters, of any length."""


@pytest.mark.parametrize("arguments", [*map(str.split, REFUSED), *HOSTILE], ids=lambda words: " ".join(words)[:60])
def test_bad_input_is_refused_in_one_line(command: Command, tmp_path: Path, arguments: list[str]) -> None:
    """On stderr; nothing on stdout, and no folder; no walk is run before."""
    make_walk().save("walk.h5")
    Path("text.h5").write_text("no walk", encoding="utf-8")
    Path("tiny.yaml").write_text(str(TINY), encoding="utf-8")
    assert parse_yaml(str(TINY), "") == TINY
    before = sorted(tmp_path.rglob("*"))
    answer = command(*arguments)
    (line,) = answer.err.splitlines()
    assert (answer.status, answer.out) == (2, "") and line.isprintable() and len(line) <= 200
    assert line.startswith(f"error: {REFUSED.get(' '.join(arguments), '')}")
    assert sorted(tmp_path.rglob("*")) == before


def test_names_of_files_are_printed_without_control_characters(command: Command, tmp_path: Path) -> None:
    """A path that is written is named by escapes, on standard output and in errors alike."""
    answer = command("schema", "-o", "a\x1b[31mb.json")
    assert (answer.status, answer.out, answer.err) == (0, "a\\x1b[31mb.json\n", "")
    assert (tmp_path / "a\x1b[31mb.json").exists()
    answer = command("sweep", "--new", "a\x1b[31mb.json")
    assert (answer.status, answer.out) == (2, "") and "a\\x1b[31mb.json already exists" in answer.err


def test_a_folder_cannot_hide_its_name(command: Command, tmp_path: Path) -> None:
    """The name in a folder may have been changed; the table of the sweep writes escapes."""
    result = make_sweep(tmp_path / "s", content())
    result.sweep["name"] = ESCAPE
    with contextlib.redirect_stdout(io.StringIO()) as out:
        print_sweep(result, None, as_json=False)
    assert "\x1b" not in out.getvalue() and "\x07" not in out.getvalue() and "\\x1b]0;owned" in out.getvalue()
