"""The statuses with which a run ends. Every result has one; its sentence says what happened and what to try."""

from enum import IntEnum
from typing import Final

from warpchain.kernels import codes


class Status(IntEnum):
    """What ended the run of one chain; after several errors, the first one counts."""

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
    Status.RUNNING: "The run has not ended yet; resume it.",
    Status.AT_REST: "The chain came to rest.",
    Status.FINISHED: "The run reached its intended end.",
    Status.TIME_LIMIT: (
        "The chain was still moving at the time limit of the walk; raise scene.walk_limit, raise floor_friction if it "
        "keeps sliding, or set scene.distance_limit on a steep slope."
    ),
    Status.STEP_LIMIT: (
        "The walk reached options.step_limit; raise it, raise options.tolerance, or soften the joints."
    ),
    Status.STEP_TOO_SMALL: (
        "The error was still too large at options.smallest_step; lower that if you raised it, raise options.tolerance, "
        "or bring stiffness, damping and friction of the joints closer to those of a preset."
    ),
    Status.NOT_FINITE: (
        "A position or velocity is no longer a finite number; start from lower speeds, or bring extreme parameters "
        "closer to those of a preset."
    ),
    Status.NOT_STEADY: (
        "The chain did not circulate steadily on the sprocket within scene.hold_limit; raise that limit if you lowered "
        "it. A chain that whips, e.g. with a heavy point mass, needs start: ellipse, or a third of the frequency."
    ),
    Status.DISTANCE_LIMIT: "The chain was still moving when it reached scene.distance_limit.",
    Status.LIST_OVERFLOW: ("More links came close to each other than the neighbour list can hold; lower options.skin."),
}
