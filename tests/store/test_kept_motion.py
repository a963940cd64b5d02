"""Series and frames that a sweep keeps of its walks: what they are, that they survive, and who reads them."""

from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import warpchain
from tests.run.test_sweep_run import TINY, brief_setup, data_of, outcome, outcomes
from warpchain.chain.keep import Keep
from warpchain.engine.batch import CAPACITY_SAMPLES
from warpchain.inputs.validation import InputError, InputWarning
from warpchain.reports.sweep_page import write_report
from warpchain.results.sweep_result import load, merge
from warpchain.run.sweep_run import sweep
from warpchain.walks.scheduler import run_setups

OFTEN = {"method": "dp5", "record_interval": 1e-4}
RECORD: dict[str, Any] = {"series": {"interval": 1e-4, "samples": [0, 3]}, "frames": {"interval": 5e-4, "samples": [3]}}
KEPT: dict[str, Any] = TINY | {"samples": 5, "options": OFTEN, "record": RECORD}


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a sweep that keeps the motion of two of five samples, run on one thread."""
    folder = tmp_path_factory.mktemp("kept") / "sweep"
    sweep(KEPT, folder, workers=1)
    return folder


def same(one: warpchain.WalkResult, walk: warpchain.WalkResult) -> bool:
    """Whether a kept walk has the series and frames of a walk, to the bit."""
    names = ("time", "center", "center_velocity", "kinetic_energy", "lowest", "frame_time", "sprocket_center")
    joints = walk.frame_joints.astype(np.float32)
    return np.array_equal(one.frame_joints, joints) and all(
        np.array_equal(getattr(one, name), getattr(walk, name)) for name in names
    )


def test_kept_is_what_the_walk_itself_gives(tmp_path: Path) -> None:
    """Series, frames and sprocket of a sweep's walk are those of `warpchain.walk`, to the bit."""
    scene = {"start": "spinning", "walk_limit": 0.02, "frequency": 12.0}
    content = TINY | {"samples": 1, "grid": {"links": [60]}, "scene": scene, "record": {"series": True, "frames": True}}
    kept = sweep(content, tmp_path / "sweep").series()
    walk = warpchain.walk(preset="soft", seed=7, links=60, method="dp5", **scene)
    assert len(kept.time) > 15 and kept.frame_joints.shape[1:] == (60, 2) and len(kept.frame_time) > 8
    assert kept.time[0] == 0 and kept.sprocket_radius == walk.sprocket_radius and kept.status == walk.status
    assert same(kept, walk) and kept.setup == walk.setup and kept.energy == walk.energy
    assert (kept.unit("center_velocity"), kept.unit("time")) == ("m/s", "s") and "mass" in kept.meaning("center")


def test_a_coarser_interval_keeps_every_so_many_rows_and_the_last() -> None:
    """Kept are the rows at whole multiples of the interval, as a fine series has them, and the last sample."""
    setup = brief_setup(3, record_interval=1e-4)
    (((_, fine),),) = run_setups([setup], keeps=[Keep(series_every=1)])
    (((_, coarse),),) = run_setups([setup], keeps=[Keep(series_every=7)])
    whole, kept = fine.recorder.motion(), coarse.recorder.motion()
    marks = np.arange(0.0, 0.01, 7e-4)
    assert kept["time"][:-1] == pytest.approx(marks) and kept["time"][-1] == whole["time"][-1] == pytest.approx(0.01)
    for name in ("time", "center", "kinetic_energy"):
        np.testing.assert_allclose(kept[name][:-1], whole[name][:100:7], rtol=1e-14, atol=1e-16)
        assert (kept[name][-1] == whole[name][-1]).all()


def motion_bytes(motion: dict[str, Any]) -> bytes:
    """All arrays of a motion."""
    return b"".join(values.tobytes() for values in motion.values() if values is not None)


def test_motions_do_not_depend_on_their_batch() -> None:
    """Slots, order and company of other n, methods and starts change no bit; keeping one changes none of its walk."""
    setups = [brief_setup(seed, record_interval=1e-5) for seed in range(5)]  # fills the device's record
    setups += [brief_setup(9, links=44, start="spinning", hold_limit=0.05)]
    setups += [brief_setup(9, method="rkf78"), brief_setup(9, links=240, method="os32"), brief_setup(9)]
    keeps = [Keep(series_every=1, frame_every=20), Keep(), Keep(series_every=3)] * 3

    def run(order: list[int], slots: int) -> list[tuple[bytes, object]]:
        found = {}
        runs = run_setups([setups[i] for i in order], keeps=[keeps[i] for i in order], slots=slots)
        for place, run in chain.from_iterable(runs):
            found[order[place]] = (motion_bytes(run.recorder.motion()), outcome(run))
        return [found[i] for i in range(len(setups))]

    alone = [run([*range(9)], 1), run([*range(9)], 4), run([5, 3, 8, 1, 0, 7, 2, 4, 6], 3)]
    assert alone[0] == alone[1] == alone[2]
    assert len(set(alone[0])) == 9
    assert outcomes(setups) == [end for _, end in alone[0]]


def test_a_fixed_plane_has_no_places_in_the_room_beside_one_that_tilts() -> None:
    """Frames of a walk in a fixed plane are those of the walk alone, whatever ran with it."""
    setups = [brief_setup(1, plane=plane) for plane in ("tilting", "fixed")]
    keeps = [Keep(series_every=1, frame_every=1)] * 2
    motions = {place: run.recorder.motion() for over in run_setups(setups, keeps=keeps) for place, run in over}
    (((_, alone),),) = run_setups(setups[1:], keeps=keeps[1:])
    assert len(motions[0]["frame_origin"]) == len(motions[0]["frame_time"]) > 3
    assert motion_bytes(motions[1]) == motion_bytes(alone.recorder.motion())


def test_long_motions_are_drained_between_launches() -> None:
    """A series longer than the device's record has a row at every mark, in order and without a gap."""
    setup = brief_setup(1, record_interval=1e-6, walk_limit=0.04)  # a sample after each step
    (((_, run),),) = run_setups([setup], keeps=[Keep(series_every=1, frame_every=10)])
    time = run.recorder.motion()["time"]
    assert run.outcome().steps_accepted > 3 * CAPACITY_SAMPLES
    np.testing.assert_allclose(time, np.arange(40_001) * 1e-6, rtol=1e-12)
    frames = run.recorder.motion()["frame_time"]
    assert len(frames) > 100 and np.all(np.diff(frames) > 0)


def test_only_chosen_samples_are_kept(kept: Path) -> None:
    """The samples that the file names have series and frames, the others are told apart by a clear line."""
    result = load(kept)
    assert result.kept.shape == result.dx.shape == (2, 2, 5)
    assert result.kept.any(axis=(0, 1)).tolist() == [True, False, False, True, False]
    first, last = result.series(links=44, frequency=5), result.series(links=44, frequency=5, sample=3)
    assert (len(first.frame_time), last.frame_joints.shape) == (0, (len(last.frame_time), 44, 2))
    assert len(last.frame_time) == pytest.approx(20, abs=1) and first.sprocket_center is None
    assert last.setup.scene.links == 44
    for message, at in (
        (r"walk 6 is not there; use one of the samples 0, 3", {"links": 44, "frequency": 5, "sample": 1}),
        (r"frequency: 6 is not on the axis; use one of 5\.0, 15\.0", {"links": 44, "frequency": 6}),
        (r"frequency: missing; use one of 5\.0, 15\.0", {"links": 44}),
        (r"link: not an axis of block main; did you mean links", {"link": 44}),
        (r"sample: expected 0 to 4, got 5", {"links": 44, "frequency": 5, "sample": 5}),
        (r"sample: expected 0 to 4, got True", {"links": 44, "frequency": 5, "sample": True}),
    ):
        with pytest.raises(InputError, match=message):
            result.series(**at)


def test_xarray_reads_motions_of_a_merged_file(kept: Path, tmp_path: Path) -> None:
    """The whole file opens as one tree; the kept motions have named dimensions and the numbers of the folder."""
    merge(kept, tmp_path / "all.h5")
    merge(tmp_path / "all.h5", tmp_path / "again.h5")
    assert (tmp_path / "all.h5").read_bytes() == (tmp_path / "again.h5").read_bytes()
    block = next(iter(load(kept).blocks.values()))
    place = int(np.flatnonzero(block.kept)[0])
    walk = block.walk_motion(tuple(map(int, np.unravel_index(place, block.shape))))
    with xarray.open_datatree(tmp_path / "all.h5") as tree:
        assert not any("phony" in str(name) for node in tree.subtree for name in node.dims)
        motion = next(node[f"motion/{place}"] for node in tree.subtree if "motion" in node.children)
        assert motion["series/center"].dims == ("time", "axis") and (motion["series/center"] == walk.center).all()


def test_damage_to_a_motion_is_seen(kept: Path, tmp_path: Path) -> None:
    """A flipped bit in a series is refused with the remedy, also when it comes later; a run computes it again."""
    sweep(KEPT, tmp_path, workers=1)
    path = tmp_path / "shards/000012.h5"
    assert path.read_bytes() == (kept / "shards" / path.name).read_bytes()
    result = load(tmp_path)
    content, wanted = bytearray(path.read_bytes()), result.series(links=30, frequency=5, sample=3).center.tobytes()
    assert content.count(wanted) == 1
    content[content.index(wanted) + 11] ^= 4
    path.write_bytes(content)
    for read in (lambda: result.series(links=30, frequency=5, sample=3), lambda: load(tmp_path)):
        with pytest.raises(InputError, match=f"{path}: damaged .*; move it out of this folder and run the sweep again"):
            read()
    with pytest.warns(InputWarning, match=f"{path}: .*; its walks are computed again"):
        sweep(KEPT, tmp_path)
    assert data_of(tmp_path) == data_of(kept)


def test_report_and_pictures_use_kept_frames(kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A walk with frames is shown without running it again; one without is run again, as ever."""

    def refuse(*arguments: object, **settings: object) -> None:
        raise AssertionError("run again")

    monkeypatch.setattr("warpchain.results.one_walk.run_walk", refuse)
    write_report(kept, tmp_path / "page.html", animation_of=12)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Its frames were kept by the sweep" in page and "run again" not in page
    assert page.count("<iframe") == 1 and "as in the paper&#x27;s Figure 5" in page
    with pytest.raises(AssertionError, match="run again"):
        write_report(kept, tmp_path / "page.html", animation_of=0)
