"""Dataclasses of hooks refuse Warp functions with other arguments than their loop hands them."""

import inspect
import re
from dataclasses import dataclass, fields
from typing import Any

import pytest
import warp as wp

from warpchain.kernels import hooks
from warpchain.kernels.contacts.fixed_body import BODIES, Body
from warpchain.kernels.cpu import loop, upright
from warpchain.kernels.gpu import loop as block_loop
from warpchain.kernels.gpu import upright as block_upright
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


def test_both_loops_have_the_parts_of_a_step_in_their_order() -> None:
    """The protocol names each part once; comments in the loops name the parts that they have, in that order."""
    parts = [part.lower() for part in re.findall(r"^- \*(\w+)\*", hooks.__doc__ or "", re.MULTILINE)]
    for module in (loop, block_loop):
        named = [word for word in re.findall(r"^ *# (\w+)", inspect.getsource(module), re.MULTILINE) if word in parts]
        assert named == [part for part in parts if part != "reject"]


def test_planes_of_both_devices_have_the_hooks_of_a_step() -> None:
    """They have the same names, whatever else one of the devices needs."""
    ours, theirs = ({hook.name for hook in fields(module.PlaneHooks)} for module in (upright, block_upright))
    assert ours & theirs == {"begin_run", "begin_step", "end_step", "meet"}
