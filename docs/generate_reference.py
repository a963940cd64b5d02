"""Writes the pages of docs/reference/ from the code: parameters, scene, options, sweep file, results, commands.

Run ``python docs/generate_reference.py`` after a change of any of these; a test compares the pages with the code.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, Literal, get_args, get_origin

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from warpchain.cli.main import app
from warpchain.inputs.distributions import TABLE, Uniform
from warpchain.inputs.methods import METHODS, METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS, Parameters
from warpchain.inputs.scene import COMPOUND, Scene
from warpchain.inputs.validation import FIELDS, field_limits, field_unit, spelled
from warpchain.status import Status
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.recording import FRAME_INTERVAL, SERIES_INTERVAL, Frames
from warpchain.sweeps.sweep_file import BlockKeys, BlockOfFile, SweepFile
from warpchain.walks.rows import COLUMNS
from warpchain.walks.walk_result import STORED

FOLDER: Final = Path(__file__).parent / "reference"
NOTE: Final = "<!-- Written by docs/generate_reference.py; change the code, then run that script. -->\n"

JSON: Final = "--json"
"""An option of most commands, which is explained once."""

SAMPLER_MEANINGS: Final = {
    "random": "independent samples",
    "sobol": "scrambled Sobol' sequence; a power of two of samples",
    "latin_hypercube": "latin hypercube",
    "saltelli": "points for Sobol indices: each sample of d drawn quantities takes d + 2 walks; a power of two of "
    "samples",
}


def table(heads: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A Markdown table."""
    heads = list(heads)
    lines = [heads, ["---"] * len(heads), *([str(cell).replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def listing(rows: Iterable[tuple[str, object]]) -> str:
    """A Markdown list of names and their meanings."""
    return "\n".join(f"- {name}: {meaning}" for name, meaning in rows) + "\n"


def shown(value: object) -> str:
    """A value as YAML has it."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return f"{value:g}" if isinstance(value, float) else str(value)


def in_unit(text: str, unit: str) -> str:
    """A text with the unit behind it, unless that is of pure numbers."""
    return text if unit == "1" else f"{text} {unit}"


def values_of(field: FieldInfo) -> str:
    """What a field may be: its other names, or the limits of its number with their unit; nothing for any text."""
    kinds = [field.annotation, *get_args(field.annotation)]
    names = next((get_args(kind) for kind in kinds if get_origin(kind) is Literal), (True, False) * (bool in kinds))
    if names:
        others = ", ".join(f"`{shown(name)}`" for name in names if name != field.default)
        return f", or {others}" if others else ""
    if str in kinds:
        return ""
    unit, limits = field_unit(field), field_limits(field)
    if not limits:
        return in_unit(", or a list of numbers", unit if unit == "1" else f"in {unit}")
    return (", whole, " if int in kinds else ", ") + in_unit(bounds_of(limits), unit)


def bounds_of(limits: Mapping[str, float]) -> str:
    """Limits of a number as an interval."""
    lower = f"[{limits['ge']:g}" if "ge" in limits else f"({limits['gt']:g}"
    upper = f"{limits['le']:g}]" if "le" in limits else f"{limits['lt']:g})" if "lt" in limits else "∞)"
    return f"{lower}, {upper}"


def fields_of(model: type[BaseModel], other_meanings: Mapping[str, str] | None = None) -> str:
    """All fields of a model; `other_meanings` replaces descriptions."""
    meanings = {name: field.description for name, field in model.model_fields.items()} | dict(other_meanings or {})
    return listing(
        (f"`{name}: {shown(field.default)}`{values_of(field)}", meanings[name])
        for name, field in model.model_fields.items()
    )


def parameters_page() -> str:
    """Table 1, bounds and presets."""
    quantities = Parameters.quantities()
    tables = []
    for source in dict.fromkeys(row.source for row in quantities.values()):
        rows = []
        for name, row in quantities.items():
            if row.source != source:
                continue
            ascii_symbol = spelled(row.symbol)
            symbol = row.symbol if ascii_symbol == row.symbol else f"{row.symbol}, `{ascii_symbol}`"
            value = f"{row.value:g}" + (f" ± {row.sigma:g}" if row.sigma else "")
            bounds = bounds_of(field_limits(FIELDS[name]))
            rows.append((f"`{name}`", symbol, in_unit(value, row.unit), bounds, row.meaning))
        tables.append(f"## {source.capitalize()}\n\n" + table(("name", "symbol", "value", "bounds", "meaning"), rows))
    presets = []
    for preset, values in PRESETS.items():
        other = {name: value for name, value in values.model_dump().items() if value != quantities[name].value}
        presets.append((f"`{preset}`", ", ".join(f"`{name}: {value:g}`" for name, value in other.items()) or "Table 1"))
    return (
        "# Parameters\n\n"
        "The quantities of Table 1 of the paper, in SI units, by source; those *chosen here* are not in the paper. "
        "After ± stands the standard deviation of the Gaussian that samples draw from; a draw outside the bounds is "
        "drawn again. `circle_radius` is smaller than half of `link_length`. A symbol, also in ASCII, stands for its "
        "name: `mu_fc=0.3` for `floor_friction=0.3`.\n\n" + "\n".join(tables) + "\n## Presets\n\n" + listing(presets)
    )


def scene_page() -> str:
    """What happens in a walk."""
    return (
        "# Scene\n\nWhat happens in a walk, from hanging on the sprocket to rest: "
        "[the model](../model.md#the-scene) explains the phases, "
        "[the stationary loop](../../studies/stationary_loop/README.md) the hold. "
        "Each line has a field with its default, what it may be, and its meaning.\n\n" + fields_of(Scene)
    )


def options_page() -> str:
    """How a walk is computed."""
    words: dict[str, str] = {}
    for word, settings in METHODS_BY_NEED.items():
        alike = next((one for one in words if METHODS_BY_NEED[one].keys() == settings.keys()), None)
        known = METHODS_BY_NEED[alike] if alike else {}
        own = {name: value for name, value in settings.items() if name not in known or known[name] != value}
        text = ", ".join(f"`{name}: {shown(value)}`" for name, value in own.items())
        words[word] = text + (f"; all else as `{alike}`" if alike else "")
    integrators = ", ".join(f"`{name}`" for name in METHODS)
    return (
        "# Options\n\nHow a walk is computed; see [methods](../methods.md). A method in one word, such as the default, "
        "has defaults of its own. Each line has a field with its default, what it may be, and its meaning.\n\n"
        + fields_of(
            Options, {"method": f"a word, see below, or an [integrator](../methods.md#integrators): {integrators}"}
        )
        + "\n## Methods in one word\n\nSuch a word of `method` sets the defaults of these options. On a GPU `standard` "
        "means `explicit`. A `tolerance` that is given also replaces `soft_tolerance`.\n\n"
        + listing((f"`{word}`", text) for word, text in words.items())
    )


def sweep_file_page() -> str:
    """Keys, grids, distributions, samplers and recording of a sweep file."""
    even = {name: f"[{law.lower:g}, {law.upper:g}]" for name, law in TABLE.items() if isinstance(law, Uniform)}
    uniform = [f"`{name}` uniformly in {interval}" for name, interval in even.items()]
    gaussian = [f"`{name}`" for name in TABLE if name not in even]
    fields = sorted(SweepFile.model_fields.items(), key=lambda item: item[0] in BlockKeys.model_fields)
    keys = [(f"`{name}`", str(field.description)) for name, field in fields]
    frames = Frames.model_fields.items()
    kept = [(f"`{name}`", f"{field.description}" + ", in s" * (field_unit(field) == "s")) for name, field in frames]
    only_file = [f"`{name}`" for name, _ in fields if name not in BlockOfFile.model_fields]
    numbers = [f"`{name}`" for name, field in Scene.model_fields.items() if field.annotation is float]
    return (
        "# Sweep file\n\nA sweep file is a YAML mapping with these keys. A block is such a mapping, too, without "
        f"{', '.join(only_file)}. "
        "[Sweeps](../sweeps.md) shows how to use it.\n\n"
        + listing(keys)
        + "\n## Grid\n\nEach key is `preset` or a field of scene, options or parameters. Each value is a list, such as "
        "`[10, 15, 20]`, or a range with both ends: `{from: 5, to: 30, step: 5}` or `{from: 5, to: 30, count: 6}`. The "
        "last axis varies fastest. `null` stands for itself where a field may be null, such as `load_factor: [null, "
        "1]`; in merged files, xarray and pandas it is NaN. "
        "Where a value may be a list itself, each has a name, as in `floor: {flat: flat, ramp: [[0, 0], [1, 0.1]]}`: "
        f"{', '.join(f'`{name}`' for name in COMPOUND)}.\n"
        "\n## Distributions\n\nThe key `all` says what is drawn of the other quantities: `table` (the default) or "
        "`fixed`, nothing. Each quantity takes one of `table`, `fixed`, `{uniform: [lower, upper]}` and "
        "`{gaussian: {mean: …, sigma: …}}`; without `mean` the Gaussian lies about the chain's value. Given values, "
        "on an axis or not, are exact; only a distribution of their own name, such as `floor_friction: table`, draws "
        "about each. Distributions "
        f"can be given for every parameter and for {', '.join(numbers)}. `table` draws {', '.join(uniform)}, and by "
        f"the Gaussians of [Table 1](parameters.md), about the chain's value, {', '.join(gaussian)}.\n"
        + "\n## Samplers\n\n"
        + listing((f"`{name}`", SAMPLER_MEANINGS[name]) for name in SAMPLERS)
        + "\n## Record\n\n"
        f"`series` keeps the time series of a walk, every {SERIES_INTERVAL:g} s. `frames` keeps positions of "
        f"all joints, every {FRAME_INTERVAL:g} s, of samples whose series are kept. Each is `false`, `true` (all "
        "samples) or a mapping:\n\n" + listing(kept)
    )


def results_page() -> str:
    """Fields of a walk, columns of a sweep, statuses."""
    numbers: dict[tuple[str, str], list[str]] = {}
    for name, stored in STORED.items():
        if not stored.shape:
            for key, meaning in stored.keys.items():
                numbers[meaning, stored.unit] = [f'`{name}["{key}"]`']
            if not stored.keys:
                numbers[stored.meaning, stored.unit] = [f"`{name}`" if name in COLUMNS else f"`{name}` of a walk"]
    for name, column in COLUMNS.items():
        fields = numbers.setdefault((column.meaning, column.unit), [])
        if fields != [f"`{name}`"]:
            fields.append(f"`{name}`" if fields else f"`{name}` of a sweep")
    rows = ((f"{', '.join(names)}{bracketed(unit)}", meaning) for (meaning, unit), names in numbers.items())
    arrays = (
        (f"`{name}`{bracketed(stored.unit)}", stored.described) for name, stored in STORED.items() if stored.shape
    )
    statuses = ((f"`{status.label}`, {int(status)}", status.sentence) for status in Status)
    return (
        "# Results\n\n## Status\n\nHow a walk ended: name, code, and what to do. The first error of a walk stays; its "
        "Δx is NaN.\n\n"
        + listing(statuses)
        + "\n## Numbers\n\nFields of `warpchain.WalkResult`, datasets of the file that `save` writes, and columns of "
        "`warpchain.SweepResult`, where each drawn quantity has a column, too; a second name is that of the column. "
        "Losses of energy are positive. "
        "What a walk of a sweep does not have is NaN, or −1 in columns of whole numbers; averages of your own must "
        "leave such walks out. `cell_statistics` and figures do so: `count` is the number of walks that were averaged, "
        "`absent` that of walks at rest without the quantity.\n\n"
        + listing(rows)
        + "\n## Arrays\n\nOf a walk, at t samples and f frames of n links, in the same file.\n\n"
        + listing(arrays)
    )


def bracketed(unit: str) -> str:
    """A unit to stand behind a name; nothing for pure numbers."""
    return "" if unit == "1" else f" [{unit}]"


def commands_page() -> str:
    """Every command with its options; those that are fields of the scene or of the options by their names only."""
    parts = [
        "# Commands\n\n`--help` of each command says more. Options that set a field have the meaning, values and "
        f"default of that field. `{JSON}`, where a command has it, prints one JSON object instead of tables.\n"
    ]
    group: Any = typer.main.get_command(app)
    for name, command in sorted(group.commands.items(), key=lambda item: item[0] != "walk"):
        context = command.make_context(name, [], resilient_parsing=True)
        rows: dict[str, tuple[str, str]] = {}
        for one in command.params:
            words = one.metavar if one.param_type_name == "argument" else one.get_help_record(context)[0]
            if one.opts != [JSON]:
                first, *others = re.split(r"(?<=\.) ", " ".join((one.help or "").split()))
                rows[one.name] = f"`{words}`", " ".join([first, *(each for each in others if each[:8] == "Default:")])
        lines: list[tuple[str, str]] = []
        for page, model in (("scene", Scene), ("options", Options)):
            fields = [rows.pop(field)[0] for field in list(rows) if name == "walk" and field in model.model_fields]
            if fields:
                lines.append((", ".join(fields), f"fields of the [{page}]({page}.md)"))
        text = "\n\n".join(" ".join(part.split()) for part in (command.callback.__doc__ or "").split("\n\n"))
        parts.append(f"\n## warpchain {name}\n\n{text}\n\n" + listing([*lines, *rows.values()]))
    return "".join(parts)


PAGES: Final = {
    "parameters.md": parameters_page,
    "scene.md": scene_page,
    "options.md": options_page,
    "sweep-file.md": sweep_file_page,
    "results.md": results_page,
    "commands.md": commands_page,
}


def pages() -> Mapping[str, str]:
    """File name → content of every page."""
    return {name: NOTE + page() for name, page in PAGES.items()}


if __name__ == "__main__":
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
