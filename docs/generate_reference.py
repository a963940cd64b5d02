"""Writes the pages of docs/reference/ from the code: parameters, scene, options, sweep file, results, commands.

It also writes `warpchain/typed.pyi`, by which type checkers and editors know keywords and columns. Run ``python
docs/generate_reference.py`` after a change of any of these; a test compares what it writes with the code. The texts
of the pages stand in reference.txt, which names parts in braces, such as {{samplers}}: `PARTS`.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from warpchain.chain.keep import FRAME_INTERVAL
from warpchain.chain.resolution import MAY_BE_NONE
from warpchain.cli.main import app
from warpchain.inputs.distributions import DRAWABLE, TABLE, Uniform
from warpchain.inputs.fields import FIELDS
from warpchain.inputs.keywords import walk_keywords
from warpchain.inputs.methods import METHODS, METHODS_BY_NEED
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import PRESETS, Parameters
from warpchain.inputs.scene import COMPOUND, Scene
from warpchain.inputs.validation import field_limits, field_unit, spelled
from warpchain.run.sweep_run import FILE_KEYS, OF_FILE
from warpchain.status import Status
from warpchain.sweeps.designs import SAMPLERS
from warpchain.sweeps.recording import SERIES_INTERVAL, Frames
from warpchain.sweeps.sweep_file import BlockKeys, BlockOfFile, SweepFile
from warpchain.walks.rows import COLUMNS, drawn_column
from warpchain.walks.walk_numbers import STORED

FOLDER = Path(__file__).parent / "reference"
STUB = Path(__file__).parents[1] / "warpchain/typed.pyi"
NOTE = "<!-- Written by docs/generate_reference.py; change the code, then run that script. -->\n"
JSON = "--json"  # An option of most commands, which is explained once


def listing(rows: Iterable[tuple[str, object]]) -> str:
    """A Markdown list of names and their meanings."""
    return "\n".join(f"- {name}: {meaning}" for name, meaning in rows)


def named(names: Iterable[object]) -> str:
    """Names as code, with commas between them."""
    return ", ".join(f"`{name}`" for name in names)


def shown(value: object) -> str:
    """A value as YAML has it."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return f"{value:g}" if isinstance(value, float) else str(value)


def in_unit(text: str, unit: str, bracketed: bool = False) -> str:
    """A text with the unit behind it, unless that is of pure numbers."""
    if unit == "1":
        return text
    return f"{text} [{unit}]" if bracketed else f"{text} {unit}"


def values_of(field: FieldInfo) -> str:
    """What a field may be: its other names, or the limits of its number with their unit; nothing for any text."""
    kinds = [field.annotation, *get_args(field.annotation)]
    names = next((get_args(kind) for kind in kinds if get_origin(kind) is Literal), (True, False) * (bool in kinds))
    if names:
        others = named(shown(name) for name in names if name != field.default)
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


def fields_of(model: type[BaseModel], **other_meanings: str) -> str:
    """All fields of a model; other meanings replace descriptions."""
    return listing(
        (f"`{name}: {shown(field.default)}`{values_of(field)}", other_meanings.get(name, field.description))
        for name, field in model.model_fields.items()
    )


def tables() -> str:
    """The quantities of Table 1 by their source."""
    sources: dict[str, list[str]] = {}
    for name, row in Parameters.quantities().items():
        ascii_symbol = spelled(row.symbol)
        symbol = row.symbol if ascii_symbol == row.symbol else f"{row.symbol}, `{ascii_symbol}`"
        value = in_unit(f"{row.value:g}" + (f" ± {row.sigma:g}" if row.sigma else ""), row.unit)
        cells = f"`{name}`", symbol, value, bounds_of(field_limits(FIELDS[name])), row.meaning
        sources.setdefault(row.source, []).append(" | ".join(cell.replace("|", "\\|") for cell in cells))
    head = ["name | symbol | value | bounds | meaning", "--- | --- | --- | --- | ---"]
    return "\n\n".join(
        f"## {source.capitalize()}\n\n" + "\n".join(f"| {row} |" for row in (*head, *rows))
        for source, rows in sources.items()
    )


def presets() -> str:
    """What each preset has other than Table 1."""
    quantities, found = Parameters.quantities(), []
    for preset, values in PRESETS.items():
        others = {name: value for name, value in values.model_dump().items() if value != quantities[name].value}
        found.append((f"`{preset}`", named(f"{name}: {value:g}" for name, value in others.items()) or "Table 1"))
    return listing(found)


def words() -> str:
    """The options that each method in one word sets."""
    texts: dict[str, str] = {}
    for word, settings in METHODS_BY_NEED.items():
        alike = next((one for one in texts if METHODS_BY_NEED[one].keys() == settings.keys()), None)
        known = METHODS_BY_NEED[alike] if alike else {}
        own = (f"{name}: {shown(value)}" for name, value in settings.items() if (name, value) not in known.items())
        texts[word] = named(own) + (f"; all else as `{alike}`" if alike else "")
    return listing((f"`{word}`", text) for word, text in texts.items())


def numbers() -> str:
    """Fields of a walk and columns of a sweep that are numbers; those of one meaning stand together."""
    found: dict[tuple[str, str], list[str]] = {}
    for name, stored in STORED.items():
        if not stored.shape:
            for key, meaning in stored.keys.items():
                found[meaning, stored.unit] = [f'`{name}["{key}"]`']
            if not stored.keys:
                found[stored.meaning, stored.unit] = [f"`{name}`" if name in COLUMNS else f"`{name}` of a walk"]
    for name, column in COLUMNS.items():
        fields = found.setdefault((column.meaning, column.unit), [])
        if fields != [f"`{name}`"]:
            fields.append(f"`{name}`" if fields else f"`{name}` of a sweep")
    return listing((in_unit(", ".join(names), unit, True), meaning) for (meaning, unit), names in found.items())


def commands() -> str:
    """Every command with its options; those that are fields of the scene or of the options by their names only."""
    parts = []
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
        parts.append(f"## warpchain {name}\n\n{text}\n\n" + listing([*lines, *rows.values()]))
    return "\n\n".join(parts)


EVEN = {name: law for name, law in TABLE.items() if isinstance(law, Uniform)}
KEYS = sorted(SweepFile.model_fields.items(), key=lambda item: item[0] in BlockKeys.model_fields)
METHOD = f"a word, see below, or an [integrator](../methods.md#integrators): {named(METHODS)}"
PARTS = {
    "tables": tables(),
    "presets": presets(),
    "scene": fields_of(Scene),
    "options": fields_of(Options, method=METHOD),
    "words": words(),
    "only_file": named(name for name, _ in KEYS if name not in BlockOfFile.model_fields),
    "keys": listing((f"`{name}`", field.description) for name, field in KEYS),
    "compound": named(COMPOUND),
    "scene_numbers": named(name for name, field in Scene.model_fields.items() if field.annotation is float),
    "uniform": ", ".join(f"`{name}` uniformly in [{law.lower:g}, {law.upper:g}]" for name, law in EVEN.items()),
    "gaussian": named(name for name in TABLE if name not in EVEN),
    "samplers": listing((f"`{name}`", sampler.meaning) for name, sampler in SAMPLERS.items()),
    "series_interval": f"{SERIES_INTERVAL:g}",
    "frame_interval": f"{FRAME_INTERVAL:g}",
    "frames": listing(
        (f"`{name}`", f"{field.description}" + ", in s" * (field_unit(field) == "s"))
        for name, field in Frames.model_fields.items()
    ),
    "statuses": listing((f"`{status.label}`, {int(status)}", status.sentence) for status in Status),
    "numbers": numbers(),
    "arrays": listing(
        (in_unit(f"`{name}`", stored.unit, True), stored.described) for name, stored in STORED.items() if stored.shape
    ),
    "commands": commands(),
}


def pages() -> Mapping[str, str]:
    """File name → content of every page."""
    text = FOLDER.with_suffix(".txt").read_text(encoding="utf-8")
    text = re.sub(r"\{\{(\w+)\}\}", lambda match: PARTS[match[1]], text)
    _, *parts = re.split(r"^=== (\S+)\n", text, flags=re.MULTILINE)
    return {name: NOTE + page for name, page in zip(parts[::2], parts[1::2], strict=True)}


def stub() -> str:
    """The keywords of walk, simulate and sweep and the columns of a sweep, as type checkers and editors read them."""

    def fields(types: Mapping[str, str], other: str = "") -> str:
        lines = (f"    {name}: {other}{kind}{' | None' * (name in MAY_BE_NONE)}\n" for name, kind in types.items())
        text = re.sub(r"\b(int|float)\b", lambda match: match[1].capitalize(), "".join(lines))
        return text.replace("Sequence[Any]", "List").replace("'", '"')

    types = {name: kind for name, (kind, _) in walk_keywords().items()}
    solver = {name: types.pop(name) for name in Options.model_fields if not name.startswith("soften_")}
    solver["soften_area"] = types.pop("soften_area")
    columns = [*COLUMNS, *map(drawn_column, DRAWABLE)]
    return (
        "# Written by docs/generate_reference.py; change the code, then run that script.\n"
        "from collections.abc import Mapping, Sequence\n"
        "from typing import Any, Generic, Literal, TypedDict, TypeVar\n\n"
        "import numpy as np\nfrom numpy.typing import NDArray\n\nfrom warpchain.chain.setup import State\n"
        'from warpchain.inputs.starts import StartWord\n\nT = TypeVar("T")\nInt = int | np.integer[Any]\n'
        "Float = float | np.integer[Any] | np.floating[Any]\nList = Sequence[Any] | NDArray[Any]\n"
        'Start = StartWord | State\nFloor = Literal["flat"] | List\n\n'
        f"class SolverFields(TypedDict, Generic[T], total=False):\n{fields(solver, 'T | ')}\n"
        f"class WalkFields(SolverFields[T], total=False):\n{fields(types, 'T | ')}\n"
        f"class SweepFields(WalkFields[Any], total=False):\n{fields({name: OF_FILE[name] for name in FILE_KEYS})}\n"
        "class Columns:\n" + "".join(f"    {name}: NDArray[Any]\n" for name in columns)
    )


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
