"""The commands about what a user may give: parameters, schema."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from warpchain.cli.words import argument, option, output

if TYPE_CHECKING:
    from warpchain.inputs.value_list import ValueEntry

WIDE: Final = 160
"""Columns of the tables where there is no terminal to ask."""
ROOM_FOR_MEANINGS: Final = 120
"""Columns from which a table of many values also says what they mean."""
_NAMES: Final = "Names or symbols, such as floor_friction, mu_fc or scene.phase, or a section. Default: all."
_TITLES: Final = {
    "parameters": "parameters, preset {} (measured, looked up, adjusted: Table 1)",
    "scene": "scene",
    "options": "options, as method standard sets them",
}


def parameters(
    names: Annotated[list[str] | None, argument("[NAME]...", _NAMES)] = None,
    preset: Annotated[str, option("NAME", "Whose values: paper, Table 1 of the paper, or soft.")] = "paper",
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of tables.")] = False,
) -> None:
    """List what can be set: parameters, scene and options, with symbols, units, values, bounds and sources."""
    from warpchain.inputs.sections import SECTIONS, dotted_name
    from warpchain.inputs.validation import shown
    from warpchain.inputs.value_list import list_values

    wanted = {name if name in SECTIONS else dotted_name(name, shown(name)) for name in names or SECTIONS}
    listed = {
        section: [entry for entry in entries if section in wanted or entry.name in wanted]
        for section, entries in list_values(preset).items()
    }
    if as_json:
        content = {section: {entry.name: _content(entry) for entry in entries} for section, entries in listed.items()}
        print(json.dumps({"preset": preset, **content}, indent=2, ensure_ascii=False, allow_nan=False))
    else:
        _print_tables(listed, preset, all_meanings=names is not None)


def schema(
    path: Annotated[Path | None, output("FILE", "Write it to this file instead of standard output.")] = None,
) -> None:
    """Print a JSON schema of sweep files, for editors.

    An editor with a YAML language server finds it by the first line of a sweep file:
    # yaml-language-server: $schema=FILE
    """
    from warpchain.files import write_whole
    from warpchain.inputs.validation import printable
    from warpchain.sweeps.sweep_file import sweep_schema

    text = json.dumps(sweep_schema(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    if path is None:
        print(text, end="")
        return
    write_whole(path, text)
    print(printable(str(path)))


def _content(entry: "ValueEntry") -> dict[str, Any]:
    """An entry as JSON has it."""
    content = asdict(entry)
    del content["name"]
    limits = content.pop("limits")
    bounds = {
        "lower": limits.get("ge", limits.get("gt")),
        "lower_included": "ge" in limits,
        "upper": limits.get("le", limits.get("lt")),
        "upper_included": "le" in limits,
    }
    return content | {"bounds": bounds if limits else None, "choices": list(entry.choices) or None}


def _print_tables(listed: "Mapping[str, Sequence[ValueEntry]]", preset: str, *, all_meanings: bool) -> None:
    """Print a table for each section that has entries."""
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    if not console.is_terminal:
        console.width = WIDE
    meanings = all_meanings or console.width >= ROOM_FOR_MEANINGS
    for section, entries in listed.items():
        if not entries:
            continue
        rows = [_cells(entry) for entry in entries]
        headings = [heading for heading in rows[0] if any(row[heading] for row in rows)]
        console.print(_TITLES[section].format(preset), style="bold")
        table = Table(box=None, padding=(0, 1, 0, 0), header_style="")
        for heading in headings if meanings else headings[:-1]:
            right, wraps = heading in ("value", "sigma"), heading in ("bounds", "meaning")
            table.add_column(heading, justify="right" if right else "left", no_wrap=not wraps)
        for row in rows:
            table.add_row(*(row[heading] for heading in headings[: len(table.columns)]))
        console.print(table, "")
    if not meanings:
        console.print("`warpchain parameters NAME` says what a name means.")


def _cells(entry: "ValueEntry") -> dict[str, str]:
    """An entry as cells of a table, by their headings; bounds as an interval, or the choices."""
    from warpchain.inputs.validation import DIMENSIONLESS

    limits, bounds = entry.limits, ", ".join(map(_written, entry.choices))
    if limits:
        lower = f"[{_written(limits['ge'])}" if "ge" in limits else f"({_written(limits.get('gt', '−∞'))}"
        upper = f"{_written(limits['le'])}]" if "le" in limits else f"{_written(limits.get('lt', '∞'))})"
        bounds = f"{lower}, {upper}"
    return {
        "name": entry.name,
        "symbol": entry.symbol or "",
        "value": _written(entry.value),
        "sigma": "" if entry.sigma is None else _written(entry.sigma),
        "unit": "" if entry.unit == DIMENSIONLESS else entry.unit,
        "bounds": bounds,
        "source": entry.source.removeprefix("Table 1, "),
        "meaning": entry.meaning,
    }


def _written(value: Any) -> str:
    """A value as a sweep file has it."""
    from warpchain.inputs.validation import short

    if value is None or isinstance(value, bool):
        return json.dumps(value)
    return short(value) if isinstance(value, int | float) else str(value)
