"""The commands that read the file of a saved walk, through `main`: plot, animate, walk --like."""

from collections.abc import Sequence
from pathlib import Path

import pytest

import warpchain
from tests.support.command_line import Command
from tests.support.made_walks import assert_same
from warpchain.inputs.options import Options
from warpchain.inputs.validation import InputError
from warpchain.results.walk_result import WalkResult

TINY = {
    "links": 20,
    "frequency": 5.0,
    "preset": "soft",
    "method": "dp5",
    "start": "ellipse",
    "walk_limit": 0.02,
    "clearance": 0.004,
    "gravity": 9.7,
}


@pytest.fixture(scope="module")
def tiny_walk() -> WalkResult:
    """A walk of 20 ms with drawn parameters and frames."""
    return warpchain.walk(**TINY, seed=7)


@pytest.fixture
def saved(tiny_walk: WalkResult, tmp_path: Path) -> Path:
    """Its file, in a folder of its own."""
    (tmp_path / "saved").mkdir()
    tiny_walk.save(tmp_path / "saved/walk.h5")
    return tmp_path / "saved/walk.h5"


def test_a_folder_is_of_a_walk_or_of_a_sweep(command: Command, saved: Path) -> None:
    """Else commands that take a folder would have to guess which is meant."""
    answer = command("sweep", "quickstart", "-o", str(saved.parent))
    assert answer.status == 2 and "walk.h5: in the way of a sweep; move it away, or use another folder" in answer.err
    Path("swept").mkdir()
    Path("swept/sweep.h5").touch()
    answer = command("walk", "-o", "swept")
    assert (answer.status, answer.err) == (2, "error: swept: already holds a sweep; use another folder\n")


@pytest.mark.parametrize("options", [(), ("-o", "new/deep")])
def test_plot_draws_a_saved_walk_and_tells_what_it_leaves_out(
    command: Command, saved: Path, options: Sequence[str]
) -> None:
    """The figures stand beside the file or in the folder; this chain never was on a sprocket."""
    answer = command("plot", str(saved.parent), *options)
    folder = Path(options[-1]) if options else saved.parent
    drawn = [folder / f"{kind}.png" for kind in ("height_and_speed", "film_strip", "energy")]
    assert answer.status == 0
    assert sorted(answer.out.splitlines()) == sorted(map(str, drawn))
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in drawn)
    assert answer.err.startswith(f"{folder / 'loop.png'}: not drawn; ") and answer.err.count("\n") == 1
    assert {path.name for path in folder.iterdir()} - {"walk.h5"} == {path.name for path in drawn}


def test_plot_of_a_walk_that_never_was_released_fails(command: Command) -> None:
    """Status 1 and a line for each figure, since there is nothing to draw; nothing is written."""
    never = {**TINY, "links": 32, "start": "spinning", "hold_limit": 0.001}
    warpchain.walk(**never, frame_interval=None).save("walk.h5")
    answer = command("plot", "walk.h5")
    assert (answer.status, answer.out) == (1, "")
    names = ["energy.png", "film_strip.png", "height_and_speed.png", "loop.png"]
    assert sorted(line.partition(": not drawn; ")[0] for line in answer.err.splitlines()) == names
    assert [path.name for path in Path().iterdir()] == ["walk.h5"]


@pytest.mark.parametrize(("suffix", "beginning"), [("gif", b"GIF89a"), ("html", b"<!DOCTYPE html>")])
def test_animate_writes_a_moving_picture(command: Command, saved: Path, suffix: str, beginning: bytes) -> None:
    """The file is of the kind that its suffix says."""
    answer = command("animate", str(saved.parent), "-o", f"walk.{suffix}", "--slow", "8")
    assert (answer.status, answer.out, answer.err) == (0, f"walk.{suffix}\n", "")
    assert Path(f"walk.{suffix}").read_bytes()[: len(beginning)].upper() == beginning.upper()


def test_like_repeats_a_walk_to_the_bit(command: Command, tiny_walk: WalkResult, saved: Path) -> None:
    """Setup, seed, and every number but the time it took are those of the saved walk."""
    answer = command("walk", "--like", str(saved.parent), "-o", "again")
    assert answer.status == 1  # of the time limit, as the saved walk
    again = warpchain.load_walk("again/walk.h5")
    assert_same(again, tiny_walk, "wall_time", "provenance")


def test_like_changes_single_values(command: Command, tiny_walk: WalkResult, saved: Path) -> None:
    """What the line gives counts, and all else is the saved walk's, drawn values among it."""
    command("walk", "--like", str(saved), *"--frequency 6 --set walk_limit=0.01 --set g=9.8 -o other".split())
    other, setup = warpchain.load_walk("other/walk.h5"), tiny_walk.setup
    assert other.setup.scene == setup.scene.model_copy(update={"frequency": 6.0, "walk_limit": 0.01})
    assert other.setup.parameters == setup.parameters.model_copy(update={"gravity": 9.8})
    assert (other.setup.options, other.setup.preset, other.seed) == (setup.options, "soft", 7)
    assert other.walk_time == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("--method bs32", {"method": "bs32"}),
        ("--method reference", {"method": "reference"}),
        ("--method standard --tol 1e-4", {"method": "standard", "tolerance": 1e-4}),
        ("--tol 1e-4", {"method": "dp5", "tolerance": 1e-4}),
        ("--method standard --record-joint-forces -o new", {"method": "explicit"}),
    ],
)
def test_a_method_beside_like_brings_its_settings(
    command: Command, saved: Path, monkeypatch: pytest.MonkeyPatch, line: str, expected: dict[str, object]
) -> None:
    """A method means the same as in a new walk."""
    seen = []

    def run_walk(setup: object, **_: object) -> None:
        seen.append(setup)
        raise InputError("enough")

    monkeypatch.setattr("warpchain.results.one_walk.run_walk", run_walk)
    assert command("walk", "--like", str(saved), *line.split()).err == "error: enough\n"
    assert seen[0].options == Options.model_validate(expected)
