"""The setup of a walk from settings by name or symbol."""

from collections.abc import Mapping

from warpchain.inputs.sections import by_section
from warpchain.inputs.setup import Setup
from warpchain.run.single_walk import complete_setup


def setup_walk(preset: str, settings: Mapping[str, object], seed: int | None = None) -> Setup:
    """What `warpchain.walk` makes of these settings before it runs."""
    return complete_setup(preset, by_section(settings), seed)
