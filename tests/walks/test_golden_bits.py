"""The version of the numerics follows the bits: walks of all methods are what they were when it was last raised."""

import json

import pytest

import warpchain
from tests.support.same_walks import GOLDEN, bits_of, golden_walks, processor, values_of
from warpchain.version import NUMERICS_VERSION

KNOWN = json.loads(GOLDEN.read_text(encoding="utf-8"))


def test_golden_bits_are_of_this_version() -> None:
    """Who raises `NUMERICS_VERSION` makes them anew: python -m tests.support.same_walks --golden."""
    assert KNOWN["numerics_version"] == NUMERICS_VERSION
    assert KNOWN["walks"].keys() == golden_walks().keys()


@pytest.mark.parametrize("name", golden_walks())
def test_a_walk_has_its_golden_bits(name: str) -> None:
    """Its numbers and arrays, to the bit; if they differ on purpose, raise `NUMERICS_VERSION` and make them anew."""
    if KNOWN["processor"] != processor():
        pytest.skip(f"golden bits are of a processor with {KNOWN['processor']}, not {processor()}")
    values = values_of(warpchain.walk(**golden_walks()[name]))
    assert bits_of(values, KNOWN["values"]) == KNOWN["walks"][name]
