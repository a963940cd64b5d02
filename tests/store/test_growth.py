"""Folders of sweeps that are given more samples: shards stay, walks are those of the larger sweep, kills do no harm."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.run.test_sweep_run import data_of
from tests.support.made_sweeps import make_sweep
from tests.support.stopped_calls import is_stopped
from tests.support.sweep_content import UNIFORM, blocks, content
from tests.support.synthetic_sweep import content as files
from tests.support.synthetic_sweep import run
from warpchain.inputs.validation import InputError
from warpchain.results import sweep_result
from warpchain.results.sweep_result import SweepResult, load, merge
from warpchain.store.folder import SweepFolder
from warpchain.store.shards import Manifest, read_manifest
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.plan import PlannedWalk, load_sweep


def two_blocks(first: int, second: int, **changes: Any) -> dict[str, Any]:
    """A sweep of two blocks with numbers of samples of their own."""
    given = [{"grid": {"links": [60, 90]}, "samples": first}, {"grid": {"frequency": [5, 10, 15]}, "samples": second}]
    return blocks(*given, **changes)


def drawn_distance(walk: PlannedWalk) -> float:
    """A distance that depends on what the walk is, and not on its number [m]."""
    return walk.setup.scene.links + walk.setup.scene.frequency / 7 + sum(walk.draws.values())


def columns(result: SweepResult) -> dict[tuple[str, str], bytes]:
    """Block and name → bytes of all columns."""
    return {
        (block.name, name): values.tobytes()
        for block in result.blocks.values()
        for name, values in block.columns.items()
    }


@pytest.mark.parametrize("sampler", [name for name, sampler in SAMPLERS.items() if sampler.grows])
def test_a_grown_sweep_is_the_larger_one(tmp_path: Path, sampler: str) -> None:
    """Grown twice, in one block or both, a folder gives the larger sweep to the bit; no shard changes."""
    drawn = {"distributions": {"all": "fixed", "floor_friction": UNIFORM, "phase": {"uniform": [0, 1]}}}
    before: dict[str, bytes] = {}
    for counts in ((2, 4), (8, 4), (16, 8)):
        given = two_blocks(*counts, sampler=sampler, **drawn)
        grown = make_sweep(tmp_path / "grown", given, drawn_distance)
        after = data_of(tmp_path / "grown")
        assert before.items() < after.items()
        before = after
    fresh = make_sweep(tmp_path / "fresh", given, drawn_distance)
    assert grown.missing_count == 0 and columns(grown) == columns(fresh)
    assert grown.sweep == fresh.sweep and grown.provenance["digest"] == fresh.provenance["digest"]
    assert yaml.safe_load((tmp_path / "grown/sweep.yaml").read_text()) == fresh.sweep
    for name in ("grown", "fresh"):
        merge(tmp_path / name, tmp_path / f"{name}.h5")
    assert (tmp_path / "grown.h5").read_bytes() == (tmp_path / "fresh.h5").read_bytes()


def test_parts_that_grow_stay_parts_of_the_whole(tmp_path: Path) -> None:
    """Each part keeps its walks when all are given more samples: no walk is in two, and together they are the whole."""
    parts = [tmp_path / f"part-{number}" for number in (1, 2, 3)]
    small, large = (load_sweep(two_blocks(*samples)) for samples in ((4, 2), (7, 2)))
    for number, folder in enumerate(parts, 1):
        run(folder, small, part=(number, 3), shard_size=3)
        min((folder / "shards").glob("[0-9]*.h5")).unlink()  # growth does not wait for the walks before it
        run(folder, large, part=(number, 3), shard_size=3)
    merge(parts, tmp_path / "all.h5")
    run(tmp_path / "whole", large)
    whole = load(tmp_path / "whole")
    assert whole.missing_count == 0 and columns(load(tmp_path / "all.h5")) == columns(whole)


def test_every_step_of_growing_may_be_the_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stopped before any change to the folder, it can be read, and growing it again leaves the same bytes."""
    small, large = content(samples=2), content(samples=4)
    for given in (small, large):
        make_sweep(tmp_path / "whole", given, drawn_distance)
    expected, stops = files(tmp_path / "whole"), 0
    while True:
        folder = tmp_path / str(stops)
        make_sweep(folder, small, drawn_distance)
        if not is_stopped(lambda: make_sweep(folder, large, drawn_distance), stops, monkeypatch):  # noqa: B023
            break
        assert load(folder).summary()["at_rest"] >= 8
        assert not (folder / "sweep.yaml").exists() or (
            yaml.safe_load((folder / "sweep.yaml").read_text()) == read_manifest(folder).sweep.canonical()
        )
        make_sweep(folder, large, drawn_distance)
        assert files(folder) == expected, stops
        stops += 1
    assert stops >= 5


HYPERCUBE = content(samples=8, sampler="latin_hypercube")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (HYPERCUBE, "but a latin_hypercube design cannot grow; use samples: 4"),
        (
            content(samples=3),
            "holds 4 samples of each cell of block main, but 3 are requested; use samples: 4 or more",
        ),
        (content(samples=8, seed=8), "holds another sweep"),
        (content(samples=8, grid={"links": [60, 90], "frequency": [5, 12]}), "holds another sweep"),
        (content(samples=8, record={"series": True}), "holds another sweep"),
        (two_blocks(8, 8), "holds another sweep"),
    ],
)
def test_what_is_no_growth_is_refused(tmp_path: Path, given: dict[str, Any], message: str) -> None:
    """Fewer or no extensible samples, or another change beside, are refused in one line; the folder stays as it was."""
    make_sweep(tmp_path, HYPERCUBE | {"samples": 4} if given is HYPERCUBE else content(samples=4), drawn_distance)
    before = files(tmp_path)
    with pytest.raises(InputError, match=message) as caught:
        make_sweep(tmp_path, given, drawn_distance)
    assert "\n" not in str(caught.value) and files(tmp_path) == before


def test_a_reader_meets_a_sweep_that_begins_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a folder is begun anew between its list of walks and its shards, the reader gives the new sweep."""
    make_sweep(tmp_path, content(samples=2), drawn_distance)
    read = sweep_result.read_rows

    def late(directory: Path, manifest: Manifest) -> Any:
        monkeypatch.undo()
        other = load_sweep(content(samples=2, seed=8))
        SweepFolder.open(tmp_path, other, fresh=True, shard_size=8).close()
        make_sweep(tmp_path, content(samples=2, seed=8), drawn_distance)
        return read(directory, manifest)

    monkeypatch.setattr(sweep_result, "read_rows", late)
    found = load(tmp_path)
    assert (found.seed, found.missing_count) == (8, 0)
