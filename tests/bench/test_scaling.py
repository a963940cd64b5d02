"""The same sweep on several places: what is timed, what is counted, what is compared, what is refused."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.run.test_sweep_run import TINY, data_of
from warpchain.bench import scaling
from warpchain.bench.places import Place, places_of
from warpchain.bench.record import plain
from warpchain.bench.scaling import Run, different_walks, measure
from warpchain.cli.main import main
from warpchain.engine.processors import processors
from warpchain.inputs.validation import InputError
from warpchain.run.sweep_run import sweep
from warpchain.store.shards import empty_rows
from warpchain.sweeps.plan import load_sweep

PLACES = [
    Place("cpu", "cpu", threads=1),
    Place("2xcpu", "cpu", threads=2),
    Place("processes", "cpu", processes=2),
    Place("cpu@3", "cpu", threads=1, samples=3),
]
"""The third one is what several GPUs are, on the CPU."""


def quiet(text: str) -> None:
    """Shows nothing."""


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> tuple[scaling.Scaling, Path]:
    """The tiny sweep on every place, and the folder."""
    folder = tmp_path_factory.mktemp("scaling") / "out"
    return measure(TINY, folder, PLACES, report=quiet), folder


def test_every_place_runs_the_whole_sweep(measured: tuple[scaling.Scaling, Path], tmp_path: Path) -> None:
    """Folders hold what the command `sweep` writes; a place with samples of its own takes so many of each cell."""
    _, folder = measured
    sweep(TINY, tmp_path / "sweep", device="cpu")
    for place in PLACES[:3]:
        assert data_of(folder / place.name) == data_of(tmp_path / "sweep")
    sweep(TINY | {"samples": 3}, tmp_path / "three")
    assert data_of(folder / "cpu@3") == data_of(tmp_path / "three")


@pytest.mark.parametrize(("device", "method"), [("cpu", "hybrid"), ("cuda", "os32")])
def test_a_word_means_what_it_does_on_the_place(device: str, method: str) -> None:
    """The default method of a sweep is another one on a GPU, and so it is where a sweep is measured there."""
    source = load_sweep({name: value for name, value in TINY.items() if name != "options"})
    (block,) = Place(device, device, samples=3).planned(source).blocks
    assert block.sections["options"]["method"] == method
    assert block.samples == 3


def test_rates_are_those_of_the_walks(measured: tuple[scaling.Scaling, Path]) -> None:
    """Walks and simulated time per wall time; the ratio is of walks per second, however many samples were taken."""
    costs, _ = measured[0].costs, measured[1]
    assert [cost.walks for cost in costs] == [80, 80, 80, 12]
    for cost in costs:
        assert cost.statuses == {"time_limit": cost.walks}
        assert cost.methods == "dp5 1e-06"
        assert cost.seconds == cost.all_seconds[0] > 0
        assert cost.walks_per_second == pytest.approx(cost.walks / cost.seconds)
        # walks of TINY end at their limit
        assert cost.simulated_per_second == pytest.approx(0.01 * cost.walks / cost.seconds, rel=1e-3)
        assert cost.ratio == pytest.approx(cost.walks_per_second / costs[0].walks_per_second)


def test_loading_kernels_is_not_timed_and_workers_are_counted(measured: tuple[scaling.Scaling, Path]) -> None:
    """Starting two processes takes longer than the walks; the processor time is that of the same walks anywhere."""
    one, _, processes, _ = measured[0].costs
    assert processes.loading_seconds > processes.seconds
    assert 0 < one.processor_seconds < 2.1 * one.seconds  # one thread runs walks, another looks after them
    assert 0.3 < processes.processor_seconds / one.processor_seconds < 4


def test_what_ran_the_same_samples_is_compared(measured: tuple[scaling.Scaling, Path]) -> None:
    """The first three places, and none with the fourth; all walks are equal."""
    found = [(one.first, one.second, one.walks, one.different) for one in measured[0].comparisons]
    assert found == [("cpu", "2xcpu", 80, 0), ("cpu", "processes", 80, 0), ("2xcpu", "processes", 80, 0)]


def test_other_layouts_of_as_many_walks_are_not_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two blocks of 2 and 4 samples have as many walks as two of 3, but other ones."""
    grid = {"frequency": [5, 15]}
    blocks = [{"name": str(count), "samples": count, "grid": grid} for count in (2, 4)]
    content = {key: value for key, value in TINY.items() if key not in ("samples", "grid")} | {"blocks": blocks}
    monkeypatch.setattr(scaling, "measure_once", lambda place, planned, *_: made_run(planned, 1.0))
    places = [Place("cpu", "cpu", threads=1), Place("cpu@3", "cpu", threads=1, samples=3)]
    tmp_path.joinpath("out").mkdir()
    found = measure(content, tmp_path / "out", places, report=quiet)
    assert [cost.walks for cost in found.costs] == [12, 12]
    assert found.comparisons == []


def made_run(planned: scaling.Sweep, seconds: float, changed: int = 0) -> Run:
    """A run that never was; so many of its walks went another way."""
    rows = empty_rows(planned, range(planned.walk_count))
    rows["status"], rows["dx"], rows["simulated_time"] = 1, 0.5, 2.0
    rows["dx"][:changed] = np.nextafter(0.5, 1)
    return Run(seconds, 3 * seconds, 10 * seconds, rows)


def test_medians_and_changes_over_the_rounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Places take turns; times are medians; rounds and places that differ in the last bit are told."""
    runs = iter([(4.0, 0), (1.0, 2), (2.0, 0), (3.0, 2), (9.0, 0), (0.5, 5)])
    order: list[str] = []

    def fake(place: Place, planned: scaling.Sweep, folder: Path, report: object) -> Run:
        order.append(place.name)
        return made_run(planned, *next(runs))

    monkeypatch.setattr(scaling, "measure_once", fake)
    folder = tmp_path / "out"
    folder.mkdir()
    found = measure(TINY, folder, PLACES[:2], rounds=3, report=quiet)
    assert order == ["cpu", "2xcpu"] * 3
    one, two = found.costs
    assert (one.seconds, two.seconds, one.all_seconds, two.all_seconds) == (4.0, 1.0, [4.0, 2.0, 9.0], [1.0, 3.0, 0.5])
    assert (one.ratio, two.ratio, two.walks_per_second, two.simulated_per_second) == (1.0, 4.0, 80.0, 160.0)
    assert (two.processor_seconds, two.loading_seconds) == (3.0, 10.0)
    assert [(c.first, c.second, c.different) for c in found.comparisons] == [("2xcpu", "2xcpu", 3), ("cpu", "2xcpu", 2)]
    assert json.loads((folder / "scaling.json").read_text()) == plain(found)


@pytest.mark.parametrize("column", ["status", "dx", "steps_accepted", "steps_rejected", "impulses_self"])
def test_walks_differ_in_any_bit(column: str) -> None:
    """One unit in the last place of Δx, one step, one impulse; NaN equals NaN, and −0.0 is not 0.0."""
    rows = made_run(load_sweep(TINY), 1.0).rows
    rows["dx"][:3] = math.nan, 0.0, 1.0
    other = rows.copy()
    assert different_walks(rows, other) == 0
    if column == "dx":
        other["dx"][1:3] = -0.0, np.nextafter(1.0, 2)
        assert different_walks(rows, other) == 2
    else:
        other[column][7] += 1
        assert different_walks(rows, other) == 1


def test_places_are_read() -> None:
    """So many cores, GPUs by one process or several, samples of their own or those of all."""
    assert Place.parse("cpu") == Place.parse("1xcpu") == Place("cpu", "cpu", threads=1)
    assert Place.parse("cpu@7", 3) == Place("cpu@7", "cpu", threads=1, samples=7)
    assert [place.samples for place in places_of(["cpu", "cpu@2"], 5)] == [5, 2]


@pytest.mark.parametrize(
    ("devices", "message"),
    [
        ("cpu:2", "--devices: 'cpu:2' is no place to run on; give 2xcpu"),
        ("gpu", "--devices: 'gpu' is no place to run on; give such as cpu, 4xcpu, cuda"),
        ("0xcpu", "--devices: '0xcpu' asks for none; give numbers from 1"),
        ("cpu@0", "--devices: 'cpu@0' asks for none; give numbers from 1"),
        ("9999xcpu", f"but there are {processors()} processors; give no more"),
        ("2xcuda:1", "--devices: '2xcuda:1': cuda:1 is one GPU; give cuda:1, or 2xcuda"),
        ("cuda:99", "options.device: there is no cuda:99 on this machine"),
        ("cpu,1xcpu", "--devices: 'cpu' is given twice; leave one out"),
        (",", "--devices: nothing in it"),
    ],
)
def test_impossible_places_are_refused(
    tmp_path: Path, devices: str, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """One line says why, and no folder is made."""
    assert refused(tmp_path, ["--devices", devices], capfd).startswith("error: ")
    assert message in refused(tmp_path, ["--devices", devices], capfd)
    assert not (tmp_path / "out").exists()


def refused(tmp_path: Path, given: list[str], capfd: pytest.CaptureFixture[str]) -> str:
    """What the command says that ends with status 2, in one line."""
    source = tmp_path / "tiny.yaml"
    source.write_text(yaml.safe_dump(TINY, sort_keys=False))
    with pytest.raises(SystemExit) as caught:
        main(["bench", "sweep", str(source), "-o", str(tmp_path / "out"), *given])
    assert caught.value.code == 2
    text = capfd.readouterr().err
    assert text.count("\n") == 1
    return text


def test_results_are_not_overwritten(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A folder that is there is refused, unless it is to be discarded; one of another kind is refused in any case."""
    (tmp_path / "out" / "cpu").mkdir(parents=True)
    (tmp_path / "out" / "cpu" / "log.txt").touch()
    assert "out/cpu: is there already" in refused(tmp_path, ["--devices", "cpu"], capfd)
    assert "log.txt: in the way of a sweep" in refused(tmp_path, ["--devices", "cpu", "--fresh"], capfd)


def test_a_sweep_that_cannot_be_is_refused(tmp_path: Path) -> None:
    """Before anything is run: samples that the file's design cannot have."""
    content = TINY | {"sampler": "sobol", "samples": 4}
    with pytest.raises(InputError, match="samples"):
        measure(content, tmp_path / "out", [Place("cpu@3", "cpu", threads=1, samples=3)], report=quiet)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("json_wanted", [True, False])
def test_command_prints_what_it_measured(tmp_path: Path, capfd: pytest.CaptureFixture[str], json_wanted: bool) -> None:
    """`--json` prints the very file, with machine and versions; else a table says the same of each place."""
    source = tmp_path / "tiny.yaml"
    source.write_text(yaml.safe_dump(TINY, sort_keys=False))
    with pytest.raises(SystemExit) as caught:
        line = ["bench", "sweep", str(source), "-o", str(tmp_path / "out"), "--devices", "cpu@1,2xcpu@1"]
        main([*line, "--json"] if json_wanted else line)
    assert not caught.value.code
    printed, content = capfd.readouterr().out, json.loads((tmp_path / "out" / "scaling.json").read_text())
    if json_wanted:
        assert json.loads(printed) == content
    else:
        rows = [text.split()[:5] for text in printed.splitlines() if "dp5" in text]
        assert rows == [[place, "dp5", "1e-06", "4", "4"] for place in ("cpu@1", "2xcpu@1")]
        assert printed.endswith("cpu@1 and 2xcpu@1: all 4 walks equal, bit by bit\n")
    assert {"processor", "processors", "warpchain", "warp-lang"} <= set(content["machine"])
    assert content["sweep"] == "tiny" and [cost["walks"] for cost in content["costs"]] == [4, 4]
