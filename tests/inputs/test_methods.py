"""Methods by their names: integrators, and words for a need."""

import subprocess
import sys

import pytest

from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.kernels.methods.method import find_method


def test_a_new_tableau_is_a_method() -> None:
    """A tableau that is registered is taken for `method`, and named in its description and in the help."""
    program = (
        "from dataclasses import replace\n"
        "from warpchain.kernels.methods.explicit_tableaus import BS32, register\n"
        "register(replace(BS32, name='new32', title='a new method 3(2)'))\n"
        "from warpchain.cli.main import main\n"
        "from warpchain.inputs.options import Options\n"
        "print(Options(method='new32', device='cuda').method)\n"
        "main(['walk', '--help'])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert done.stderr == "" and done.stdout.startswith("new32\n")
    assert "new32: a new method" in done.stdout


def test_words_mean_methods_that_the_device_has() -> None:
    """`standard` on a GPU is `explicit`; a word's tolerance of soft joints goes with the word's own tolerance only."""
    for word in METHODS_BY_NEED:
        assert find_method(Options(method=word, device="cuda").method).runs_on_gpus
    assert Options(device="cuda") == Options(method="explicit", device="cuda")


@pytest.mark.parametrize("word", ["standard", "explicit"])
def test_a_tolerance_given_beside_a_word_is_that_of_soft_joints_too(word: str) -> None:
    """Unless theirs is given as well."""
    assert Options(method=word).soft_tolerance > Options(method=word).tolerance
    assert Options(method=word, tolerance=1e-5).soft_tolerance is None
    assert Options(method=word, tolerance=1e-5, soft_tolerance=1e-4).soft_tolerance == 1e-4
    assert Options(method=word, tolerance=1e-5).soften_pile
