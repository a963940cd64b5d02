"""Strategies of hypothesis for hostile inputs: what `tests.support.fuzzed_process` plays, kind by kind.

Most values of an input are plausible, so that many inputs get past the first check.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

from tests.support.damages import Steps, damaged
from warpchain.inputs.distributions import DRAWABLE
from warpchain.inputs.sections import NAME_OF_SYMBOL, SECTION_OF, SECTIONS
from warpchain.inputs.value_list import list_values
from warpchain.sweeps.designs import SAMPLERS

Inputs = st.SearchStrategy[Any]


@dataclass(frozen=True)
class Text:
    """A value that is written as it stands."""

    text: str


# Values

CHARACTERS = st.characters(codec="utf-8")
ANY_TEXT = st.text(
    st.one_of(CHARACTERS, st.sampled_from("\x1b\x07\u202e\u2028\ufeff'\"\\{}[]&*!%:#-\n\t")), max_size=30
)
NUMBERS = st.one_of(
    st.integers(-5, 200),
    st.floats(width=64).filter(lambda number: number == number and abs(number) < 1e300),
    st.sampled_from([0.1, 1e-9, 1e9, 2**31, 2**53 + 1, 2**63, 2**64, 10**30, -(2**63), 5e-324, -0.0, 1.7e308]),
)
YAML_TEXTS = (
    "", "~", "null", "yes", "no", "on", "060", "0x10", "0o17", "1:30", "1_000", "1e3", "1e400",
    "-1e400", ".inf", ".nan",     "2020-01-01", "15 Hz", "'15'", "!!int ''", "!!float ''",
    "!!int '7'", "!!float 3", "!!bool yes", "!!bool ''",
    "!!timestamp x",
    "!!binary aGFsbG8=", "!!set {a}", "!!omap [a: 1]", "!!python/object/apply:os.system [true]",
    "!!str", "!!null x", "!x y", "&a [*a]", "&a {b: *a}", "*a", "&a 1", "<<: {a: 1}", "{<<: [1]}", "? {a: 1}",
    "[" * 30 + "]" * 30, "9" * 500, "9" * 5000, "'" + "x" * 3000 + "'", '"\\ud800"', '"\\x1b[2J"', '"\\Uffffffff"',
    '"\\0"', "%YAML 9.9", "--- a\n--- b", "|\n x", ">-\n", "@", "`", "\t", "{a: 1, a: 2}", "[a, b", "{", "'", "# x",
    "[&a [x, x, x, x], &b [*a, *a, *a, *a], &c [*b, *b, *b, *b], &d [*c, *c, *c, *c], [*d, *d, *d, *d]]",
    "{from: 10, to: 1e9, step: 1}", "{from: 0, to: 1, step: 1e-300}", "{from: 30, to: 60, count: 1e9}",
    "{from: 30, to: 40, count: 99999999999}", "{from: 0.1, to: 0.9, count: 10000}", "{from: .nan, to: 1, step: 1}",
)  # fmt: skip
PYTHON_TEXTS = (
    "None", "True", "...", "object()", "endless()", "1j", "float('nan')", "float('inf')", "-float('inf')", "b'60'",
    "bytearray(3)", "10**5000", "-10**5000", "range(10**30)", "range(30, 60, 10)", "range(0)", "{1, 2}", "{}", "()",
    "set()", "lambda: 60", "int", "iter([1])", "Path('a')", "'\\ud800'", "'a\\0b'", "'\\x1b[2J'", "'x' * 10**6",
    "[0] * 10**6", "[[]] * 1000", "{None: 1}", "{1: 2}", "{(1, 2): 3}", "{'a': {'b': {'c': [{}]}}}", "Exception('x')",
    "np.int8(60)", "np.uint64(2**63)", "np.float16(15)", "np.float32(0.1)", "np.longdouble('1e4000')", "np.bool_(True)",
    "np.float64('nan')", "np.str_('soft')", "np.bytes_(b'x')", "np.complex128(1)", "np.datetime64('2020')",
    "np.timedelta64(60)", "np.zeros(10**6)", "np.zeros((3, 0))", "np.zeros((2, 2))", "np.array(60)", "np.array([60])",
    "np.array([30, 32], np.uint8)", "np.linspace(5, 30, 4)", "np.array([object()])", "np.array([], object)",
    "np.ma.masked", "np.ma.array([1, 2], mask=[0, 1])", "np.zeros(2, 'i4,f8')", "np.array(['a', 'b'])", "np.nan",
    "np.matrix([[1]])", "np.arange(100000)", "np.random.default_rng(0)", "type('T', (int,), {})(60)",
    "memoryview(b'1')",
    "type('T', (float,), {'__float__': None})(1.5)", "type('T', (str,), {'__hash__': None})('soft')",
    "type('T', (dict,), {'items': None})(links=60)", "type('T', (list,), {'__len__': lambda s: -1})()",
    "type('T', (), {'__repr__': None})()", "type('T', (), {'__index__': lambda s: 60, '__int__': lambda s: 60})()",
    "{'from': 30, 'to': 60, 'step': 10}", "{'from': 0.0, 'to': 1e9, 'step': 1e-9}",
    "{'from': 30, 'to': 40, 'count': 1e30}",
)  # fmt: skip


def values(texts: tuple[str, ...]) -> Inputs:
    """Anything, some of it written as it stands."""
    leaves = st.one_of(st.sampled_from(texts).map(Text), NUMBERS, st.booleans(), ANY_TEXT)
    return st.one_of(
        leaves,
        st.sampled_from(texts).map(Text),
        st.recursive(
            leaves,
            lambda inner: st.one_of(
                st.lists(inner, max_size=4), st.dictionaries(st.one_of(NAMES, ANY_TEXT), inner, max_size=3)
            ),
            max_leaves=8,
        ),
    )


_ENTRIES = {entry.name: entry for entries in list_values("soft").values() for entry in entries}
NAMES = st.one_of(
    st.sampled_from(sorted(SECTION_OF)),
    st.sampled_from(sorted(NAME_OF_SYMBOL)),
    st.sampled_from(["", "n", "colour", "from", "all", "<<", "a.b", "__class__", "preset", "x" * 300]),
)
PRESETS = st.sampled_from([*["soft", "paper"] * 10, "Soft", "", "__class__"])


def plausible(name: str) -> Inputs:
    """Values that a field may have, and some just beyond."""
    if name == "links":
        return st.sampled_from([*[60, 40, 90, 62, 120] * 5, 30, 31, 4, 400, 401, 10**4, 0])
    if name == "frequency":
        return st.sampled_from([*[15, 5.0, 20, 12.5] * 4, 30, 0, -5, 1e3])
    entry = _ENTRIES.get(name)
    if entry is None:
        return NUMBERS
    if entry.choices:
        return st.sampled_from([*entry.choices * 6, "other"])
    if isinstance(entry.value, int | float) and not isinstance(entry.value, bool):
        return st.sampled_from([*[1, 1.0, 0.9, 1.1] * 6, 0.5, 3.0, -1.0, 0.0, 1e6]).map(
            lambda factor: entry.value * factor
        )
    return st.one_of(st.sampled_from([entry.value, 1.0, 0.1, 10]), NUMBERS)


def mostly(usual: Inputs, hostile: Inputs, times: int = 20) -> Inputs:
    """The one, and one time in so many the other."""
    return st.sampled_from(range(times)).flatmap(lambda chance: hostile if chance == 1 else usual)


def named_values(names: Inputs, hostile: Inputs, most: int = 3) -> Inputs:
    """Names with values that suit them, mostly."""

    def pairs(found: list[str]) -> Inputs:
        return st.fixed_dictionaries({name: mostly(plausible(name), hostile) for name in found})

    return st.lists(names, max_size=most, unique=True).flatmap(pairs)


def section_names(section: str) -> Inputs:
    """Fields of a section, mostly."""
    return mostly(st.sampled_from(sorted(SECTIONS[section].model_fields)), NAMES, 12)


def sections(hostile: Inputs) -> dict[str, Inputs]:
    """What may stand in the sections of a setup or a sweep."""
    return {section: mostly(named_values(section_names(section), hostile), hostile, 40) for section in SECTIONS}


def setups(hostile: Inputs) -> Inputs:
    """Content of a setup."""
    return st.fixed_dictionaries(
        {"preset": mostly(PRESETS, hostile, 40)}, optional={**sections(hostile), "colour": hostile}
    )


COUNTS = st.sampled_from(
    [*[1, 2, 3, 4, 8, 16, 5, 64] * 6, 0, -1, 100, 1000, 2**16, 2**24, 2**30, 2**31, 10**30, 2.0, True]
)


def grids(hostile: Inputs) -> Inputs:
    """Axes with their values."""
    names = mostly(st.sampled_from(["links", "frequency", "floor_friction", "tolerance", "preset", "start"]), NAMES, 8)

    def axes(found: list[str]) -> Inputs:
        return st.fixed_dictionaries(
            {
                name: mostly(
                    st.one_of(
                        st.lists(mostly(plausible(name), hostile, 40), min_size=1, max_size=3),
                        st.fixed_dictionaries(
                            {"from": plausible(name), "to": plausible(name)},
                            optional={"step": NUMBERS, "count": COUNTS},
                        ),
                    ),
                    hostile,
                    12,
                )
                for name in found
            }
        )

    return st.lists(names, max_size=3, unique=True).flatmap(axes)


def distributions(hostile: Inputs) -> Inputs:
    """What samples draw."""
    pair = st.lists(mostly(NUMBERS, hostile), min_size=2, max_size=2)
    small = st.sampled_from([[0.1, 0.3], [0.3, 0.1], [0.2, 0.2], [-1, 1]])
    form = st.one_of(
        st.sampled_from(["fixed", "table", "gauss"]),
        st.one_of(small, pair).map(lambda ends: {"uniform": ends}),
        st.fixed_dictionaries({"mean": NUMBERS, "sigma": NUMBERS}).map(lambda moments: {"gaussian": moments}),
        hostile,
    )
    return st.dictionaries(mostly(st.sampled_from(["all", *DRAWABLE]), NAMES), form, max_size=3)


def records(hostile: Inputs) -> Inputs:
    """What is kept of motions."""
    choice = st.one_of(
        st.booleans(),
        st.fixed_dictionaries(
            {},
            optional={
                "interval": mostly(st.sampled_from([0.001, 0.01, 1e-12, 0, 1e300, 1e3]), hostile),
                "samples": mostly(st.one_of(st.just("all"), st.lists(COUNTS, max_size=3)), hostile),
                "before": mostly(st.sampled_from([0.5, 0, -1, 1e4]), hostile),
            },
        ),
    )
    return st.fixed_dictionaries({}, optional={"series": choice, "frames": choice, "more": hostile})


def sweeps(hostile: Inputs) -> Inputs:
    """Content of a sweep."""
    block = {
        **{section: mostly(found, hostile, 40) for section, found in sections(hostile).items()},
        "distributions": mostly(distributions(hostile), hostile, 40),
        "sampler": mostly(st.sampled_from([*SAMPLERS, "dice"]), hostile, 40),
    }
    inner = st.fixed_dictionaries(
        {"name": mostly(st.sampled_from(["a", "b", "c-1", "d_2", "main"]), hostile, 40)},
        optional={**block, "samples": COUNTS, "preset": PRESETS, "grid": grids(hostile)},
    )
    top = {
        "version": mostly(st.just(1), hostile, 40),
        "name": mostly(st.sampled_from(["small", "Fläche <1>", "a/b"]), hostile, 40),
        "seed": mostly(st.sampled_from([0, 7, 2**100, 2**128, -1]), hostile, 40),
        "samples": mostly(COUNTS, hostile, 40),
        "preset": mostly(PRESETS, hostile, 40),
    }
    optional = {
        **block,
        "record": mostly(records(hostile), hostile, 40),
        "same_samples_along": mostly(st.lists(NAMES, max_size=2), hostile),
    }
    blocks = mostly(st.lists(inner, max_size=3), hostile, 40)
    return st.one_of(
        st.fixed_dictionaries({**top, "grid": mostly(grids(hostile), hostile, 40)}, optional=optional),
        st.fixed_dictionaries({**top, "blocks": blocks}, optional=optional),
    )


def in_yaml(value: object, is_top: bool = False) -> str:
    """A value as YAML, in one line but for the keys at the top."""
    if isinstance(value, Text):
        return value.text
    if isinstance(value, Mapping):
        pairs = [f"{key if key.isidentifier() else json.dumps(key)}: {in_yaml(item)}" for key, item in value.items()]
        return "\n".join(pairs) + "\n" if is_top else "{" + ", ".join(pairs) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(in_yaml, value)) + "]"
    return json.dumps(value, ensure_ascii=isinstance(value, str) and len(value) % 2 == 0)


def in_python(value: object) -> str:
    """A value as Python."""
    if isinstance(value, Text):
        return value.text
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {in_python(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(in_python, value)) + "]"
    return repr(value)


# Damage

PLACES = st.integers(0, 2**40)
WORDS = st.sampled_from(
    [
        "\0" * 8,
        "\xff" * 8,
        "\xff\xff\xff\x7f",
        "\0\0\0\0\0\0\0\x01",
        "TREE",
        "SNOD",
        "GCOL",
        "OHDR",
        "FRHP",
        "\x89HDF\r\n\x1a\n",
    ]
)
CHUNKS = st.one_of(WORDS, st.binary(max_size=40).map(lambda chunk: chunk.decode("latin-1")))
LENGTHS = st.one_of(st.integers(1, 64), st.integers(1, 2**18))
BYTE_STEPS: st.SearchStrategy[Steps] = st.lists(
    st.one_of(
        st.tuples(st.just("flip"), PLACES, st.integers(0, 7)),
        st.tuples(st.just("zero"), PLACES, st.sampled_from([1, 1, 1, 8, 600])),
        st.tuples(st.just("cut"), PLACES),
        st.tuples(st.just("insert"), PLACES, CHUNKS, st.sampled_from([1, 1, 1, 7, 512, 20_000])),
        st.tuples(st.just("overwrite"), PLACES, CHUNKS),
        st.tuples(st.just("splice"), PLACES, PLACES, LENGTHS),
        st.tuples(st.just("move"), PLACES, PLACES, LENGTHS),
    ),
    min_size=1,
    max_size=3,
)


def mangled(texts: Inputs) -> Inputs:
    """Bytes of texts, some of them damaged; as a text of one character for each byte."""

    def bytes_of(text: str, steps: Steps) -> str:
        return damaged(text.encode("utf-8", "surrogatepass"), steps).decode("latin-1")

    return st.builds(bytes_of, texts, mostly(st.just([]), BYTE_STEPS, 4))


def words(hostile: Inputs) -> Inputs:
    """Values of `--set`."""
    named = mostly(st.sampled_from(sorted(SECTION_OF)), NAMES, 8)
    pairs = named.flatmap(
        lambda name: st.tuples(
            st.sampled_from(["", "", f"{SECTION_OF.get(name, 'scene')}.", "options.", " "]),
            st.just(name),
            st.just("="),
            mostly(plausible(name), hostile, 4).map(in_yaml),
        )
    )
    return st.lists(st.one_of(pairs.map("".join), pairs.map("".join), ANY_TEXT), max_size=3)


def options(hostile: Inputs) -> Inputs:
    """Options of `warpchain walk`."""
    sets = words(hostile).map(lambda found: [part for word in found for part in ("--set", word)])
    one = st.sampled_from(["--links", "--frequency", "--start", "--preset", "--method", "--tol", "--seed", "--device"])
    name_of = {"--tol": "tolerance"}
    named = one.flatmap(
        lambda option: st.tuples(
            st.just(option),
            mostly(plausible(name_of.get(option, option[2:])), hostile, 4).map(
                lambda value: value if isinstance(value, str) else in_yaml(value)
            ),
        )
    )
    return st.builds(
        lambda pairs, more: [word for pair in pairs for word in pair] + more, st.lists(named, max_size=2), sets
    )


def steps_of(file: str, steps: Inputs) -> Inputs:
    """Damage to a file."""
    return st.fixed_dictionaries({"file": st.just(file), "steps": steps})


def python_calls() -> Inputs:
    """Calls of `walk` and `sweep`."""
    hostile = values(PYTHON_TEXTS)
    named = {"seed", "frame_interval", "record_before", "record_loads", "preset", "setup"}
    fields = sorted(name for name in (*SECTION_OF, *named) if name.isidentifier())

    def call(function: str) -> Callable[[Mapping[str, Any]], str]:
        return lambda given: f"{function}(**{in_python(given)})"

    walks = named_values(mostly(st.sampled_from(fields), NAMES.filter(bool), 12), hostile, 4).map(call("walk"))
    content = sweeps(hostile).map(lambda given: {key: given[key] for key in given if key not in ("version", "blocks")})
    return st.one_of(
        walks,
        content.map(lambda given: call("sweep")({**given, "out": "out"})),
        sweeps(hostile).map(lambda given: f"sweep({in_python(given)}, 'out')"),
        hostile.map(lambda given: f"sweep({in_python(given)}, out='out')"),
        hostile.map(lambda given: f"sweep(grid={{'links': [60]}}, device={in_python(given)}, out='out')"),
        hostile.map(lambda given: f"sweep(grid={{'links': [60]}}, workers={in_python(given)}, out='out')"),
        hostile.filter(lambda given: not isinstance(given, str)).map(
            lambda given: f"sweep(grid={{'links': [60]}}, progress={in_python(given)}, out='out')"
        ),
    )


_YAML = values(YAML_TEXTS)
_ANY_YAML = _YAML.map(in_yaml)
INPUTS: dict[str, tuple[str, Inputs]] = {
    "YAML of setups": (
        "setup",
        st.fixed_dictionaries(
            {
                "yaml": mangled(mostly(setups(_YAML).map(lambda given: in_yaml(given, True)), _ANY_YAML, 10)),
                "words": mostly(st.just([]), options(_YAML), 3),
            }
        ),
    ),
    "options of walk": ("setup", st.fixed_dictionaries({"yaml": st.none(), "words": options(_YAML)})),
    "YAML of sweeps": (
        "sweep",
        st.fixed_dictionaries(
            {
                "yaml": mangled(mostly(sweeps(_YAML).map(lambda given: in_yaml(given, True)), _ANY_YAML, 10)),
                "words": mostly(st.just([]), st.sampled_from([["--device", "cpu"], ["--workers", "3"]]), 6),
            }
        ),
    ),
    "Python": ("python", python_calls()),
    **{
        f"bytes of {file}": ("damage", steps_of(file, BYTE_STEPS))
        for file in ("shard", "walk.h5", "merged", "sweep.json", "sweep.yaml", "log.txt")
    },
    "shards run again": ("run again", steps_of("shard", BYTE_STEPS)),
}
"""Each kind of input: what plays it, and the strategy."""
