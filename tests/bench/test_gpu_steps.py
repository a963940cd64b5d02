"""The bench of a GPU: what of it needs none."""

import math
from dataclasses import replace

import numpy as np
import pytest

from warpchain.bench import gpu_steps
from warpchain.bench.cpu_steps import LONGEST_STRETCH, flying
from warpchain.bench.gpu_steps import STAGE_FLOPS, Crowd, GpuCost, as_json, evaluations, flops_per_attempt, gpu_costs
from warpchain.cli.terminal import print_gpu_costs
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset
from warpchain.inputs.validation import InputError
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS

COST = GpuCost(
    scene="flight",
    method="dp5",
    links=60,
    chains=1000,
    microseconds=6.5,
    link_stages=5.5e10,
    chain_seconds=210.0,
    rejected=0.25,
    registers=168,
    spilled=160,
    blocks=6,
    occupancy=0.1875,
    peak=math.nan,
)


def test_stages_that_a_try_evaluates() -> None:
    """A step of most methods begins with the last stage of the step before, one of rkf78 does not."""
    assert {name: evaluations(name) for name in gpu_steps.METHODS} == {"rkf78": 13, "dp5": 6, "bs32": 3, "os32": 6}


def test_arithmetic_of_a_try_counts_the_coefficients_that_are_not_zero() -> None:
    """Bogacki and Shampine's pair, by hand."""
    stages = 1 + 1 + 3  # rows of A
    products = 0 + 1 + 2  # rows of A·A: (3/8), (1/6, 1/3)
    weights = 3 + 2  # b and b·A
    errors = 4 + 3  # b − b̂ and its product with A
    coefficients = stages + products + weights + errors
    assert flops_per_attempt("bs32") == 3 * sum(STAGE_FLOPS.values()) + 6 * coefficients + gpu_steps.END_FLOPS
    assert flops_per_attempt("bs32") < flops_per_attempt("dp5") < flops_per_attempt("rkf78")


def test_json_holds_everything_and_no_nan() -> None:
    """What is not known is null."""
    content = as_json({"gpu": "some GPU"}, [COST])
    assert content["machine"] == {"gpu": "some GPU"}
    assert content["attempts"][0]["peak"] is None
    assert content["attempts"][0]["microseconds"] == 6.5
    assert set(content["flops_per_attempt"]) == set(TABLEAUS)


def test_table_shows_a_row_for_each_measurement(capsys: pytest.CaptureFixture[str]) -> None:
    """The machine, headings, then numbers."""
    print_gpu_costs({"gpu": "some GPU"}, [COST, COST])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("gpu some GPU")
    rows = [line.split() for line in lines if line.startswith("flight")]
    assert rows == [["flight", "60", "dp5", "1000", "6.50", "5.50e+10", "210", "25.0%", "168", "160", "6", "(19%)"]] * 2


def test_what_has_no_meaning_for_a_method_is_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    """Methods that solve equations have no stages and no arithmetic of a tableau; the rest is shown."""
    for method in ("hybrid", "rodas5p"):
        assert math.isnan(evaluations(method)) and math.isnan(flops_per_attempt(method))
    cost = replace(COST, method="hybrid", link_stages=math.nan)
    assert as_json({}, [cost])["attempts"][0]["link_stages"] is None
    print_gpu_costs({}, [cost])
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if line.startswith("flight")]
    assert rows == [["flight", "60", "hybrid", "1000", "6.50", "210", "25.0%", "168", "160", "6", "(19%)"]]


@pytest.mark.parametrize("method", ["hybrid", "rodas5p", "dp5"])
def test_a_crowd_flies_and_never_lands(method: str) -> None:
    """Stretches are of flight alone, however far an attempt goes; on the CPU here, where a crowd does the same."""
    parameters = preset("paper")
    crowd = Crowd(parameters, Options(method=method), *flying(16, parameters), 5)
    stretches = crowd.measure(5)
    assert all(stretch.floor == 0 and stretch.tried > 0 and stretch.seconds > 0 for stretch in stretches)
    assert max(batch.time(0) for batch in crowd.batches) < 1.5 * LONGEST_STRETCH
    steps = [stretch.simulated / stretch.accepted for stretch in stretches]
    assert (min(steps) > 1e-4) == (method == "hybrid")
    first, *others = (batch.position(world) for batch in crowd.batches for world in range(len(batch.links)))
    assert len(others) == 4 and all(np.array_equal(first, other) for other in others)


@pytest.mark.parametrize(
    ("what", "problem"),
    [
        ({"scenes": ["fall"]}, "bench.scene: 'fall' is unknown; give one of flight, pile"),
        ({"methods": ["euler"]}, "bench.method: 'euler' is unknown"),
        ({"links": [60]}, "bench.device: cpu is not a GPU"),
    ],
)
def test_what_cannot_be_measured_is_refused(what: dict[str, list[object]], problem: str) -> None:
    """One line with the name of the option."""
    with pytest.raises(InputError, match=problem):
        gpu_costs("cpu", report=lambda line: None, **what)
