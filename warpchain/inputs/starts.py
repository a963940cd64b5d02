"""The table of starts. Help texts read it, so this module imports nothing heavy."""

from collections.abc import Mapping
from typing import Final, Literal, NamedTuple


class Start(NamedTuple):
    """How a walk starts: whether on a sprocket, in a few words for help texts, and as the legend of a figure."""

    on_sprocket: bool
    described: str
    legend: str


StartWord = Literal["rest", "spinning", "ellipse"]
STARTS: Final[Mapping[StartWord, Start]] = {
    "rest": Start(True, "spin up on the sprocket", "started at rest"),
    "spinning": Start(True, "circulate on it", "started spinning"),
    "ellipse": Start(False, "without a sprocket", "started as an ellipse"),
}
"""All starts; one without a sprocket has its curve among the `SHAPES` of `warpchain.chain.starts`."""
DESCRIBED: Final = "; ".join(f"{word}: {start.described}" for word, start in STARTS.items())
"""All starts for help texts."""
