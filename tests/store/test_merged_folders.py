"""One file of several folders, which are parts of one sweep."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from tests.run.test_sweep_run import TINY
from tests.support.command_line import Command
from tests.support.made_sweeps import make_sweep
from tests.support.made_walks import assert_same
from tests.support.sweep_content import blocks, content
from tests.support.synthetic_sweep import run, synthetic_sweep
from warpchain.inputs.validation import InputError, InputWarning
from warpchain.results.sweep_result import load, merge
from warpchain.run.sweep_run import sweep


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (content(), "repeats walks of an earlier folder; pass each part"),
        (content(samples=5), "expected a part of the sweep in a, got another sweep"),
        (content(seed=8), "expected a part of the sweep in"),
        (content(grid={"links": [60, 90], "frequency": [5, 12]}), "expected a part of the sweep in"),
        (content(options={"tolerance": 1e-5}), "expected a part of the sweep in"),
        (blocks({"grid": {"links": [60, 90]}}, {"grid": {"frequency": [5, 10]}}), "expected a part of the sweep in"),
    ],
)
def test_folders_that_do_not_fit_are_refused(
    tmp_path: Path, given: dict[str, Any], message: str, command: Command
) -> None:
    """The same walks twice, or other cells, are refused in one line, and no file is written."""
    make_sweep(tmp_path / "a", content())
    make_sweep(tmp_path / "b", given)
    answer = command("merge", "a", "b", "both.h5")
    error = answer.err.strip()
    assert answer.status == 2 and "error: b: " in error and message in error and "\n" not in error
    assert not (tmp_path / "both.h5").exists()
    assert yaml.safe_load((tmp_path / "b/sweep.yaml").read_text())["name"] == "small"


def test_parts_of_one_grid_are_the_whole(command: Command) -> None:
    """Run in parts by the command, of one file with other seed and samples, and merged, a sweep is as if run whole."""
    given = TINY | {"record": {"series": {"samples": [0, 7]}}}
    Path("tiny.yaml").write_text(yaml.safe_dump(given, sort_keys=False), encoding="utf-8")
    numbers = ["--seed", "11", "--samples", "9"]
    names = [f"part-{number}" for number in (1, 2, 3)]
    for number, name in enumerate(names, 1):
        part = command("sweep", "tiny.yaml", "-o", name, "--part", f"{number}/3", "--workers", "1", *numbers)
        assert part.status == 1  # all walks end at their time limit
    whole = sweep("tiny.yaml", "whole", seed=11, samples=9, workers=1, progress=False)
    assert [load(name).summary()["missing"] for name in names] == [24, 24, 24]
    assert command("merge", *names, "all.h5").status == 0
    both = load("all.h5")
    for name, column in whole.columns.items():
        assert both.columns[name].tobytes() == column.tobytes(), name
    for links, frequency, sample in itertools.product((30, 44), (5, 15), (0, 7)):
        at = {"links": links, "frequency": frequency, "sample": sample}
        assert_same(both.series(**at), whole.series(**at))
    with pytest.warns(InputWarning, match=r"two\.h5: 12 of 36 walks are missing"):
        merge(["part-1", "part-2"], "two.h5")
    assert command("merge", "part-1", "all.h5", "twice.h5").status == 2
    with pytest.raises(InputError, match=r"holds part 1/3 of its sweep, not 2/3; use --part 1/3"):
        sweep("tiny.yaml", "part-1", seed=11, samples=9, part="2/3")


def test_several_folders_are_one_result_everywhere(tmp_path: Path, command: Command) -> None:
    """`load`, `info` and `plot` take all parts of a sweep as `merge` does; a part says how far it is by itself."""
    sweep = synthetic_sweep({"name": "main", "grid": {"links": [60, 90, 120]}, "samples": 9})
    run(tmp_path / "whole", sweep)
    parts = [tmp_path / f"part-{number}" for number in (1, 2)]
    for number, folder in enumerate(parts, 1):
        run(folder, sweep, part=(number, 2), shard_size=4)
    for name, values in load(tmp_path / "whole").columns.items():
        np.testing.assert_array_equal(load(parts).columns[name], values)
    names = [*map(str, parts)]
    assert command("info", *names).out == command("info", str(tmp_path / "whole")).out
    assert "part 1/2: 14 of 14 walks\n" in command("info", names[0]).out
    assert "part 2/2: 13 of 13 walks\n" in command("info", names[1]).out
    min((parts[1] / "shards").glob("*.h5")).unlink()
    assert "part 2/2: 9 of 13 walks\n" in command("info", names[1]).out
    assert command("plot", *names, "-o", "figures").status == 0 and (tmp_path / "figures/distance.png").exists()
    with pytest.raises(InputError, match="repeats walks of an earlier folder"):
        load([parts[0], parts[0]])
