"""The commands about what a user may give: parameters, schema."""

import json
from pathlib import Path
from typing import Annotated, Any, Final

from warpchain.cli.words import argument, option, output

_NAMES: Final = "Names or symbols, such as floor_friction, mu_fc or scene.phase, or a section. Default: all."


def parameters(
    names: Annotated[list[str] | None, argument("[NAME]...", _NAMES)] = None,
    preset: Annotated[str, option("NAME", "Whose values: paper, Table 1 of the paper, or soft.")] = "paper",
) -> None:
    """List what can be set: parameters, scene and options, with symbols, units, values, bounds and meanings."""
    from warpchain.cli.output import print_table
    from warpchain.inputs.options import Options
    from warpchain.inputs.parameters import preset as parameter_preset
    from warpchain.inputs.scene import Scene
    from warpchain.inputs.sections import SECTION_OF, SECTIONS, SYMBOL_OF, dotted_name
    from warpchain.inputs.validation import FIELDS, field_choices, field_limits, field_unit, shown

    wanted = {name if name in SECTIONS else dotted_name(name, shown(name)) for name in names or SECTIONS}
    models = (parameter_preset(preset), Scene(), Options())
    values = {name: value for model in models for name, value in vars(model).items()} | {"method": "standard"}
    rows = []
    for name, field in FIELDS.items():
        if not wanted & {name, SECTION_OF[name]}:
            continue
        limits, bounds = field_limits(field), ", ".join(map(_written, field_choices(field)))
        if limits:
            lower = f"[{_written(limits['ge'])}" if "ge" in limits else f"({_written(limits.get('gt', '−∞'))}"
            upper = f"{_written(limits['le'])}]" if "le" in limits else f"{_written(limits.get('lt', '∞'))})"
            bounds = f"{lower}, {upper}"
        unit = field_unit(field).removeprefix("1")
        rows.append((name, SYMBOL_OF.get(name, ""), _written(values[name]), unit, bounds, str(field.description)))
    headings = ("name", "symbol", "value", "unit", "bounds", "meaning")
    print_table(headings, rows, left=set(headings) - {"value"})


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


def _written(value: Any) -> str:
    """A value as a sweep file has it."""
    from warpchain.inputs.validation import short

    if value is None or isinstance(value, bool):
        return json.dumps(value)
    return short(value) if isinstance(value, int | float) else str(value)
