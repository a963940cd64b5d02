"""Methods by their names: integrators, words for a need, and what is refused on a GPU."""

import subprocess
import sys

import pytest

from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.kernels.methods.method import find_method, method_names


def test_a_new_tableau_is_a_method() -> None:
    """A tableau that is registered is taken for `method`, and named in its description and in the help."""
    program = (
        "from dataclasses import replace\n"
        "from warpchain.kernels.methods.explicit_tableaus import BS32, register\n"
        "register(replace(BS32, name='new32', title='a new method 3(2)'))\n"
        "from warpchain.cli.main import main\n"
        "from warpchain.inputs.options import Options\n"
        "print(Options(method='new32', device='cuda').method)\n"
        "print('new32: a new method 3(2)' in Options.model_fields['method'].description)\n"
        "main(['walk', '--help'])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert done.stderr == "" and done.stdout.startswith("new32\nTrue\n")
    assert "new32: a new method" in done.stdout


def test_methods_that_a_gpu_has_no_kernel_for_are_refused_there() -> None:
    """`hybrid` is one, `standard` is not among the methods that are refused, and the word that is named is taken."""
    assert {"hybrid"} == {name for name in method_names() if not find_method(name).runs_on_gpus}
    for word in METHODS_BY_NEED:
        assert find_method(Options(method=word, device="cuda").method).runs_on_gpus
    assert Options(device="cuda") == Options(method="explicit", device="cuda")


def test_hybrid_alone_has_the_tolerance_that_it_is_made_for() -> None:
    """1e-4 for its bursts of order 3, unless one says otherwise; other integrators 1e-6."""
    assert Options.model_validate({"method": "hybrid"}).tolerance == 1e-4
    assert Options.model_validate({"method": "hybrid", "tolerance": 1e-5}).tolerance == 1e-5
    assert Options.model_validate({"method": "os32"}).tolerance == 1e-6


@pytest.mark.parametrize("word", ["standard", "explicit"])
def test_a_tolerance_given_beside_a_word_is_that_of_soft_joints_too(word: str) -> None:
    """A word's tolerance of soft joints goes with the word's own tolerance only; one that is given stays."""
    assert Options(method=word).soft_tolerance > Options(method=word).tolerance
    assert Options(method=word, tolerance=1e-5).soft_tolerance is None
    assert Options(method=word, tolerance=1e-5, soft_tolerance=1e-4).soft_tolerance == 1e-4
    assert Options(method=word, tolerance=1e-5).soften_pile
