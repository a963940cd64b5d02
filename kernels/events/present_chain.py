"""A chain's constants at this moment: under its present loads, with its present softness."""

import functools

import warp as wp

from warpchain.kernels.physics.elementary import ONE
from warpchain.kernels.physics.scaled_loads import under_load
from warpchain.kernels.physics.softness import softened
from warpchain.kernels.types import Chain, Control, Model, State

wp.set_module_options({"enable_backward": False})


@wp.func
def has_changed(state: State, world: int, softness: wp.float64, load_factor: wp.float64):
    """Whether a sample has changed a chain that had these values before, or the velocities of its links (drag)."""
    return state.softness[world] != softness or load_factor > ONE or state.load_factor[world] > ONE


@functools.cache
def present_chain(is_driven: bool):
    """Warp function ``present(model, state, control, world)`` → Chain.

    Args:
        is_driven: Whether its loads may change, see :mod:`physics.scaled_loads`.
    """

    @wp.func
    def present(model: Model, state: State, control: Control, world: int) -> Chain:
        chain = model.chains[world]
        if wp.static(is_driven):
            chain = under_load(chain, state.load_factor[world])
        return softened(chain, control, state.softness[world])

    return present
