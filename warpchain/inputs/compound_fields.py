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
        raise ValueError("a profile has 2 points at least; give more, such as [[0, 0], [1, 0], [1, -0.1], [2, -0.1]]")
    if len(points[-1]) > 2:
        raise ValueError(f"point {len(points) - 1} begins no line that could have e and μ; give x and y")
    for number, ((x, y, *_), (next_x, next_y, *_)) in enumerate(itertools.pairwise(points), start=1):
        if next_x < x:
            raise ValueError(f"point {number} lies behind the one before it; let x rise from point to point")
        if math.hypot(next_x - x, next_y - y) < SHORTEST:
            raise ValueError(f"point {number} is less than {SHORTEST} m from the one before it; leave one out")
        if next_x == x and number in (1, len(points) - 1):
            raise ValueError("the first and the last face go on without end; let x rise along them")
        if number > 1 and points[number - 2][0] == next_x:
            raise ValueError(f"point {number} is the third above one another; leave the middle one out")
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
        raise ValueError(f"{shown(word)} is no floor; give flat, or points such as [[0, 0], [1, 0.1]]")
    return word


FloorField = Annotated[
    Annotated[Literal["flat"], BeforeValidator(_known_word), Tag("(flat)")] | Annotated[Points, Tag("(points)")],
    Discriminator(lambda given: "(flat)" if isinstance(given, str) else "(points)"),
]
"""What the field `floor` of a scene may be."""


def _in_order(rows: SprocketMotion) -> SprocketMotion:
    if not rows:
        raise ValueError("no rows; give at least one, such as [[0.1, 0, -0.02, 0]], or null")
    for number, (before, after) in enumerate(itertools.pairwise([(0.0,), *rows])):
        if not after[0] > before[0]:
            raise ValueError(f"row {number}: {after[0]:g} s is not after {before[0]:g} s; let times rise from above 0")
    return rows


_Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Rows = Annotated[
    tuple[Annotated[tuple[_Number, _Number, _Number, _Number], Strict(False)], ...],
    Strict(False),
    Field(max_length=16),
    AfterValidator(_in_order),
]
"""A motion: rows [time, x, y, frequency]."""
