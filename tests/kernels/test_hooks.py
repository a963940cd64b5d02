"""Dataclasses of hooks refuse Warp functions with other arguments than their loop hands them."""

from dataclasses import dataclass
from typing import Any

import pytest
import warp as wp

from warpchain.kernels.contacts.fixed_body import BODIES, Body
from warpchain.kernels.hooks import Hooks, hook
from warpchain.kernels.physics.load import Load, no_energy, weight
from warpchain.kernels.types import Chain


@wp.func
def scaled(_chain: Chain, factor: wp.float64):
    """A hook that has no use for the chain."""
    return factor


@dataclass(frozen=True)
class OneHook(Hooks):
    """A dataclass with a hook that may be left out."""

    scale: Any = hook(chain=Chain, factor=wp.float64, otherwise=None)


def test_a_hook_may_leave_arguments_unused() -> None:
    """An underscore before a name, and a hook that is not there, fit."""
    assert OneHook(scaled).scale is scaled
    assert OneHook().scale is None


def test_a_hook_with_other_arguments_is_named() -> None:
    """Names, types, order and number count; the line names hook and function."""
    with pytest.raises(TypeError, match=r"^Load\.energy: expected arguments .*, got .* of .*weight$"):
        Load(weight, weight)
    with pytest.raises(TypeError, match=r"^Load\.acceleration: "):
        Load(no_energy, no_energy)
    with pytest.raises(TypeError, match=r"^Body\.surface: "):
        Body(surface=BODIES["sprocket"].motion)
