"""Methods by their names: integrators, and words for a need."""

import pytest

from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.kernels.methods.method import find_method


def test_words_mean_methods_that_the_device_has() -> None:
    """`standard` on a GPU is `explicit`; a word's tolerance of soft joints goes with the word's own tolerance only."""
    for word in METHODS_BY_NEED:
        assert not find_method(Options(method=word, device="cuda").method).has_rigid_flight
    assert Options(device="cuda") == Options(method="explicit", device="cuda")


@pytest.mark.parametrize("word", ["standard", "explicit"])
def test_a_tolerance_given_beside_a_word_is_that_of_soft_joints_too(word: str) -> None:
    """Unless theirs is given as well."""
    assert Options(method=word).soft_tolerance > Options(method=word).tolerance
    assert Options(method=word, tolerance=1e-5).soft_tolerance is None
    assert Options(method=word, tolerance=1e-5, soft_tolerance=1e-4).soft_tolerance == 1e-4
    assert Options(method=word, tolerance=1e-5).soften_pile
