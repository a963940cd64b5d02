"""Where and when a sweep was run is told beside it, outside of what is equal to the byte."""

import itertools
import json
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

import warpchain
from tests.support.synthetic_sweep import content
from warpchain.inputs.validation import InputError
from warpchain.reports.sweep_page import write_report
from warpchain.results.sweep_result import load, merge
from warpchain.results.walk_result import load_walk
from warpchain.store.crate import runs
from warpchain.store.shards import CRATE

WALK: dict[str, Any] = {"links": 30, "start": "ellipse", "walk_limit": 0.02}


def test_each_run_is_an_action_and_additions_stay(tmp_path: Path) -> None:
    """Two runs are two actions with command, machine and times; an author that was added stays; the graph is whole."""
    folder = tmp_path / "sweep"
    warpchain.sweep(**WALK, samples=1, out=folder)
    crate = json.loads((folder / CRATE).read_text(encoding="utf-8"))
    root = next(each for each in crate["@graph"] if each["@id"] == "./")
    root["author"] = {"@id": "#somebody"}
    crate["@graph"].append({"@id": "#somebody", "@type": "Person", "name": "Somebody"})
    (folder / CRATE).write_text(json.dumps(crate), encoding="utf-8")
    warpchain.sweep(**WALK, samples=3, out=folder)
    warpchain.sweep(**WALK, samples=3, out=folder)  # nothing to do is no run
    crate = json.loads((folder / CRATE).read_text(encoding="utf-8"))
    graph = {each["@id"]: each for each in crate["@graph"]}
    assert crate["@context"] == "https://w3id.org/ro/crate/1.1/context" and len(graph) == len(crate["@graph"])
    assert graph[CRATE]["about"] == {"@id": "./"} and graph["./"]["author"] == {"@id": "#somebody"}
    assert graph["./"]["description"].startswith("3 walks") and graph["#somebody"]["name"] == "Somebody"
    first, second = runs(folder)
    for run in (first, second):
        assert run["start"] <= run["end"] and run["command"] and "processor: " in run["machines"]
    for part in graph["./"]["hasPart"]:
        assert (folder / part["@id"]).exists()

    def references(value: Any) -> list[str]:
        own = [value["@id"]] if isinstance(value, dict) and set(value) == {"@id"} else []
        inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
        return own + [name for each in inner for name in references(each)]

    assert {*references(crate["@graph"])} <= {*graph, "https://w3id.org/ro/crate/1.1"}


def test_all_else_is_the_same_to_the_byte(tmp_path: Path) -> None:
    """The crate differs with the time of a run; sweep.h5, sweep.yaml and shards do not."""
    for name in ("one", "two"):
        warpchain.sweep(**WALK, samples=2, name="same", out=tmp_path / name)
    assert content(tmp_path / "one") == content(tmp_path / "two")


def test_the_machines_of_workers_are_named(tmp_path: Path) -> None:
    """A run by an executor has the machines of its workers, each once; the merged file has the runs of its parts."""
    with ThreadPoolExecutor(2) as threads:
        for part, machines in (("1/2", ["one", "two"]), ("2/2", ["three"])):
            turns = itertools.cycle(machines)

            class Elsewhere:
                """Workers of other machines, whose futures say which."""

                def submit(self, call: Callable[..., str], *given: Any) -> Future[str]:
                    """Run the task here."""
                    name = next(turns)  # noqa: B023
                    return threads.submit(lambda: f"{call(*given)}; {name}")

            out = tmp_path / part[0]
            warpchain.sweep(**WALK, samples=8, name="same", part=part, executor=Elsewhere(), workers=2, out=out)
            (run,) = runs(out)
            assert sorted(each.rpartition("; ")[2] for each in run["machines"].split(" | ")) == sorted(machines)
            assert "processor: " in run["machines"] and run["end"]
    merge([tmp_path / "1", tmp_path / "2"], tmp_path / "all.h5")
    assert load(tmp_path / "all.h5").provenance["runs"] == [*runs(tmp_path / "1"), *runs(tmp_path / "2")]
    write_report(tmp_path / "all.h5", tmp_path / "report.html")
    assert "; three" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_rounds_of_an_executor_leave_the_same_bytes(tmp_path: Path) -> None:
    """With `until` an executor is asked for one round after the other, all of one run, as threads are."""
    rounds: dict[str, Any] = {**WALK, "samples": 4, "until": {"dx": 0.1}, "at_most": 8, "name": "same"}
    warpchain.sweep(**rounds, out=tmp_path / "threads")
    with ThreadPoolExecutor(2) as executor:
        warpchain.sweep(**rounds, executor=executor, workers=2, out=tmp_path / "executor")
    assert content(tmp_path / "executor") == content(tmp_path / "threads")
    assert load(tmp_path / "threads").walk_count == 8 and len(runs(tmp_path / "executor")) == 1


def test_a_foreign_crate_is_not_replaced(tmp_path: Path) -> None:
    """In a folder without a sweep it is in the way; one that is no JSON is refused by its name, and nothing is run."""
    (tmp_path / CRATE).write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match=f"{CRATE}: in the way of a sweep"):
        warpchain.sweep(**WALK, samples=1, out=tmp_path)
    warpchain.sweep(**WALK, samples=1, out=tmp_path / "sweep")
    (tmp_path / "sweep" / CRATE).write_text("broken", encoding="utf-8")
    with pytest.raises(InputError, match=f"{CRATE}: expected an RO-Crate in JSON; move it out of this folder"):
        warpchain.sweep(**WALK, samples=2, out=tmp_path / "sweep")


def test_a_walk_names_its_machine(tmp_path: Path) -> None:
    """Command, date, system and processor go with the file of a walk and with its data set."""
    walk = warpchain.walk(**WALK)
    assert {"command", "date", "system", "processor"} <= walk.provenance.keys()
    walk.save(tmp_path / "walk.h5")
    assert load_walk(tmp_path / "walk.h5").provenance == walk.provenance
    assert json.loads(walk.to_xarray().attrs["provenance"]) == walk.provenance
