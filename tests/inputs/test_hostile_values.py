"""Values that are huge, nested, foreign or not printable: taken, or refused in one short line at little cost."""

import datetime
import enum
import pickle
import random
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from warpchain.inputs.parameters import warn_of_units
from warpchain.inputs.setup import read_setup, resolve
from warpchain.inputs.validation import (
    DEEPEST,
    LONGEST_LINE,
    MOST_VALUES,
    InputError,
    InputWarning,
    one_line,
    plain,
    printable,
    shown,
    suggestion,
)
from warpchain.inputs.yaml_files import LARGEST_FILE, read_yaml
from warpchain.run.single_walk import setup_walk
from warpchain.sweeps.plan import load_sweep

MEMORY = 1e8
"""Most bytes that a refusal may take."""


SHAPELESS = (1, 2, 13, 15, 17, 23, 24)
"""Those of `HOSTILE` that are refused for what they are as a whole, before any name is looked at."""


class Mute:
    """An object that cannot be shown."""

    def __repr__(self) -> str:
        """Fails."""
        raise RuntimeError("no text")


class Liar(str):
    """A text that shows itself as no text."""

    def __repr__(self) -> str:
        """Fails."""
        raise RuntimeError("no text")

    __str__ = __repr__


class Silent:
    """What a container has, all of which fails."""

    def __len__(self) -> int:
        """Fails."""
        raise RuntimeError("no length")

    __iter__ = __getitem__ = keys = values = items = copy = __len__  # type: ignore[assignment]


class LyingList(Silent, list):  # type: ignore[type-arg, misc]
    """A list that cannot be asked."""


class LyingTuple(Silent, tuple):  # type: ignore[type-arg, misc]
    """A tuple that cannot be asked."""


class LyingDict(Silent, dict):  # type: ignore[type-arg, misc]
    """A mapping that cannot be asked."""


LEVELS = ("ab", "bc", "cd", "de", "ef", "fg")
"""Names of anchors, each with that of what it repeats before it."""


class Whole(enum.IntEnum):
    """Whole numbers with names."""

    SIXTY = 60


def endless() -> list[Any]:
    """A list that contains itself."""
    items: list[Any] = []
    items.append(items)
    return items


def nested(depth: int) -> list[Any]:
    """Lists inside of one another."""
    items: list[Any] = []
    for _ in range(depth):
        items = [items]
    return items


HOSTILE: list[Callable[[], Any]] = [
    Mute,
    endless,
    lambda: nested(100_000),
    lambda: 10**5000,
    lambda: -(10**5000),
    lambda: "\x1b[2J",
    lambda: "\ud800",
    lambda: "x" * 10**6,
    lambda: "1" * 10**5 + "!",
    lambda: "{field}",
    lambda: b"60",
    lambda: datetime.date(2020, 1, 1),
    lambda: np.datetime64("2020"),
    lambda: np.timedelta64(60),
    lambda: np.array(["2020"], dtype="M8[ns]"),
    lambda: np.zeros(10**7),
    lambda: np.array([Mute()], dtype=object),
    lambda: range(10**30),
    lambda: 1j,
    lambda: float("nan"),
    lambda: float("-inf"),
    lambda: np.longdouble("1e4000"),
    lambda: True,
    lambda: {Mute(): 1},
    lambda: {"a": [{"b": ["\x1b"] * 1000}] * 1000},
]


def refusal(call: Callable[[], object]) -> str:
    """The text with which a call is refused; the call must take little memory beside what it was given."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as caught:
            call()
        assert tracemalloc.get_traced_memory()[1] < MEMORY
    finally:
        tracemalloc.stop()
    text = str(caught.value)
    assert text.isprintable() and 0 < len(text) <= LONGEST_LINE
    return text


@pytest.mark.parametrize("number", range(len(HOSTILE)))
@pytest.mark.parametrize("name", ["links", "frequency", "start", "device", "method", "self_contact", "gravity"])
def test_a_hostile_value_is_refused_in_one_short_line(name: str, number: int) -> None:
    """Numbers, words and truth values alike, given by keyword; only a truth value may be true."""
    value = HOSTILE[number]()
    if name == "self_contact" and value is True:
        return
    assert name in refusal(lambda: setup_walk("soft", {name: value}, None)) or number in SHAPELESS


@pytest.mark.parametrize("number", range(len(HOSTILE)))
@pytest.mark.parametrize("key", ["name", "seed", "samples", "sampler", "preset", "scene", "grid", "distributions"])
def test_a_hostile_value_in_a_sweep_is_refused_in_one_short_line(key: str, number: int) -> None:
    """Every key of a sweep, given from Python; a brace is a fine name."""
    value = HOSTILE[number]()
    if key == "name" and isinstance(value, str) and value == "{field}":
        return
    content = {"version": 1, "name": "x", "seed": 1, "samples": 1, "preset": "soft", key: value}
    assert refusal(lambda: load_sweep(content)).startswith("sweep")


def test_a_derived_class_means_its_value() -> None:
    """Texts, numbers, lists and mappings of derived classes are taken for what they are, whatever they override."""
    given = {"links": Whole.SIXTY, "start": Liar("ellipse")}
    scene = resolve(Liar("soft"), scene=given, options={}, parameters={}).scene
    assert (scene.links, type(scene.links), scene.start, type(scene.start)) == (60, int, "ellipse", str)
    sweep = {"version": 1, "name": "x", "seed": 1, "samples": 1, "preset": "soft"}
    grid = LyingDict({"links": LyingList([40, 60]), "frequency": LyingTuple([15.0])})
    (block,) = load_sweep(LyingDict(sweep | {"grid": grid})).blocks
    assert block.axes == {"links": (40, 60), "frequency": (15.0,)}


def test_values_have_bounds_of_number_and_depth() -> None:
    """As many values and as deep as the limits say pass the door, one more does not."""
    assert plain([0] * (MOST_VALUES - 1)) == [0] * (MOST_VALUES - 1)
    assert "more than" in refusal(lambda: plain([0] * MOST_VALUES, "grid"))
    assert plain(nested(DEEPEST)) == nested(DEEPEST)
    assert "inside of one another" in refusal(lambda: plain(nested(DEEPEST + 1), "grid"))


def test_a_refusal_keeps_its_lines() -> None:
    """Several problems have a line each, also on the other side of a pickle, and no value adds one."""
    error = InputError("links: 3 is odd", "name: 'a\nb\u2028c\x1b' is no name")
    assert str(error).splitlines() == ["links: 3 is odd", "name: 'a b c\\x1b' is no name"]
    assert str(pickle.loads(pickle.dumps(error))) == str(error)
    assert one_line("path: " + "x" * 10**6) == f"path: {'x' * 191}..."
    path, problem = "/x" * 300 + "/file.yaml", "no mapping at the top; give keys"
    assert one_line(f"{path}: {problem}", "error: ").endswith(f"{path[-80:]}: {problem}")


def test_texts_of_any_characters_are_printable_and_short() -> None:
    """Random texts, printed, shown and looked for among known names (seed 7)."""
    rng = random.Random(7)
    for _ in range(2000):
        text = "".join(chr(rng.choice((rng.randrange(256), rng.randrange(0x110000)))) for _ in range(rng.randrange(90)))
        assert printable(text).isprintable()
        assert printable(text) == text or not text.isprintable()
        assert shown([text, {text: text}]).isprintable() and len(shown({text: [text]})) <= 60
        assert len(suggestion(text, ("links", "frequency"))) <= 60


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("!!int ''", "line 1: '' is no number"),
        ("!!float ''", "line 1: '' is no number"),
        ("!!bool ''", "line 1: '' is no truth value"),
        ("!!timestamp x", "line 1: could not determine a constructor"),
        ("!!binary aGFsbG8=", "line 1: could not determine a constructor"),
        ("!!set {a}", "line 1: could not determine a constructor"),
        ("1" * 5000, "line 1: '1111"),
        ('"\\Uffffffff"', "an escape or a version stands for no"),
        ("%YAML " + "9" * 5000 + ".1\n---\na", "an escape or a version stands for no"),
        ("[" * 100_000, "line 1: more than 20 lists"),
        ("- " * 100_000, "line 1: more than 20 lists"),
        ("&a [*a]", "line 1: an alias stands for a value that contains it"),
        ("x: &a {y: [*a]}", "line 1: an alias stands for a value that contains it"),
        ("[&a [x,x,x,x,x,x,x,x,x]" + "".join(f",&{b} [{f'*{a},' * 9}]" for a, b in LEVELS) + "]", "values, with"),
        ("#" * (LARGEST_FILE + 1), "more than 1000000 bytes"),
    ],
)  # fmt: skip
def test_hostile_yaml_is_refused_in_one_short_line(tmp_path: Path, text: str, problem: str) -> None:
    """Tags, bombs, depths and sizes, before anything is made of them."""
    path = tmp_path / "x"
    path.write_text(text, encoding="utf-8")
    assert problem in refusal(lambda: read_yaml(path))


def test_the_number_of_values_in_a_file_is_bounded(tmp_path: Path) -> None:
    """Few bytes may hold many values, whose number is found while they are read."""
    path = tmp_path / "x"
    path.write_text("[" + "a," * MOST_VALUES + "]")
    with pytest.raises(InputError, match="line 1: more than 100000 values"):
        read_yaml(path)


def test_aliases_dates_and_tags_mean_what_they_say(tmp_path: Path) -> None:
    """An alias repeats a value, a date is a text, and a tag of a plain number or truth value is taken."""
    path = tmp_path / "x"
    path.write_text("{a: &b [1, 2], c: *b, <<: {d: !!float 3}, e: 2020-01-01, f: !!bool yes, g: !!int '7'}")
    assert read_yaml(path) == {"a": [1, 2], "c": [1, 2], "d": 3.0, "e": "2020-01-01", "f": True, "g": 7}


@pytest.mark.parametrize("path", ["a\0b", "\ud800", "/dev/zero", "x" * 300, "x/" * 3000])
def test_what_is_no_regular_file_is_refused(path: str) -> None:
    """NULs, halves of characters, devices and names that no file can have, of sweeps and of walks."""
    for read in (read_setup, load_sweep):
        refusal(lambda read=read: read(path))


def test_a_folder_that_no_file_system_has_is_refused() -> None:
    """A NUL in the folder of the results, and what is no path at all."""
    for out in ("a\0b", "\ud800", 5, b"x"):
        with pytest.raises(InputError, match=r"^out: .* is no path"):
            warpchain.sweep(grid={"links": [40]}, out=out)  # type: ignore[arg-type]


def test_many_problems_are_counted() -> None:
    """Of thousands of wrong values the first ones are described."""
    with pytest.raises(InputError) as caught:
        warpchain.sweep(grid={"frequency": [-1 - i for i in range(1000)]}, out="x")
    lines = str(caught.value).splitlines()
    assert len(lines) == 21 and lines[-1] == "980 more problems; correct these first"


def test_a_value_next_to_zero_looks_like_one_in_another_unit() -> None:
    """The least number of a computer is warned of like any other that is far off."""
    gravity = setup_walk("soft", {"gravity": 5e-324}, None).parameters.gravity
    with pytest.warns(InputWarning, match="did you mean"):
        warn_of_units([("parameters.gravity", "gravity", gravity)])
