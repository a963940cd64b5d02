"""How a run ended: the codes of the kernels, each with a sentence."""

from enum import IntEnum
from typing import Final

from warpchain.kernels import codes


class Status(IntEnum):
    """What ended the run of one chain; the first error of a run is the one that stays."""

    RUNNING = codes.RUNNING
    AT_REST = codes.AT_REST
    FINISHED = codes.FINISHED
    TIME_LIMIT = codes.TIME_LIMIT
    STEP_LIMIT = codes.STEP_LIMIT
    STEP_TOO_SMALL = codes.STEP_TOO_SMALL
    NOT_FINITE = codes.NOT_FINITE
    NOT_STEADY = codes.NOT_STEADY
    LIST_OVERFLOW = codes.LIST_OVERFLOW
    DISTANCE_LIMIT = codes.DISTANCE_LIMIT

    @property
    def label(self) -> str:
        """Name in files and tables, such as `at_rest`."""
        return self.name.lower()

    @property
    def ok(self) -> bool:
        """Whether the run ended as it should: at rest, or at the end of its duration or distance."""
        return self in (Status.AT_REST, Status.FINISHED, Status.DISTANCE_LIMIT)

    @property
    def sentence(self) -> str:
        """What happened and, after a failure, what to try."""
        return _SENTENCES[self]


_SENTENCES: Final[dict[Status, str]] = {
    Status.RUNNING: "The run has not ended yet; let it go on.",
    Status.AT_REST: "The chain came to rest.",
    Status.FINISHED: "The run reached its planned end.",
    Status.TIME_LIMIT: (
        "The chain was still moving at the time limit of the walk; raise scene.walk_limit, "
        "give more floor_friction if it slides without end, or scene.distance_limit on a steep slope."
    ),
    Status.STEP_LIMIT: (
        "The walk used up its steps; raise options.step_limit, loosen options.tolerance or soften the joints."
    ),
    Status.STEP_TOO_SMALL: (
        "The error stayed too large down to options.smallest_step; lower that if you raised it, loosen "
        "options.tolerance, or bring stiffness, damping and friction of the joints closer to those of a preset."
    ),
    Status.NOT_FINITE: (
        "A position or velocity stopped being a finite number; start from lower speeds, "
        "or bring extreme parameters closer to those of a preset."
    ),
    Status.NOT_STEADY: (
        "The chain did not circulate steadily on the sprocket within scene.hold_limit; raise that limit if you lowered "
        "it. A chain that whirls, as with a heavy charm, needs start: ellipse, or a third of the frequency."
    ),
    Status.DISTANCE_LIMIT: "The chain was still moving when it was scene.distance_limit away.",
    Status.LIST_OVERFLOW: (
        "More links came close to one another than the neighbour list can hold; lower options.skin."
    ),
}
