"""What a sweep file says, checked and completed, before any walk is planned.

`read_sweep` turns the content of a YAML file into `Block`s: every value converted by its model, every range written
out, every distribution resolved. An error is one line that begins with the path of the offending value, such as
`sweep.blocks[0].grid.frequency[3]`.
"""

import math
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from typing import Any, Final

from pydantic import ValidationError

from warpchain.inputs.distributions import DRAWABLE, LARGEST_SEED, TABLE, Distribution, Gaussian, Uniform
from warpchain.inputs.methods import METHODS_BY_NEED
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.sections import NAME_OF_SYMBOL, SECTION_OF, SECTIONS, by_name
from warpchain.inputs.symbols import full_name
from warpchain.inputs.validation import (
    LONGEST_NAME,
    Bounds,
    InputError,
    checked_positive,
    checked_whole,
    field_bounds,
    path_of,
    plain,
    shown,
    suggestion,
    validated,
)
from warpchain.inputs.yaml_files import read_yaml
from warpchain.sweeps.block import Block, Value
from warpchain.sweeps.designs import SAMPLERS, check_design
from warpchain.sweeps.recording import FRAME_INTERVAL, SERIES_INTERVAL, Choice, Recording
from warpchain.sweeps.shipped import sweep_path
from warpchain.sweeps.sizes import AXIS_LIMIT, check_count, check_declared
from warpchain.walks.motion import LONGEST_INTERVAL

VERSION: Final = 1
"""Version of the file format."""

_BLOCK_KEYS: Final = ("name", "preset", "samples", "sampler", *SECTIONS, "distributions", "grid")
_TOP_KEYS: Final = ("version", "seed", "blocks", "same_samples_along", "record", *_BLOCK_KEYS)


def read_sweep(
    source: str | os.PathLike[str] | Mapping[str, object],
) -> tuple[str, int, tuple[str, ...], tuple[Block, ...], Recording]:
    """Read a sweep file, or one that comes with the package by its bare name, or take its content as a mapping.

    Returns:
        Name, seed, axes of equal samples, blocks and recording: the fields of `warpchain.sweeps.plan.Sweep`.

    Raises:
        InputError: the file cannot be read, or something in it is refused.
    """
    content = plain(source, "sweep") if isinstance(source, Mapping) else read_yaml(sweep_path(source))
    if not isinstance(content, Mapping):
        raise InputError(f"{source}: no mapping at the top; give the keys {', '.join(_TOP_KEYS)}")
    top = _keys(content, "sweep", _TOP_KEYS)
    version = _needed(top, "version", "sweep", f"give {VERSION}")
    if type(version) is not int or version != VERSION:
        raise InputError(f"sweep.version: {shown(version)} is not supported; give {VERSION}")
    recording = _recording(top.get("record"))
    name = _text(_needed(top, "name", "sweep", "give the sweep a name"), "sweep.name")
    seed = checked_whole(_needed(top, "seed", "sweep", "give a whole number"), "sweep.seed", 0, LARGEST_SEED)
    check_declared(top)
    blocks = tuple(_blocks(top))
    same = _same_samples_along(top.get("same_samples_along"), blocks)
    return name, seed, same, tuple(_numbered(blocks, same)), recording


def _recording(content: object) -> Recording:
    """What is kept of the motion of walks."""
    given = _keys(content, "sweep.record", ("series", "frames"))
    series = _choice(given.get("series", False), "sweep.record.series", SERIES_INTERVAL)
    frames = _choice(given.get("frames", False), "sweep.record.frames", FRAME_INTERVAL, ("before",))
    if frames is not None and (series is None or not series.covers(frames)):
        raise InputError(
            "sweep.record.frames: kept of samples without series; give them in sweep.record.series as well"
        )
    return Recording(series, frames)


def _choice(content: object, path: str, interval: float, more: tuple[str, ...] = ()) -> Choice | None:
    """The samples that something is kept of, and how often; None: not at all. `more` are further keys."""
    if content is False:
        return None
    if not (content is True or isinstance(content, Mapping)):
        raise InputError(f"{path}: {shown(content)}; give true, false or {{interval: {interval}, samples: [0, 1]}}")
    keys = {} if content is True else _keys(content, path, ("interval", "samples", *more))
    chosen = keys.get("samples", "all")
    samples = None
    if not isinstance(chosen, str) or chosen != "all":
        numbers = _sequence(chosen, f"{path}.samples", "give all, or a list such as [0, 1]")
        samples = tuple(checked_whole(item, f"{path}.samples[{place}]", 0, 2**30) for place, item in enumerate(numbers))
        if len(set(samples)) < len(samples):
            raise InputError(f"{path}.samples: a number is given twice; leave one out")
        samples = tuple(sorted(samples))
    times = {"before": 0.0, "interval": interval}
    for key in times.keys() & keys.keys():
        times[key] = float(checked_positive(keys[key], f"{path}.{key}"))
        if times[key] > LONGEST_INTERVAL:
            raise InputError(f"{path}.{key}: {shown(keys[key])} s is too long; give at most {LONGEST_INTERVAL} s")
    return Choice(times["interval"], samples, times["before"])


def _blocks(top: Mapping[str, Any]) -> Iterator[Block]:
    """The blocks of a file; a file without the key `blocks` is itself one."""
    outer = _level(top, "sweep")
    if "blocks" not in top:
        yield _block("main", "sweep", {}, outer)
        return
    if "grid" in top:
        raise InputError("sweep.grid: given together with blocks; move it into a block")
    names: set[str] = set()
    for number, content in enumerate(_sequence(top["blocks"], "sweep.blocks", "give a list of blocks")):
        path = f"sweep.blocks[{number}]"
        keys = _keys(content, path, _BLOCK_KEYS)
        name = _text(_needed(keys, "name", path, "give the block a name"), f"{path}.name")
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", name):
            raise InputError(
                f"{path}.name: {shown(name)} is no plain name; give letters, digits, - and _, "
                "beginning with a letter or digit"
            )
        if name in names:
            raise InputError(f"{path}.name: {shown(name)} is given twice; give another name")
        names.add(name)
        yield _block(name, path, outer, _level(keys, path))


def _level(keys: Mapping[str, Any], path: str) -> dict[str, Any]:
    """The keys of one level, the top or a block, with the values of its sections and distributions checked one by one.

    Behind each name of a distribution stand the path where it was given, and a distribution, `table` or `fixed`.
    """
    level = dict(keys)
    for section, model in SECTIONS.items():
        where = f"{path}.{section}"
        values = _named(keys.get(section), where, tuple(model.model_fields))
        level[section] = {name: _checked(name, value, place) for name, (place, value) in values.items()}
    given = _named(keys.get("distributions"), f"{path}.distributions", ("all", *DRAWABLE), elsewhere=False)
    level["distributions"] = {
        name: (place, _distribution(name, value, place)) for name, (place, value) in given.items()
    }
    return level


def _block(name: str, path: str, outer: Mapping[str, Any], inner: Mapping[str, Any]) -> Block:
    """A block: its own keys and values, and those of the top level that it does not give."""
    merged = {key: {**outer.get(key, {}), **inner[key]} for key in (*SECTIONS, "distributions")}
    keys = {**outer, **inner}
    axes = _axes(inner, path)
    sections = {
        section: {key: value for key, value in merged[section].items() if key not in axes} for section in SECTIONS
    }
    chosen = None
    if "preset" not in axes:
        chosen = _needed(keys, "preset", path, "name the parameters to start from, such as preset: paper")
        chosen = str(_checked("preset", chosen, f"{path}.preset"))
    sampler = keys.get("sampler", "random")
    if not isinstance(sampler, str) or sampler not in SAMPLERS:
        raise InputError(f"{path}.sampler: {shown(sampler)} is unknown; {suggestion(sampler, SAMPLERS)}")
    samples = _needed(keys, "samples", path, "give the number of samples per cell")
    samples = checked_whole(samples, f"{path}.samples", 1, 2**30)
    drawn = _drawn(merged["distributions"], sections, axes)
    check_design(sampler, samples, len(drawn), path)
    return Block(path, name, chosen, sections, axes, drawn, sampler, samples)


def _numbered(blocks: Iterable[Block], same_samples_along: Collection[str]) -> Iterator[Block]:
    """The blocks with their first walks and streams, numbered through all of them.

    Raises:
        InputError: there are too many cells or walks.
    """
    first = first_stream = cells = 0
    for block in blocks:
        yield replace(block, first=first, first_stream=first_stream)
        cells += math.prod(block.shape[:-1])
        first += block.walk_count
        check_count(cells, first, block.path)
        first_stream += math.prod(len(values) for name, values in block.axes.items() if name not in same_samples_along)


def _checked(name: str, value: object, path: str) -> Value:
    """One value, checked by itself and converted as its model does.

    Args:
        name: `preset`, or a field of one of the `SECTIONS`.
        value: the value.
        path: where it was given, for errors.

    Raises:
        InputError: the field refuses the value, whatever the others are.
    """
    try:
        if name == "preset":
            preset(value)  # type: ignore[arg-type]
            return str(value)
        model = SECTIONS[SECTION_OF[name]]
        values = {**(preset("paper").model_dump() if model is Parameters else {}), name: value}
        try:
            result: Value = getattr(model.model_validate(values), name)
            return str(value) if name == "method" and value in METHODS_BY_NEED else result
        except ValidationError as error:
            if any(problem["loc"] for problem in error.errors()):
                validated(model, values, "")
        # Refused only beside the defaults of other fields: the check of the cells decides.
        result = float(value) if model.model_fields[name].annotation is float else value  # type: ignore
        return result
    except InputError as error:
        raise InputError(path + str(error).removeprefix(".").removeprefix(name)) from None


def _number(name: str, value: object, path: str) -> float:
    """The same for a field that can be drawn, which is a number and never null."""
    number = _checked(name, value, path)
    assert number is not None
    return float(number)


def _axes(level: Mapping[str, Any], level_path: str) -> dict[str, tuple[Value, ...]]:
    """The axes of a level's grid; an axis whose name also has a fixed value there is refused."""
    axes = {}
    for name, (path, content) in _named(level.get("grid"), f"{level_path}.grid", ("preset", *SECTION_OF)).items():
        home = SECTION_OF.get(name, name)
        if name in (level if home == "preset" else level[home]):
            raise InputError(f"{path}: also given in {level_path}.{home}; leave one out")
        if isinstance(content, Mapping):
            content = _range(name, content, path)
        values: dict[Value, None] = {}  # in order, and quick to look up
        remedy = f"give a list such as [{shown(content)}], or {{from:, to:, step:}}"
        for number, item in enumerate(_sequence(content, path, remedy)):
            value = _checked(name, item, f"{path}[{number}]")
            if value in values:
                raise InputError(f"{path}[{number}]: {shown(value)} is given twice; leave one out")
            values[value] = None
        axes[name] = tuple(values)
    return axes


def _range(name: str, content: Mapping[object, object], path: str) -> list[Value]:
    """The values of an axis given as {from, to, step} or {from, to, count}, both ends included.

    They are computed in decimals, so that three steps of 0.1 from 0 lead to 0.3 and to no other number.
    """
    kind = None if name == "preset" else SECTIONS[SECTION_OF[name]].model_fields[name].annotation
    if kind not in (int, float):
        raise InputError(f"{path}: {name} is no number and has no range; give a list of values")
    keys = _keys(content, path, ("from", "to", "step", "count"))
    ends = [
        _checked(name, _needed(keys, key, path, f"give the {which} value"), f"{path}.{key}")
        for key, which in (("from", "first"), ("to", "last"))
    ]
    first, last = (Decimal(str(end)) for end in ends)
    if first >= last:
        raise InputError(f"{path}.to: {ends[1]} is not greater than from: {ends[0]}; give a greater value")
    if ("step" in keys) == ("count" in keys):
        raise InputError(f"{path}: a range needs either step or count; give one of them")
    if "count" in keys:
        intervals = checked_whole(keys["count"], f"{path}.count", 2, AXIS_LIMIT) - 1
        step = (last - first) / intervals
    else:
        step = Decimal(str(checked_positive(keys["step"], f"{path}.step")))
        if (last - first) / step >= AXIS_LIMIT:
            raise InputError(f"{path}.step: gives more than {AXIS_LIMIT} values; give a larger step")
        intervals = int((last - first) / step)
        below = first + intervals * step
        if below != last:
            raise InputError(
                f"{path}.to: steps of {step} from {first} miss {last}; give {below} or {below + step}, "
                "or a count instead of the step"
            )
    values = [first + number * step for number in range(intervals)] + [last]
    if kind is float:
        return [float(value) for value in values]
    if any(value != int(value) for value in values):
        key = "count" if "count" in keys else "step"
        raise InputError(f"{path}.{key}: {shown(keys[key])} gives values that are not whole; give another")
    return [int(value) for value in values]


def _distribution(name: str, content: object, path: str) -> Distribution | str:
    """What a level says about one quantity, or about `all`."""
    if name == "all":
        if not isinstance(content, str) or content not in ("table", "fixed"):
            raise InputError(f"{path}: {shown(content)} is unknown; give table or fixed")
        return content
    if isinstance(content, str) and content == "fixed":
        return "fixed"
    if isinstance(content, str) and content == "table":
        if name not in TABLE:
            raise InputError(f"{path}: there is no uncertainty of {name} in Table 1; give uniform or gaussian")
        return "table"
    forms = _keys(content, path, ("uniform", "gaussian")) if isinstance(content, Mapping) else {}
    if len(forms) != 1:
        raise InputError(
            f"{path}: {shown(content)} is no distribution; "
            "give table, fixed, {uniform: [lower, upper]} or {gaussian: {mean: …, sigma: …}}"
        )
    bounds = field_bounds(SECTIONS[SECTION_OF[name]].model_fields[name])
    if "uniform" in forms:
        path += ".uniform"
        ends = forms["uniform"]
        if not isinstance(ends, Sequence) or isinstance(ends, str) or len(ends) != 2:
            raise InputError(f"{path}: {shown(ends)} is no interval; give [lower, upper]")
        lower = _end(name, ends[0], f"{path}[0]", bounds, inwards=math.inf)
        upper = _end(name, ends[1], f"{path}[1]", bounds, inwards=-math.inf)
        if lower >= upper:
            raise InputError(f"{path}[1]: {upper} is not greater than {lower}; give a greater value")
        return Uniform(lower, upper, bounds)
    path += ".gaussian"
    gaussian = _keys(forms["gaussian"], path, ("mean", "sigma"))
    mean = _number(name, gaussian["mean"], f"{path}.mean") if "mean" in gaussian else None
    sigma = checked_positive(_needed(gaussian, "sigma", path, "give the standard deviation"), f"{path}.sigma")
    return Gaussian(mean, sigma, bounds)


def _end(name: str, value: object, path: str, bounds: Bounds, inwards: float) -> float:
    """An end of an interval; it may be a bound that is itself not physical, as 1 is for a phase."""
    try:
        return _number(name, value, path)
    except InputError:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise
        if not bounds.admit(math.nextafter(value, inwards)):
            raise
        return float(value)


def _drawn(
    given: Mapping[str, tuple[str, Distribution | str]],
    sections: Mapping[str, Mapping[str, Value]],
    axes: Mapping[str, tuple[Value, ...]],
) -> dict[str, Distribution]:
    """What a block draws, in the order of drawing.

    Given values are exact, on an axis or not. A distribution of the quantity's own name is drawn about each of them,
    and refused if it has a mean or ends of its own.
    """
    _, default = given.get("all", ("", "table"))
    drawn: dict[str, Distribution] = {}
    for name in DRAWABLE:
        home = "grid" if name in axes else SECTION_OF[name] if name in sections[SECTION_OF[name]] else None
        path, choice = given.get(name, ("", None))
        if choice is None:
            if default == "table" and name in TABLE and home is None:
                drawn[name] = TABLE[name]
        elif choice != "fixed":
            distribution = TABLE[name] if isinstance(choice, str) else choice
            if home is not None and not (isinstance(distribution, Gaussian) and distribution.mean is None):
                raise InputError(f"{path}: {name} also has a value in {home}; leave one out, or give fixed")
            drawn[name] = distribution
    return drawn


def _same_samples_along(content: object, blocks: Sequence[Block]) -> tuple[str, ...]:
    """The axes along which the same samples are used, sorted."""
    if content is None:
        return ()
    path = "sweep.same_samples_along"
    known = sorted({name for block in blocks for name in block.axes})
    if not isinstance(content, Sequence) or isinstance(content, str):
        raise InputError(f"{path}: {shown(content)} is no list; give names of axes, such as [tolerance]")
    names: list[str] = []
    for number, written in enumerate(content):
        name = full_name(written, NAME_OF_SYMBOL)
        if not isinstance(name, str) or name not in known:
            remedy = suggestion(name, known) if known else "leave it out"
            raise InputError(f"{path}[{number}]: {shown(written)} is no axis of any block; {remedy}")
        if name in names:
            raise InputError(f"{path}[{number}]: {shown(written)} is given twice; leave one out")
        names.append(name)
    return tuple(sorted(names))


def _mapping(content: object, path: str) -> Mapping[Any, Any]:
    """A mapping; nothing at all is an empty one."""
    if content is None:
        return {}
    if not isinstance(content, Mapping):
        raise InputError(f"{path}: {shown(content)} is not a mapping; give keys with values")
    return content


def _named(content: object, path: str, known: Sequence[str], *, elsewhere: bool = True) -> dict[str, tuple[str, Any]]:
    """The values of a mapping by full names, each with the path where it was given, see `by_name`."""
    return by_name(_mapping(content, path), path, known, elsewhere=elsewhere)


def _keys(content: object, path: str, known: Sequence[str]) -> dict[str, Any]:
    """A mapping with known keys, without those that have nothing behind them."""
    given = _mapping(content, path)
    for key in given:
        if key not in known:
            raise InputError(f"{path_of(path, key)}: unknown key; {suggestion(key, known)}")
    return {key: value for key, value in given.items() if value is not None}


def _needed(keys: Mapping[str, Any], key: str, path: str, remedy: str) -> Any:
    if key not in keys:
        raise InputError(f"{path}.{key}: missing; {remedy}")
    return keys[key]


def _sequence(content: object, path: str, remedy: str) -> Sequence[object]:
    """A list with at least one item."""
    if not isinstance(content, Sequence) or isinstance(content, str):
        raise InputError(f"{path}: {shown(content)} is no list; {remedy}")
    if not content:
        raise InputError(f"{path}: empty; give one item or more")
    if len(content) > AXIS_LIMIT:
        raise InputError(f"{path}: {len(content)} items; give at most {AXIS_LIMIT}")
    return content


def _text(value: object, path: str) -> str:
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise InputError(f"{path}: {shown(value)} is no name; give a line of text")
    if len(value) > LONGEST_NAME:
        raise InputError(f"{path}: {len(value)} characters are no name; give at most {LONGEST_NAME}")
    return value
