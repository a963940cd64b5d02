"""The command line through its real entry points: `main` in this process, and `python -m warpchain`."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.command_line import Answer, Command, process
from tests.support.made_walks import make_walk
from warpchain import load_walk
from warpchain.cli.main import main
from warpchain.inputs.parameters import preset

QUICK = "--links 32 --preset soft --method dp5 --start ellipse --frequency 5".split()
"""A walk of half a simulated second."""


@pytest.fixture(scope="module")
def quick_walk(tmp_path_factory: pytest.TempPathFactory) -> tuple[Answer, Path]:
    """The answer to a quick walk with --json and -o, and the folder it wrote."""
    folder = tmp_path_factory.mktemp("walk")
    return process("walk", *QUICK, "--json", "-o", "new/deep", folder=folder), folder


def test_help_names_every_option(tmp_path: Path) -> None:
    """Help comes from the real entry point."""
    answer = process("walk", "--help", folder=tmp_path)
    assert answer.status == 0 and answer.err == ""
    options = "links frequency preset method tol device start set seed json output config frame-interval"
    assert [option for option in options.split() if f"--{option} " not in answer.out] == []


@pytest.mark.parametrize("words", [["walk", "--help"], ["walk", *QUICK, "--set", "walk_limit=0.01"]])
def test_a_walk_loads_only_what_it_needs(words: list[str]) -> None:
    """Help waits for no numerics; a walk without a file for no grammar of sweeps, no files and no figures."""
    program = (
        "import sys\n"
        "from warpchain.cli.main import main\n"
        "try:\n"
        f"    main({words})\n"
        "except SystemExit:\n"
        "    unneeded = {'warpchain.sweeps.sweep_file', 'h5py', 'matplotlib', 'rich.table', 'scipy', 'xarray'}\n"
        f"    unneeded |= {{'warp', 'numpy'}} if '--help' in {words} else set()\n"
        "    print('loaded', sorted(unneeded & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert done.stdout.splitlines()[-1] == "loaded []", done.stderr


def test_mp4_without_its_extra_is_refused(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without imageio-ffmpeg an MP4 is refused with the command that installs it, and nothing is written."""
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    make_walk().save("walk.h5")
    answer = command("animate", "walk.h5", "-o", "walk.mp4")
    assert answer.status == 2 and "pip install 'warpchain[video]'" in answer.err
    assert [path.name for path in Path().iterdir()] == ["walk.h5"]


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
    """The folder holds exactly the record and the film strip, and the record is that walk."""
    answer, folder = quick_walk
    assert [path.name for path in folder.iterdir()] == ["new"]
    files = {path.name: path.read_bytes() for path in (folder / "new/deep").iterdir()}
    assert set(files) == {"walk.h5", "film_strip.png"}
    assert files["film_strip.png"].startswith(b"\x89PNG")
    walk = load_walk(folder / "new/deep/walk.h5")
    assert walk.to_dict() == json.loads(answer.out)
    np.testing.assert_allclose(np.diff(walk.frame_time[:-1]), 2e-3, atol=5e-5)


def test_table_and_paths(command: Command) -> None:
    """Without --json a short table says what happened, and the paths of the files follow."""
    answer = command("walk", *QUICK, "-o", "new", "--frame-interval", "0.01")
    assert answer.status == 0 and answer.err == ""
    assert re.search(
        r"Δx 0\.\d{2,3} m, one of many: .* status at_rest walk time 0\.\d{3} s", " ".join(answer.out.split())
    )
    assert answer.out.splitlines()[-2:] == ["new/walk.h5", "new/film_strip.png"]
    np.testing.assert_allclose(np.diff(load_walk("new/walk.h5").frame_time[:-1]), 1e-2, atol=5e-5)


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
    of_the_run = {"wall_time", "provenance"}
    assert drawn.keys() == again.keys() and {name for name in drawn if drawn[name] != again[name]} <= of_the_run


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
    assert (table.out + table.err).count(summary["status_sentence"]) == 1


def test_a_chain_that_was_never_released_leaves_no_pictures(command: Command) -> None:
    """A walk without time series leaves its record, and takes an earlier walk's pictures out of the folder."""
    Path("new").mkdir()
    for name in ("energy.png", "walk.gif"):
        Path("new", name).write_bytes(b"of an earlier walk")
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

    monkeypatch.setattr("warpchain.results.one_walk.run_walk", broken)
    with pytest.raises(ValueError, match="broadcast"):
        main(["walk"])
