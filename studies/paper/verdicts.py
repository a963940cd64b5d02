"""Rules by which numbers become verdicts."""

from dataclasses import dataclass
from enum import StrEnum


@dataclass
class Bounds:
    """What the rules allow."""

    few: float = 0.1  # Share of comparisons that may contradict a claim: a test at 95 % errs in one of twenty
    most: float = 0.5  # Share of comparisons that must show what a claim says
    unseen: float = 0.05
    """Greatest relative effect that "no dependence" may mean: means of the paper's 12 walks, of which each scatters by
    5 to 10 %, differ by that much by chance."""
    little: float = 0.1  # Greatest relative effect that "little effect" may mean
    moderate: float = 0.2  # Greatest standard deviation of a walk over its mean that "moderately" may mean


BOUNDS = Bounds()  # Those that hold now; the page tries others


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
    if with_claim >= BOUNDS.most * comparisons and against <= BOUNDS.few * comparisons:
        return Verdict.AGREES
    in_part = with_claim > BOUNDS.few * comparisons and with_claim >= against
    return Verdict.PART if in_part else Verdict.DIFFERS


def share(fulfilled: int, cases: int) -> Verdict:
    """A claim about every case: agrees if nearly all fulfil it, in part if at least half do."""
    if not cases:
        return Verdict.OPEN
    if fulfilled >= (1 - BOUNDS.few) * cases:
        return Verdict.AGREES
    return Verdict.PART if fulfilled >= BOUNDS.most * cases else Verdict.DIFFERS


def together(*verdicts: Verdict) -> Verdict:
    """Verdict on a claim of several parts: theirs if they are the same, else in part."""
    kinds = {*verdicts} - {Verdict.OPEN} or {Verdict.OPEN}
    return kinds.pop() if len(kinds) == 1 else Verdict.PART
