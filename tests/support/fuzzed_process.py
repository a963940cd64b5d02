"""Takes hostile inputs and says what became of each: the child of `tests.support.watched_process`.

As a script, ``python -m tests.support.fuzzed_process DIR``: reads lines ``[KIND, INPUT]`` in JSON, and answers each by
a line. Inputs go through the command line or the library as a user's do, up to where walks would begin.
"""

import contextlib
import faulthandler
import io
import json
import os
import resource
import shutil
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import warpchain
from tests.support.damages import Steps, damaged
from tests.support.made_sweeps import distance, fill_row
from tests.support.made_walks import make_walk
from tests.support.watched_process import Answer
from warpchain.cli.main import main
from warpchain.files import DISK_FAILURES
from warpchain.inputs.setup import Setup, resolve
from warpchain.inputs.validation import LONGEST_LINE, DamagedFileError, InputError
from warpchain.loop.before_release import BeforeRelease
from warpchain.run import single_walk, sweep_run
from warpchain.store.folder import SweepFolder
from warpchain.store.merged_file import merge
from warpchain.store.shards import write_shard
from warpchain.store.sweep_result import load
from warpchain.sweeps.plan import Sweep, load_sweep
from warpchain.walks.rows import missing_rows
from warpchain.walks.walk_result import MOTION, load_walk

ROOM = 2**31
"""Address space [bytes] beside that of the imported libraries; more is refused by the system."""

MOST_READ = 2**17
"""Walks of the largest sweep that is read: they take a hundred MB, which is no fault of the input."""

Outcome = tuple[str, str | None]
"""What became of an input, and what must not have happened."""


class Planned(BaseException):
    """Walks would begin now."""


# What a user gives


def shown_well(lines: list[str]) -> str | None:
    """Why these lines are no refusal that people can read; None if they are."""
    problems = [line for line in lines if not (line.isprintable() and 0 < len(line) <= LONGEST_LINE)]
    return f"not one short printable line: {problems[0]!r:.500}" if problems or not lines else None


def command(*words: str) -> Outcome:
    """What a command does; `planned` if it comes to the walks."""
    streams = [io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in "oe"]
    status, caught = 0, "read"
    with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
        try:
            main(words)
        except Planned:
            caught = "planned"
        except SystemExit as end:
            status = int(end.code or 0)
        except BaseException:
            return "traceback", traceback.format_exc()
    out, err = (stream.buffer.getvalue().decode() for stream in streams)  # type: ignore[attr-defined]
    lines = [line for line in err.splitlines() if not line.startswith("warning: ")]
    if status == 0:
        return (caught, None) if not lines else ("noisy", err)
    if status not in (1, 2) or out or len(lines) != 1 or not lines[0].startswith("error: "):
        return "unclear", f"status {status}, out {out!r:.500}, err {err!r:.1500}"
    return f"exit {status}", shown_well(err.splitlines())


def called(call: Callable[[], object]) -> Outcome:
    """What a call of the library does."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            call()
    except Planned:
        return "planned", None
    except InputError as error:
        label = "exit 1" if isinstance(error, DamagedFileError) else "exit 2"
        return label, shown_well(list(error.args))
    except OSError as error:
        return "exit 1" if error.errno in DISK_FAILURES else "exit 2", shown_well([str(error)])
    except BaseException:
        return "traceback", traceback.format_exc()
    return "read", None


def give_setup(given: dict[str, Any]) -> Outcome:
    """A setup from a file and options."""
    words = ["walk", *given["words"]]
    if given["yaml"] is not None:
        Path("setup.yaml").write_bytes(given["yaml"].encode("latin-1"))
        words += ["--config", "setup.yaml"]
    SETUPS.clear()
    return planned_setup(command(*words))


def planned_setup(outcome: Outcome) -> Outcome:
    """The same outcome, if what was planned means itself when it is given again."""
    if outcome[0] == "planned":
        (setup,) = SETUPS
        sections = {name: getattr(setup, name).model_dump() for name in ("parameters", "scene", "options")}
        again = resolve(setup.preset, **sections)
        if again != setup:
            return "changed", f"{setup} given again means {again}"
    return outcome


def give_sweep(given: dict[str, Any]) -> Outcome:
    """A sweep from a file."""
    Path("sweep.yaml").write_bytes(given["yaml"].encode("latin-1"))
    return planned_sweep(lambda: command("sweep", "sweep.yaml", "-o", "out", *given["words"]))


def planned_sweep(run: Callable[[], Outcome]) -> Outcome:
    """The outcome, if the folder that it leaves can be read and has the same sweep; none is left by a refusal."""
    shutil.rmtree("out", ignore_errors=True)
    outcome = run()
    if outcome[0] == "planned":
        sweep = load_sweep("out/sweep.yaml")
        if sweep.walk_count > MOST_READ:
            return "planned, large", None
        result, digest = load("out"), sweep.digest()
        if result.provenance["digest"] != digest or result.missing_count != result.walk_count:
            return "changed", f"the folder has {result.provenance}, {digest}, {result!r}"
    elif os.path.lexists("out"):
        return "left over", f"{outcome}: {os.listdir('out')}"
    return outcome


def give_python(given: str) -> Outcome:
    """A call in Python, as text."""
    names = {"np": np, "Path": Path, "walk": warpchain.walk, "sweep": warpchain.sweep, "endless": endless}
    SETUPS.clear()
    if given.startswith("walk"):
        return planned_setup(called(lambda: eval(given, names)))
    return planned_sweep(lambda: called(lambda: eval(given, names)))


def endless() -> list[Any]:
    """A list that contains itself."""
    items: list[Any] = []
    items.append(items)
    return items


SETUPS: list[Setup] = []


def stop_at_walks() -> None:
    """Let walks not begin."""

    def run_setups(setups: list[Setup], **_: object) -> Iterator[Any]:
        SETUPS.extend(setups)
        raise Planned

    def prepare(planned: Sweep) -> None:
        raise Planned

    single_walk.run_setups = run_setups  # type: ignore[assignment]
    sweep_run.prepare = prepare


# Files

SWEEP: dict[str, Any] = {
    "version": 1,
    "name": "kept",
    "seed": 5,
    "preset": "soft",
    "samples": 6,
    "grid": {"links": [30, 32], "frequency": [5.0, 10.0]},
    "record": {"series": {"samples": [0, 3]}, "frames": {"samples": [3], "before": 0.1}},
}
SHARD_SIZE = 12
FOLDER, WALK, MERGED = Path("sweep"), Path("walk.h5"), Path("all.h5")
SHARD, MANIFEST = FOLDER / "shards/0-000000.h5", FOLDER / "sweep.json"


def made_motion(links: int, has_frames: bool) -> dict[str, Any]:
    """The arrays of a walk."""
    sizes, rng = {"t": 4000, "f": 20 if has_frames else 0, "n": links}, np.random.default_rng(links)
    arrays: dict[str, Any] = {
        name: np.empty((0, *stored.sizes(sizes)[1:])) if stored.empty else rng.random(stored.sizes(sizes))
        for name, stored in MOTION.items()
    }
    before = BeforeRelease(
        time=np.linspace(-0.1, -1e-3, 100),
        center=rng.random((100, 2)),
        center_velocity=rng.random((100, 2)),
        frame_time=np.linspace(-0.1, -1e-2, 5),
        frame_joints=rng.random((5, links, 2)),
        frame_forces=rng.random((5, links, 2)),
        frame_moments=rng.random((5, links)),
    )
    times = {"time": np.linspace(0, 4, sizes["t"]), "frame_time": np.linspace(0, 4, sizes["f"])}
    return arrays | times | {"before_release": before if has_frames else None}


def run_made_sweep() -> None:
    """Begin or go on with the sweep, to its end."""
    sweep = load_sweep(SWEEP)
    with SweepFolder.open(FOLDER, sweep, shard_size=SHARD_SIZE) as store:
        for shard in store.missing():
            rows, motions = missing_rows(shard.kind, shard.keys), {}
            for row, index in enumerate(shard.walks.tolist()):
                walk = sweep.planned(index)
                fill_row(walk, distance(walk), rows[row : row + 1])
                keep = sweep.keep(walk)
                if keep.series_every is not None:
                    motions[row] = made_motion(walk.setup.scene.links, keep.frame_every is not None)
            write_shard(store.directory, store.stamp, shard, rows, motions)
            store.log("a shard was written")


def sweep_content(path: Path = FOLDER) -> Any:
    """All that a reader gets of the sweep."""
    result = load(path)
    found: list[Any] = [result.sweep, result.seed, result.provenance]
    for block in result.blocks.values():
        found += [(name, values.tobytes()) for name, values in {**block.axes, **block.columns}.items()]
        for place in zip(*np.nonzero(block.kept), strict=True):
            motion = block.walk_motion(tuple(map(int, place)))
            before = motion.before_release
            arrays = (motion.time, motion.center, motion.center_velocity, motion.frame_time, motion.frame_joints)
            found += [array.tobytes() for array in arrays]
            found.append(None if before is None else before.frame_forces.tobytes())
    return found


def walk_content() -> Any:
    """All that a reader gets of the walk."""
    walk = load_walk(WALK)
    arrays = {name: value.tobytes() for name, value in vars(walk).items() if isinstance(value, np.ndarray)}
    return walk.to_dict(), walk.setup, arrays


READ: dict[Path, tuple[tuple[str, ...], Callable[[], Any]]] = {
    SHARD: (("info", str(FOLDER), "--json"), sweep_content),
    MANIFEST: (("info", str(FOLDER), "--json"), sweep_content),
    FOLDER / "sweep.yaml": (("info", str(FOLDER)), sweep_content),
    FOLDER / "log.txt": (("info", str(FOLDER)), sweep_content),
    WALK: (("walk", "--like", str(WALK)), walk_content),
    MERGED: (("info", str(MERGED)), lambda: sweep_content(MERGED)),
}
"""Each file, the command that reads it, and what the library makes of it."""
FILES = {
    "shard": SHARD,
    "sweep.json": MANIFEST,
    "sweep.yaml": FOLDER / "sweep.yaml",
    "log.txt": FOLDER / "log.txt",
    "walk.h5": WALK,
    "merged": MERGED,
}
WHOLE: dict[Path, bytes] = {}
EXPECTED: dict[Path, Any] = {}


def make_files() -> None:
    """The undamaged files."""
    run_made_sweep()
    make_walk().save(WALK)
    merge(FOLDER, MERGED)
    for path, (_, content) in READ.items():
        WHOLE[path], EXPECTED[path] = path.read_bytes(), content()


def read_again(path: Path) -> Outcome:
    """What the command and the library make of a changed file: never other numbers."""
    words, content = READ[path]
    outcome = command(*words)
    if outcome[1] is not None or outcome[0].startswith("exit"):
        return outcome
    found: list[Any] = []
    outcome = called(lambda: found.append(content()))
    if outcome[0] != "read":
        return outcome
    if repr(found[0]) == repr(EXPECTED[path]):
        return "equal", None
    return "other content", "read as something else"


def damage(name: str, steps: Steps) -> Outcome:
    """Bytes of a file changed."""
    path = FILES[name]
    path.write_bytes(damaged(WHOLE[path], steps))
    outcome = read_again(path)
    if outcome == ("equal", None) and path.suffix == ".h5" and path.read_bytes() != WHOLE[path]:
        return "missed", "the damage was not found"
    return outcome


def run_again(name: str, steps: Steps) -> Outcome:
    """Bytes of a shard changed, and the sweep run again, which replaces it."""
    path = FILES[name]
    path.write_bytes(damaged(WHOLE[path], steps))
    outcome = called(run_made_sweep)
    if outcome[0] == "read":
        return ("equal", None) if path.read_bytes() == WHOLE[path] else ("missed", "the shard is not as it was")
    return outcome


def fuzz_file(play: Callable[[str, Steps], Outcome]) -> Callable[[dict[str, Any]], Outcome]:
    """Play with a file, and put things back."""

    def played(given: dict[str, Any]) -> Outcome:
        try:
            return play(given["file"], given["steps"])
        finally:
            for path, content in WHOLE.items():
                if path.read_bytes() != content:
                    path.write_bytes(content)

    return played


PLAYS: dict[str, Callable[[Any], Outcome]] = {
    "setup": give_setup,
    "sweep": give_sweep,
    "python": give_python,
    "damage": fuzz_file(damage),
    "run again": fuzz_file(run_again),
}


def memory(key: str) -> float:
    """An entry of this process's status [MB]."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1000 for line in lines if line.startswith(f"{key}:"))


def play(kind: str, given: Any) -> Answer:
    """What becomes of an input, watched."""
    Path("/proc/self/clear_refs").write_text("5")  # the peak of memory begins anew
    begun = time.process_time()
    try:
        outcome, problem = PLAYS[kind](given)
    except Exception:
        outcome, problem = "test broke", traceback.format_exc()
    return Answer(outcome, problem, time.process_time() - begun, memory("VmHWM"))


def serve(folder: Path) -> None:
    """Answer each line."""
    answers = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever a library prints is no answer
    faulthandler.enable()
    os.chdir(folder)
    stop_at_walks()
    make_files()
    room = int(memory("VmSize") * 1e6) + ROOM
    resource.setrlimit(resource.RLIMIT_AS, (room, room))
    answers.write(b"ready\n")
    for line in sys.stdin:
        kind, given = json.loads(line)
        answer = play(kind, given)
        problem = None if answer.problem is None else answer.problem[-5000:]
        answers.write(json.dumps(vars(replace(answer, problem=problem))).encode() + b"\n")


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
