"""Fields of a scene whose values are lists: its floor, and the motion of its sprocket after the release.

What a checked value means is for `warpchain.chain.floor` and `warpchain.chain.sprocket_motion`.
"""

import itertools
import math
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Strict, Tag

from warpchain.inputs.parameters import FRACTION, FRICTION
from warpchain.inputs.validation import shown

SprocketMotion = tuple[tuple[float, float, float, float], ...]

MOST_POINTS: Final = 256
"""Most points of a profile; each takes time where a chain is near it."""
SHORTEST: Final = 1e-5
"""Least length of a face [m], a thousandth of a link of Table 1."""
FARTHEST: Final = 1e4
"""Greatest coordinate of a point, where numbers still tell a thousandth of a nanometre [m]."""
LARGEST: Final = 1e4
"""Greatest size of a time, a place and a frequency."""


def _without_overhang(points: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    """The points of a profile, if they make a floor."""
    if len(points) < 2:
        raise ValueError("expected at least 2 points; use e.g. [[0, 0], [1, 0], [1, -0.1], [2, -0.1]]")
    if len(points[-1]) > 2:
        raise ValueError("the last point starts no segment, so it has no e and μ; use [x, y]")
    for number, ((x, y, *_), (next_x, next_y, *_)) in enumerate(itertools.pairwise(points), start=1):
        if next_x < x:
            raise ValueError(f"point {number} lies behind the point before it; let x increase from point to point")
        if math.hypot(next_x - x, next_y - y) < SHORTEST:
            raise ValueError(f"point {number} is less than {SHORTEST} m from the point before it; remove one")
        if next_x == x and number in (1, len(points) - 1):
            raise ValueError(
                "the first and last segments are infinite, so they cannot be vertical; let x increase along them"
            )
        if number > 1 and points[number - 2][0] == next_x:
            raise ValueError(f"point {number} is the third on one vertical line; remove the middle one")
    return points


_Coordinate = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]
_Restitution = Annotated[float, Field(**FRACTION)]
_Friction = Annotated[float, Field(**FRICTION)]
_Point = Annotated[
    Annotated[tuple[_Coordinate, _Coordinate], Strict(False), Tag("(place)")]
    | Annotated[tuple[_Coordinate, _Coordinate, _Restitution, _Friction], Strict(False), Tag("(law)")],
    Discriminator(lambda given: "(law)" if isinstance(given, list | tuple) and len(given) > 2 else "(place)"),
]
Points = Annotated[tuple[_Point, ...], Strict(False), Field(max_length=MOST_POINTS), AfterValidator(_without_overhang)]
"""A profile: points x, y [m], and e and μ of the line that begins there, if it has its own."""


def _known_word(word: str) -> str:
    if word != "flat":
        raise ValueError(f"expected flat or points, got {shown(word)}; use e.g. [[0, 0], [1, 0.1]]")
    return word


FloorField = Annotated[
    Annotated[Literal["flat"], BeforeValidator(_known_word), Tag("(flat)")] | Annotated[Points, Tag("(points)")],
    Discriminator(lambda given: "(flat)" if isinstance(given, str) else "(points)"),
]
"""What the field `floor` of a scene may be."""


def _in_order(rows: SprocketMotion) -> SprocketMotion:
    if not rows:
        raise ValueError("expected at least one row, e.g. [[0.1, 0, -0.02, 0]], got none; add one, or use null")
    for number, (before, after) in enumerate(itertools.pairwise([(0.0,), *rows])):
        if not after[0] > before[0]:
            raise ValueError(
                f"row {number}: expected a time after {before[0]:g} s, got {after[0]:g} s; let positive times increase"
            )
    return rows


_Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Rows = Annotated[
    tuple[Annotated[tuple[_Number, _Number, _Number, _Number], Strict(False)], ...],
    Strict(False),
    Field(max_length=16),
    AfterValidator(_in_order),
]
"""A motion: rows [time, x, y, frequency]."""
