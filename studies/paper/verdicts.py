"""Rules by which numbers become verdicts."""

from enum import StrEnum
from typing import Final

FEW: Final = 0.1
"""Share of comparisons that may contradict a claim: a test at 95 % errs in one of twenty."""
MOST: Final = 0.5
"""Share of comparisons that must show what a claim says."""

UNSEEN: Final = 0.05
"""Greatest relative effect that "no dependence" may mean: means of the paper's 12 walks, of which each scatters by 5 to
10 %, differ by that much by chance."""
LITTLE: Final = 0.1
"""Greatest relative effect that "little effect" may mean."""


class Verdict(StrEnum):
    """What becomes of a claim."""

    AGREES = "agrees"
    PART = "agrees in part"
    DIFFERS = "differs"
    OPEN = "cannot be compared"


def direction(with_claim: int, against: int, comparisons: int) -> Verdict:
    """A claim that something rises, or falls, from the significant comparisons with it and against it, and all."""
    if not comparisons:
        return Verdict.OPEN
    if with_claim >= MOST * comparisons and against <= FEW * comparisons:
        return Verdict.AGREES
    in_part = with_claim > FEW * comparisons and with_claim >= against
    return Verdict.PART if in_part else Verdict.DIFFERS


def smallness(exceeding: int, comparisons: int) -> Verdict:
    """A claim that an effect is small; `exceeding` comparisons are greater than its bound with their whole interval."""
    return share(comparisons - exceeding, comparisons)


def share(fulfilled: int, cases: int) -> Verdict:
    """A claim about every case: agrees if nearly all fulfil it, in part if at least half do."""
    if not cases:
        return Verdict.OPEN
    if fulfilled >= (1 - FEW) * cases:
        return Verdict.AGREES
    return Verdict.PART if fulfilled >= MOST * cases else Verdict.DIFFERS


def together(verdicts: list[Verdict]) -> Verdict:
    """Verdict on a claim of several parts: theirs if they are the same, else in part."""
    kinds = set(verdicts) - {Verdict.OPEN}
    if not kinds:
        return Verdict.OPEN
    return kinds.pop() if len(kinds) == 1 else Verdict.PART
