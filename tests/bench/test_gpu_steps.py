"""The benchmark of a GPU: the parts that need none."""

import pytest

from warpchain.bench import gpu_steps
from warpchain.bench.gpu_steps import STAGE_FLOPS, evaluations, flops_per_attempt, gpu_costs
from warpchain.inputs.validation import InputError


def test_stages_that_an_attempt_evaluates() -> None:
    """A step of most methods begins with the last stage of the step before, one of rkf78 does not."""
    assert {name: evaluations(name) for name in gpu_steps.METHODS} == {"rkf78": 13, "dp5": 6, "bs32": 3, "os32": 6}


def test_arithmetic_of_an_attempt_counts_the_coefficients_that_are_not_zero() -> None:
    """Bogacki and Shampine's pair, by hand."""
    stages = 1 + 1 + 3  # rows of A
    products = 0 + 1 + 2  # rows of A·A: (3/8), (1/6, 1/3)
    weights = 3 + 2  # b and b·A
    errors = 4 + 3  # b − b̂ and its product with A
    coefficients = stages + products + weights + errors
    assert flops_per_attempt("bs32") == 3 * sum(STAGE_FLOPS.values()) + 6 * coefficients + gpu_steps.END_FLOPS
    assert flops_per_attempt("bs32") < flops_per_attempt("dp5") < flops_per_attempt("rkf78")


@pytest.mark.parametrize(
    ("what", "problem"),
    [
        ({"scenes": ["fall"]}, "bench.scene: 'fall' is not measured on a GPU; give one of flight, pile"),
        ({"methods": ["euler"]}, "bench.method: 'euler' is not measured on a GPU; give one of rkf78, dp5, bs32, os32"),
        ({"methods": ["hybrid"]}, "bench.method: 'hybrid' is not measured on a GPU"),
        ({"links": [60]}, "bench.device: cpu is not a GPU"),
    ],
)
def test_what_cannot_be_measured_is_refused(what: dict[str, list[object]], problem: str) -> None:
    """One line with the name of the option."""
    with pytest.raises(InputError, match=problem):
        gpu_costs("cpu", report=lambda line: None, **what)
