"""The figures of a walk: the one table of their words. Help texts read it, so nothing heavy is imported here."""

from collections.abc import Mapping
from typing import Final, Literal, NamedTuple


class FigureKind(NamedTuple):
    """A figure of a walk: what it shows, for help texts; and whether a walk needs time series or a plane that tilts."""

    described: str
    needs_series: bool = True
    needs_tilt: bool = False


FigureWord = Literal["film_strip", "height_and_speed", "loop", "energy", "tilt"]
KINDS: Final[Mapping[FigureWord, FigureKind]] = {
    "film_strip": FigureKind("the chain itself", needs_series=False),
    "height_and_speed": FigureKind("of the centre of mass"),
    "loop": FigureKind("the loop on the sprocket just before the release", needs_series=False),
    "energy": FigureKind("energies, and what was lost"),
    "tilt": FigureKind("tilt, yaw and lateral drift of a plane that tilts", needs_tilt=True),
}
"""All figures of a walk; `warpchain.pictures.walk_figures` has a function for each."""
