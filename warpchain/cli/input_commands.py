"""The commands about what a user may give: parameters, schema."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from warpchain.cli import completions
from warpchain.cli.output_paths import output_path

if TYPE_CHECKING:
    from warpchain.inputs.value_list import ValueEntry

WIDE: Final = 160
"""Columns of the tables where there is no terminal to ask."""
ROOM_FOR_MEANINGS: Final = 120
"""Columns from which a table of many values also says what they mean."""
_TITLES: Final = {
    "parameters": "parameters, preset {} (measured, looked up, adjusted: Table 1)",
    "scene": "scene",
    "options": "options, as method standard sets them",
}


def parameters(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="Names or symbols, such as floor_friction, mu_fc or scene.phase, or a section. Default: all.",
            autocompletion=completions.names,
            show_default=False,
        ),
    ] = None,
    preset: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Whose values: paper, Table 1 of the paper, or soft.",
            autocompletion=completions.presets,
        ),
    ] = "paper",
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
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            parser=output_path,
            help="Write it to this file instead of standard output.",
        ),
    ] = None,
) -> None:
    """Print a JSON schema of sweep files, with which editors check and complete them.

    An editor with a YAML language server finds it by the first line of a sweep file:
    # yaml-language-server: $schema=FILE
    """
    from warpchain.files import write_whole
    from warpchain.inputs.validation import printable
    from warpchain.sweeps.sweep_file import sweep_schema

    text = json.dumps(sweep_schema(), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    if output is None:
        print(text, end="")
        return
    write_whole(output, text)
    print(printable(str(output)))


def _content(entry: "ValueEntry") -> dict[str, Any]:
    """An entry as JSON has it."""
    limits = entry.limits
    bounds = {
        "lower": limits.get("ge", limits.get("gt")),
        "lower_included": "ge" in limits,
        "upper": limits.get("le", limits.get("lt")),
        "upper_included": "le" in limits,
    }
    return {
        "symbol": entry.symbol,
        "unit": entry.unit,
        "value": entry.value,
        "sigma": entry.sigma,
        "bounds": bounds if limits else None,
        "choices": list(entry.choices) or None,
        "source": entry.source,
        "meaning": entry.meaning,
    }


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
        cells = [_cells(entry) for entry in entries]
        console.print(_TITLES[section].format(preset), style="bold")
        table = Table(box=None, padding=(0, 1, 0, 0), header_style="")
        headings = [heading for heading in cells[0] if any(row[heading] for row in cells)]
        for heading in headings:
            right, wraps = heading in ("value", "sigma"), heading in ("bounds", "meaning")
            if meanings or heading != "meaning":
                table.add_column(heading, justify="right" if right else "left", no_wrap=not wraps)
        for row in cells:
            table.add_row(*(row[heading] for heading in headings[: len(table.columns)]))
        console.print(table, "")
    if not meanings:
        console.print("`warpchain parameters NAME` says what a name means.")


def _cells(entry: "ValueEntry") -> dict[str, str]:
    """An entry as cells of a table, by their headings."""
    from warpchain.inputs.validation import DIMENSIONLESS

    return {
        "name": entry.name,
        "symbol": entry.symbol or "",
        "value": _written(entry.value),
        "sigma": "" if entry.sigma is None else _written(entry.sigma),
        "unit": "" if entry.unit == DIMENSIONLESS else entry.unit,
        "bounds": _bounds(entry),
        "source": entry.source.removeprefix("Table 1, "),
        "meaning": entry.meaning,
    }


def _bounds(entry: "ValueEntry") -> str:
    """Bounds as an interval, or the choices."""
    limits = entry.limits
    if not limits:
        return ", ".join(_written(choice) for choice in entry.choices)
    lower = f"[{_written(limits['ge'])}" if "ge" in limits else f"({_written(limits.get('gt', '−∞'))}"
    upper = f"{_written(limits['le'])}]" if "le" in limits else f"{_written(limits.get('lt', '∞'))})"
    return f"{lower}, {upper}"


def _written(value: Any) -> str:
    """A value as a sweep file has it."""
    from warpchain.inputs.validation import short

    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    return short(value) if isinstance(value, int | float) else str(value)
