"""Writes the pages of docs/reference/ from the code: parameters, scene, options, sweep file, results, commands.

Run ``python docs/generate_reference.py`` after a change of any of these; a test compares the pages with the code.
"""

import inspect
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from typer.models import ArgumentInfo, OptionInfo

from warpchain.cli.main import app
from warpchain.inputs.distributions import TABLE, Uniform
from warpchain.inputs.methods import METHODS, METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS, Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import spelled
from warpchain.status import Status
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.recording import FRAME_INTERVAL, SERIES_INTERVAL, Frames
from warpchain.sweeps.sweep_file import BlockKeys, BlockOfFile, SweepFile
from warpchain.walks.rows import COLUMNS
from warpchain.walks.walk_result import STORED

FOLDER: Final = Path(__file__).parent / "reference"
NOTE: Final = "<!-- Written by docs/generate_reference.py; change the code, then run that script. -->\n"

SIGNS: Final = {"ge": "≥ ", "gt": "> ", "le": "≤ ", "lt": "< "}

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


def shown(value: object) -> str:
    """A value as YAML has it."""
    if value is None or isinstance(value, bool):
        return "`" + {None: "null", True: "true", False: "false"}[value] + "`"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


def unit_of(field: FieldInfo) -> str:
    """SI unit of a field; nothing for pure numbers and names."""
    extra = field.json_schema_extra
    unit = str(extra.get("unit", "1")) if isinstance(extra, dict) else "1"
    return "" if unit == "1" else unit


def values_of(field: FieldInfo) -> str:
    """What a field may be: its names, or the limits of its number."""
    kinds = [field.annotation, *get_args(field.annotation)]
    for kind in kinds:
        if get_origin(kind) is Literal:
            return ", ".join(f"`{name}`" for name in get_args(kind))
    if bool in kinds:
        return "`true`, `false`"
    if str in kinds:
        return "name"
    limits = [
        sign + format(limit, "g")
        for item in field.metadata
        for name, sign in SIGNS.items()
        if (limit := getattr(item, name, None)) is not None
    ]
    return ", ".join([*(["whole"] if int in kinds else []), *limits])


def model_table(model: type[BaseModel]) -> str:
    """All fields of a model."""
    rows = (
        (f"`{name}`", shown(field.default), unit_of(field), values_of(field), field.description)
        for name, field in model.model_fields.items()
    )
    return table(("name", "default", "unit", "values", "meaning"), rows)


def parameters_page() -> str:
    """Table 1, bounds and presets."""
    quantities = Parameters.quantities()
    rows = []
    for name, row in quantities.items():
        lower = f"{'≥' if row.bounds.lower_included else '>'} {row.bounds.lower:g}"
        unit = "" if row.unit == "1" else row.unit
        sigma = f"{row.sigma:g}" if row.sigma else ""
        bounds = f"{lower}, ≤ {row.bounds.upper:g}"
        written = f"`{ascii_symbol}`" if (ascii_symbol := spelled(row.symbol)) != row.symbol else ""
        rows.append((f"`{name}`", row.symbol, written, f"{row.value:g}", sigma, unit, bounds, row.source, row.meaning))
    heads = ("name", "symbol", "in ASCII", "value", "σ", "unit", "bounds", "source", "meaning")
    differing = [
        (
            f"`{preset}`",
            ", ".join(
                f"`{name}: {getattr(values, name):g}`"
                for name in quantities
                if getattr(values, name) != quantities[name].value
            )
            or "Table 1",
        )
        for preset, values in PRESETS.items()
    ]
    return (
        "# Parameters\n\n"
        "The quantities of Table 1 of the paper, in SI units. σ is the standard deviation of the Gaussian that samples "
        "draw from; a draw outside the bounds is drawn again. `circle_radius` is smaller than half of `link_length`. "
        "The source *assumed* marks a quantity that the paper does not give. A symbol, also in ASCII, stands for its "
        "name: `mu_fc=0.3` for `floor_friction=0.3`.\n\n"
        + table(heads, rows)
        + "\n## Presets\n\n"
        + table(("preset", "what differs from Table 1"), differing)
    )


def scene_page() -> str:
    """What happens in a walk."""
    return (
        "# Scene\n\nWhat happens in a walk, from hanging on the sprocket to rest: "
        "[the model](../model.md#the-scene) explains the phases, "
        "[the stationary loop](../../studies/stationary_loop/README.md) the hold."
        "\n\n" + model_table(Scene)
    )


def options_page() -> str:
    """How a walk is computed."""
    words = [
        (f"`{word}`", ", ".join(f"`{name}: {shown(value).strip('`')}`" for name, value in settings.items()))
        for word, settings in METHODS_BY_NEED.items()
    ]
    return (
        "# Options\n\nHow a walk is computed; see [methods](../methods.md). A method in one word, such as the default, "
        "has defaults of its own, see below.\n\n"
        + model_table(Options)
        + "\n## Methods in one word\n\nSuch a word of `method` sets the defaults of these options. On a GPU `standard` "
        "means `explicit`. A `tolerance` that is given also replaces `soft_tolerance`.\n\n"
        + table(("word", "options"), words)
        + "\n## Integrators\n\n"
        + table(("method", "what it is"), ((f"`{name}`", title) for name, title in METHODS.items()))
    )


def sweep_file_page() -> str:
    """Keys, grids, distributions, samplers and recording of a sweep file."""
    drawn = [
        (
            f"`{name}`",
            f"uniform in [{law.lower:g}, {law.upper:g}]"
            if isinstance(law, Uniform)
            else f"Gaussian about the chain's value, σ = {law.sigma:g}",
        )
        for name, law in TABLE.items()
    ]
    keys = [
        (f"`{name}`", "file, block" if name in BlockOfFile.model_fields else "file", field.description)
        for name, field in sorted(SweepFile.model_fields.items(), key=lambda item: item[0] in BlockKeys.model_fields)
    ]
    kept = [
        (f"`{name}`", f"{field.description}" + ", in s" * (unit_of(field) == "s"))
        for name, field in Frames.model_fields.items()
    ]
    numbers = [f"`{name}`" for name, field in Scene.model_fields.items() if field.annotation is float]
    return (
        "# Sweep file\n\nA sweep file is a YAML mapping with these keys. An error names the path of the value, such as "
        "`sweep.blocks[0].grid.frequency[3]`. [Sweeps](../sweeps.md) shows how to use it.\n\n"
        + table(("key", "stands in", "meaning"), keys)
        + "\n## Grid\n\nEach key is `preset` or a field of scene, options or parameters. Each value is a list, such as "
        "`[10, 15, 20]`, or a range with both ends: `{from: 5, to: 30, step: 5}` or `{from: 5, to: 30, count: 6}`. The "
        "last axis varies fastest. `null` stands for itself where a field may be null, such as `load_factor: [null, "
        "1]`; in merged files, xarray and pandas it is NaN.\n"
        "\n## Distributions\n\nThe key `all` says what is drawn of the other quantities: `table` (the default) or "
        "`fixed`, nothing. Each quantity takes one of `table`, `fixed`, `{uniform: [lower, upper]}` and "
        "`{gaussian: {mean: …, sigma: …}}`; without `mean` the Gaussian lies about the chain's value. Given values, "
        "on an axis or not, are exact: `all` does not hold for them. Only a distribution of their own name, such as "
        "`floor_friction: table`, draws about each. Distributions "
        f"can be given for every parameter and for {', '.join(numbers)}. `table` draws:\n\n"
        + table(("quantity", "distribution"), drawn)
        + "\n## Samplers\n\n"
        + table(("sampler", "what it draws"), ((f"`{name}`", SAMPLER_MEANINGS[name]) for name in SAMPLERS))
        + "\n## Record\n\n"
        f"`series` keeps the time series of a walk, every {SERIES_INTERVAL:g} s. `frames` keeps positions of "
        f"all joints, every {FRAME_INTERVAL:g} s, of samples whose series are kept. Each is `false`, `true` (all "
        "samples) or a mapping:\n\n" + table(("key", "meaning"), kept)
    )


def results_page() -> str:
    """Fields of a walk, columns of a sweep, statuses."""
    fields = []
    for name, stored in STORED.items():
        unit = "" if stored.unit == "1" else stored.unit
        fields.append((f"`{name}`", unit, stored.described))
        fields += [(f'`{name}["{key}"]`', unit, meaning) for key, meaning in stored.keys.items()]
    columns = (
        (f"`{name}`", "" if column.unit == "1" else column.unit, column.meaning) for name, column in COLUMNS.items()
    )
    statuses = ((f"`{status.label}`", int(status), status.sentence) for status in Status)
    return (
        "# Results\n\n## Status\n\nHow a walk ended. The first error of a walk stays; its Δx is NaN.\n\n"
        + table(("status", "code", "sentence"), statuses)
        + "\n## A walk\n\nFields of `warpchain.WalkResult`, and datasets of the file that `save` writes. "
        "Losses of energy are positive. `sprocket_center` and `sprocket_radius`, in m, follow from them.\n\n"
        + table(("field", "unit", "meaning"), fields)
        + "\n## A sweep\n\nColumns of `warpchain.SweepResult`; each drawn quantity has a column, too. "
        "What a walk does not have is NaN, or −1 in columns of whole numbers, such as `bounces_before_collapse` of a "
        "loop that never collapsed. `cell_statistics` and figures leave such walks out, column by column: `count` is "
        "the number of walks that were averaged, `absent` that of walks at rest without the quantity. Averages of your "
        "own must do so, too.\n\n" + table(("column", "unit", "meaning"), columns)
    )


def option_row(name: str, annotation: Any, default: Any) -> tuple[str, str] | None:
    """How an option is written, and its help; None for what is no option."""
    kind, *notes = get_args(annotation) or (annotation,)
    info = next((note for note in notes if isinstance(note, OptionInfo | ArgumentInfo)), None)
    if info is None:
        return None
    kinds = [kind, *get_args(kind)]
    choices = next((get_args(one) for one in kinds if get_origin(one) is Literal), ())
    metavar = info.metavar or "/".join(str(choice) for choice in choices) or ("" if bool in kinds else "N")
    help_text = " ".join((info.help or "").split())
    if isinstance(info, ArgumentInfo):
        return f"`{metavar}`", help_text
    word = "--" + name.replace("_", "-")
    given = [one for one in (info.default, *(info.param_decls or ())) if isinstance(one, str)]
    names = given or ([word, word.replace("--", "--no-")] if bool in kinds else [word])
    written = ", ".join(f"`{one}`" for one in names) + (f" `{metavar}`" if metavar else "")
    has_default = isinstance(default, str | int) and not isinstance(default, bool)
    return written, help_text + (f" Default: {default}." if has_default else "")


def commands_page() -> str:
    """Every command with its options."""
    parts = ["# Commands\n\nThe same text as `--help` of each command.\n"]
    named = [(command.name or command.callback.__name__, command.callback) for command in app.registered_commands]
    for name, function in sorted(named, key=lambda item: item[0] != "walk"):
        hints = get_type_hints(function, include_extras=True)
        given = inspect.signature(function).parameters.items()
        rows = [row for key, one in given if (row := option_row(key, hints[key], one.default)) is not None]
        text = "\n\n".join(" ".join(part.split()) for part in (function.__doc__ or "").split("\n\n"))
        parts.append(f"\n## warpchain {name}\n\n{text}\n\n" + table(("option", "meaning"), rows))
    return "".join(parts)


def pages() -> Mapping[str, str]:
    """File name → content of every page."""
    made = {
        "parameters.md": parameters_page(),
        "scene.md": scene_page(),
        "options.md": options_page(),
        "sweep-file.md": sweep_file_page(),
        "results.md": results_page(),
        "commands.md": commands_page(),
    }
    return {name: NOTE + text for name, text in made.items()}


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
        print(FOLDER / name)
