"""Tables of the benchmarks."""

import math
from dataclasses import replace

import pytest

from warpchain.bench.cpu_steps import BroadPhaseCost, StepCost
from warpchain.bench.gpu_steps import GpuCost
from warpchain.bench.scaling import Comparison, PlaceCost
from warpchain.cli.bench_tables import TABLES, print_bench

MACHINE = {"gpu": "some GPU", "system": "some system"}
STEP = StepCost("flight", "hybrid", 60, 3.5, 12.25, 4e-4, 0.0, 0.0123)
LIST = BroadPhaseCost(180, 152, 5.5)
GPU = GpuCost("flight", "dp5", 60, 1000, 6.5, 5.5e10, 210.0, 0.25, 168, 160, 6, 0.1875, 0.4)
PLACE = PlaceCost(
    "2xcpu", "dp5 1e-06", 1200, {"at_rest": 1190, "time_limit": 10}, [4.0], 4.0, 7.9, 30.0, 300.0, 600.0, 1.9
)


@pytest.mark.parametrize(
    ("name", "row", "texts"),
    [
        ("steps", STEP, "flight 60 hybrid 3.50 12.25 400 0.0% 0.0123"),
        ("steps", replace(STEP, per_link_stage=math.nan, rejected=math.nan), "flight 60 hybrid 3.50 400 0.0123"),
        ("broad_phase", LIST, "180 152 5.5"),
        ("attempts", GPU, "flight 60 dp5 1000 6.50 5.50e+10 210 25.0% 168 160 6 (19%) 40%"),
        ("attempts", replace(GPU, peak=math.nan), "flight 60 dp5 1000 6.50 5.50e+10 210 25.0% 168 160 6 (19%)"),
        ("costs", PLACE, "2xcpu dp5 1e-06 1,200 10 4.0 300 600 7.9 1.90 30.0"),
    ],
)
def test_a_table_has_a_row_for_each_measurement(
    name: str, row: object, texts: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The machine, headings, then a line for each row, without the numbers that are unknown."""
    print_bench(MACHINE, "a line", (name, [row, row]))
    about, _, line, _, *headings, one, other = capsys.readouterr().out.splitlines()
    assert (about, line) == ("gpu some GPU, system some system", "a line")
    assert sorted(" ".join(headings).split()) == sorted(" ".join(TABLES[name]).split())
    assert one.split() == other.split() == texts.split()


def test_comparisons_are_told_in_a_line() -> None:
    """Of two places or of two rounds of one."""
    assert str(Comparison("cpu", "2xcpu", 1200, 0)) == "cpu and 2xcpu: all 1,200 walks equal, bit by bit"
    assert str(Comparison("cpu", "cpu", 1200, 3)) == "two rounds of cpu: 3 of 1,200 walks differ"
