"""A chain's constants at this moment: under its present loads, with its present softness."""

import warp as wp

from warpchain.kernels.physics.elementary import ONE
from warpchain.kernels.physics.scaled_loads import under_load
from warpchain.kernels.physics.softness import softened
from warpchain.kernels.types import Chain, Worlds


@wp.func
def has_changed(worlds: Worlds, world: int, softness: wp.float64, load_factor: wp.float64):
    """Whether a sample has changed a chain that had these values before, or the velocities of its links (drag)."""
    return worlds.softness[world] != softness or load_factor > ONE or worlds.load_factor[world] > ONE


@wp.func
def present_chain(worlds: Worlds, world: int) -> Chain:
    """The chain of a world; loads are multiplied on a sprocket only, see :mod:`physics.scaled_loads`."""
    chain = under_load(worlds.model.chains[world], worlds.load_factor[world])
    return softened(chain, worlds.control, worlds.softness[world])
