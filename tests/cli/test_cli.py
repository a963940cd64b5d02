"""The command line through its real entry points: `main` in this process, and `python -m warpchain`."""

import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from tests.support import command_line
from tests.support.command_line import Answer, Command, process
from warpchain import load_walk
from warpchain.cli.main import main
from warpchain.inputs.parameters import preset

command = command_line.command

QUICK = "--links 32 --preset soft --method dp5 --start ellipse --frequency 5".split()
"""A walk of half a simulated second."""

WALK_MODULE = import_module("warpchain.walks.one_walk")


@pytest.fixture(scope="module")
def quick_walk(tmp_path_factory: pytest.TempPathFactory) -> tuple[Answer, Path]:
    """The answer to a quick walk with --json, -o and --animate, and the folder it wrote."""
    folder = tmp_path_factory.mktemp("walk")
    return process("walk", *QUICK, "--json", "-o", "new/deep", "--animate", "gif", folder=folder), folder


def test_help_names_every_option(tmp_path: Path) -> None:
    """Help comes from the real entry point."""
    answer = process("walk", "--help", folder=tmp_path)
    assert answer.status == 0 and answer.err == ""
    options = "links frequency preset method tol device start set seed json output animate config frame-interval"
    assert [option for option in options.split() if f"--{option} " not in answer.out] == []


def test_help_waits_for_no_numerics() -> None:
    """Help loads no library of numbers, files or figures: that is what makes it quick."""
    program = (
        "import sys\n"
        "from warpchain.cli.main import main\n"
        "try:\n"
        "    main(['walk', '--help'])\n"
        "except SystemExit:\n"
        "    print('loaded', sorted({'h5py', 'matplotlib', 'numpy', 'scipy', 'warp', 'xarray'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert done.stdout.splitlines()[-1] == "loaded []", done.stderr


def test_mp4_without_its_extra_is_found_before_the_walk(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without imageio-ffmpeg an MP4 is refused at once, with the command that installs it."""
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    monkeypatch.setattr(WALK_MODULE, "run_walk", None)
    answer = command("walk", "-o", "new", "--animate", "mp4")
    assert answer.status == 2 and "pip install 'warpchain[video]'" in answer.err
    assert not Path("new").exists()


def test_json_is_one_object_with_everything(quick_walk: tuple[Answer, Path]) -> None:
    """Standard output is one JSON object that holds results, ledger and all parameters; stderr is silent."""
    answer, _ = quick_walk
    assert answer.status == 0 and answer.err == ""
    summary = json.loads(answer.out)
    assert summary["status"] == "at_rest"
    assert 0.0 < summary["dx"] < 0.2
    assert 0.1 < summary["walk_time"] <= summary["simulated_time"] < 2.0
    assert summary["bounces"] >= 1 and summary["wall_time"] > 0
    assert summary["steps_accepted"] > summary["steps_rejected"] > 0
    assert summary["parameters"] == preset("soft").model_dump()
    assert summary["scene"]["links"] == 32 and summary["options"]["method"] == "dp5"
    assert summary["seed"] is None and summary["versions"]["warp-lang"]
    energy = summary["energy"]
    released = energy["kinetic_at_release"] + energy["potential_at_release"]
    assert abs(energy["residual"]) < 1e-4 * released


def test_output_holds_record_and_pictures(quick_walk: tuple[Answer, Path]) -> None:
    """The folder holds exactly the record, the film strip and the film, and the record is that walk."""
    answer, folder = quick_walk
    assert [path.name for path in folder.iterdir()] == ["new"]
    files = {path.name: path.read_bytes() for path in (folder / "new/deep").iterdir()}
    assert set(files) == {"walk.h5", "film_strip.png", "walk.gif"}
    assert files["film_strip.png"].startswith(b"\x89PNG")
    assert files["walk.gif"].startswith(b"GIF89a")
    walk = load_walk(folder / "new/deep/walk.h5")
    assert walk.to_dict() == json.loads(answer.out)
    np.testing.assert_allclose(np.diff(walk.frame_time[:-1]), 2e-3, atol=5e-5)


def test_table_and_paths(command: Command) -> None:
    """Without --json a short table says what happened, and the paths of the files follow."""
    answer = command("walk", *QUICK, "-o", "new", "--frame-interval", "0.01")
    assert answer.status == 0 and answer.err == ""
    words = " ".join(answer.out.split())
    for part in (
        r"Δx 0\.\d{4} m status at_rest walk time 0\.\d{3} s bounces \d",
        r"steps [\d,]+ accepted, [\d,]+ rejected",
        r"greatest penetration floor [\d.e-]+ mm, sprocket 0 mm, self [\d.e-]+ mm",
        r"energy at release 0\.\d{5} J.*lost to floor 0\.\d{5} J.*unaccounted for -?[\d.]+e-\d+ J",
    ):
        assert re.search(part, words), part
    assert answer.out.splitlines()[-2:] == ["new/walk.h5", "new/film_strip.png"]
    frame_time = load_walk("new/walk.h5").frame_time
    np.testing.assert_allclose(np.diff(frame_time[:-1]), 1e-2, atol=5e-5)


def test_values_from_file_line_and_seed(command: Command) -> None:
    """The file is the base, the line overrides it, and what neither gives is drawn from the seed."""
    Path("walk.yaml").write_text(
        "preset: soft\n"
        "scene: {links: 40, start: ellipse, frequency: 5.0, clearance: 0.004}\n"
        "options: {method: dp5, self_contact: true}\n"
        "parameters: {g: 9.7, chain_friction: 0.5, mu_fc: 0.3}\n",
        encoding="utf-8",
    )
    line = "--config walk.yaml --links 32 --set chain_friction=0.4 --set ℓ=0.013 --seed 7 --set walk_limit=0.02"
    drawn = json.loads(command("walk", *line.split(), "--json").out)
    assert drawn["preset"] == "soft" and drawn["seed"] == 7
    scene, parameters = drawn["scene"], drawn["parameters"]
    assert (scene["links"], scene["clearance"], scene["walk_limit"]) == (32, 0.004, 0.02)
    assert (parameters["gravity"], parameters["chain_friction"]) == (9.7, 0.4)
    assert (parameters["floor_friction"], parameters["link_length"]) == (0.3, 0.013)
    assert scene["phase"] > 0 and parameters["inner_mass"] != preset("soft").inner_mass
    again = json.loads(command("walk", *line.split(), "--json").out)
    del drawn["wall_time"], again["wall_time"]
    assert drawn == again


def test_a_failed_walk_is_reported_and_kept(command: Command) -> None:
    """A walk that ends early: status 1, its sentence on stderr, its results printed and written all the same."""
    answer = command("walk", *QUICK, "--set", "walk_limit=0.06", "--json", "-o", "new")
    assert answer.status == 1
    summary = json.loads(answer.out)
    assert summary["status"] == "time_limit" and summary["dx"] is None
    assert answer.err == f"time_limit: {summary['status_sentence']}\n"
    assert load_walk("new/walk.h5").walk_time == pytest.approx(0.06)
    table = command("walk", *QUICK, "--set", "walk_limit=0.06")
    assert table.status == 1 and "Δx unknown" in " ".join(table.out.split())


def test_a_chain_that_was_never_released_leaves_no_pictures(command: Command) -> None:
    """A walk without time series leaves its record, and takes an earlier walk's pictures out of the folder."""
    Path("new").mkdir()
    Path("new/energy.png").write_bytes(b"of an earlier walk")
    options = "--links 32 --preset soft --method dp5 --start spinning --set hold_limit=0.001 -o new"
    answer = command("walk", *options.split())
    assert answer.status == 1 and "not_steady" in answer.out
    assert [path.name for path in Path("new").iterdir()] == ["walk.h5"]
    lines = answer.err.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["new/film_strip.png", "not_steady"]


def test_a_defect_is_not_disguised_as_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ValueError that is no InputError is a defect of the program and keeps its traceback."""

    def broken(*_: object, **__: object) -> None:
        raise ValueError("operands could not be broadcast together")

    monkeypatch.setattr(WALK_MODULE, "run_walk", broken)
    with pytest.raises(ValueError, match="broadcast"):
        main(["walk"])


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudoterminals")
def test_terminal_shows_progress_and_ctrl_c_ends_it(tmp_path: Path) -> None:
    """On a terminal progress is shown; Ctrl-C ends the walk with status 130 and one line, nothing written."""
    terminal, theirs = os.openpty()
    walk = subprocess.Popen(
        [sys.executable, "-m", "warpchain", "walk", *QUICK, "--set", "rest_time=100", "-o", "new"],
        cwd=tmp_path,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
        stdout=subprocess.PIPE,
        stderr=theirs,
        # A shell may have set it to be ignored in its background jobs, which children inherit.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    os.close(theirs)
    try:
        seen = _read_until(terminal, rb"walk +0\.[1-9].* m/s.* steps", seconds=120)
        walk.send_signal(signal.SIGINT)
        out, _ = walk.communicate(timeout=30)
        seen += _read_until(terminal, b"interrupted\r\n", seconds=10)
    finally:
        walk.kill()
        walk.wait()
        os.close(terminal)
    assert walk.returncode == 130 and out == b""
    assert b"Traceback" not in seen
    assert list(tmp_path.iterdir()) == []


def _read_until(terminal: int, pattern: bytes, *, seconds: float) -> bytes:
    """What a terminal shows, up to the first chunk that completes the pattern."""
    seen, deadline = b"", time.monotonic() + seconds
    while re.search(pattern, seen) is None:
        ready, _, _ = select.select([terminal], [], [], max(0.0, deadline - time.monotonic()))
        assert ready, f"{pattern!r} not in {seen!r}"
        seen += os.read(terminal, 65536)
    return seen
