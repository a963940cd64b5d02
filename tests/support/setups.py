"""The setup of a walk from settings by name or symbol."""

from collections.abc import Mapping

from warpchain.chain.resolution import resolve
from warpchain.chain.setup import Setup
from warpchain.inputs.fields import by_section


def setup_walk(preset: str, settings: Mapping[str, object], seed: int | None = None) -> Setup:
    """What `warpchain.walk` makes of these settings before it runs."""
    return resolve(preset, **by_section(settings), seed=seed)
