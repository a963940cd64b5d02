"""Hostile files and words on the command line end in one short printable line and exit status 2."""

import contextlib
import io
from pathlib import Path

import pytest

from tests.support import command_line
from tests.support.command_line import Command
from tests.support.made_sweeps import make_sweep
from tests.support.sweep_content import content
from warpchain.cli.terminal import print_sweep

command = command_line.command

ESCAPE = "\x1b]0;owned\x07\x1b[2J"


@pytest.mark.parametrize(
    "arguments",
    [
        ["walk", "--set", f"links={ESCAPE}"],
        ["walk", "--set", f"{ESCAPE}=1"],
        ["walk", "--set", "links=" + "[" * 10_000],
        ["walk", "--set", "links=" + "[" + "a," * 50_000 + "]"],
        ["walk", "--set", "links=" + "9" * 5000],
        ["walk", "--set", "x" * 100_000 + "=1"],
        ["walk", "--preset", "x" * 100_000],
        ["walk", "--seed", "1e300"],
        ["walk", "--like", "x" * 5000],
        ["walk", f"--{ESCAPE}"],
        [ESCAPE],
        ["x" * 100_000],
        ["sweep", ESCAPE, "-o", "out"],
        ["sweep", "a\0b", "-o", "out"],
        ["sweep", "\udcff", "-o", "out"],
        ["sweep", "/dev/zero", "-o", "out"],
        ["sweep", "quickstart", "-o", "out", "--device", ESCAPE],
        ["parameters", ESCAPE],
        ["info", ESCAPE],
        ["schema", "-o", f"none/{ESCAPE}"],
    ],
)
def test_words_are_refused_in_one_short_printable_line(command: Command, arguments: list[str]) -> None:
    """Names, values and paths with control characters, of any length."""
    answer = command(*arguments)
    (line,) = answer.err.splitlines()
    assert answer.status == 2 and answer.out == ""
    assert line.startswith("error: ") and line.isprintable() and len(line) <= 200


def test_names_of_files_are_printed_without_control_characters(command: Command, tmp_path: Path) -> None:
    """A path that is written is named by escapes, on standard output and in errors alike."""
    answer = command("schema", "-o", "a\x1b[31mb.json")
    assert (answer.status, answer.out, answer.err) == (0, "a\\x1b[31mb.json\n", "")
    assert (tmp_path / "a\x1b[31mb.json").exists()
    answer = command("sweep", "--new", "a\x1b[31mb.json")
    assert (answer.status, answer.out) == (2, "") and "a\\x1b[31mb.json exists" in answer.err


def test_a_folder_cannot_hide_its_name(command: Command, tmp_path: Path) -> None:
    """The name in a folder's sweep.json may have been changed; the table of the sweep writes escapes."""
    result = make_sweep(tmp_path / "s", content())
    result.sweep["name"] = ESCAPE
    with contextlib.redirect_stdout(io.StringIO()) as out:
        print_sweep(result, as_json=False)
    assert "\x1b" not in out.getvalue() and "\x07" not in out.getvalue() and "\\x1b]0;owned" in out.getvalue()
