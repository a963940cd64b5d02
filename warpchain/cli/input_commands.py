"""The commands `parameters` and `schema`, which list possible inputs, and `bench`, which measures speed."""

import json
from pathlib import Path
from typing import Annotated, Any, Final, get_args

import typer

from warpchain.cli.words import JSON, argument, option, output

_NAMES: Final = "Names or symbols, such as floor_friction, mu_fc or scene.phase, or a section. Default: all."
STEPS: Final = {
    "links": "{[links]}",
    "method": "{[method]}",
    "tolerance": "{[tolerance]:g}",
    "chains": "{[chains]:,}",
    "µs/step": "{[microseconds]:.3g}",
    "mean step / s": "{[step]:.2e}",
    "rejected": "{[rejected]:.1%}",
    "simulated s/s": "{[chain_seconds]:.3g}",
    "error / m": "{[position_error]:.1e}",
    "error / (m/s)": "{[velocity_error]:.1e}",
}
WALKS: Final = {
    "method": "{[method]}",
    "tolerance": "{[tolerance]:g}",
    "walks": "{[walks]:,}",
    "at rest": "{[at_rest]:,}",
    "s": "{[seconds]:.1f}",
    "walks/s": "{[walks_per_second]:.3g}",
    "waits for GPU": "{[waited]:.0%}",
}
"""Heading of each column of a table → its text, filled in from a row."""


def parameters(
    names: Annotated[list[str] | None, argument("[NAME]...", _NAMES)] = None,
    preset: Annotated[
        str, option("NAME", "Preset whose values are shown: paper (Table 1 of the paper) or soft.")
    ] = "paper",
) -> None:
    """List all parameters, scene fields and options.

    The list has symbols, units, values, bounds and meanings.
    """
    from warpchain.cli.output import print_table
    from warpchain.inputs.fields import FIELDS, SECTION_OF, SECTIONS, SYMBOL_OF, dotted_name
    from warpchain.inputs.options import Options
    from warpchain.inputs.parameters import preset as parameter_preset
    from warpchain.inputs.scene import Scene
    from warpchain.inputs.validation import field_limits, field_unit, shown
    from warpchain.pictures.labels import value_text

    wanted = {name if name in SECTIONS else dotted_name(name, shown(name)) for name in names or SECTIONS}
    models = (parameter_preset(preset), Scene(), Options())
    values = {name: value for model in models for name, value in vars(model).items()} | {"method": "standard"}
    rows = []
    for name, field in FIELDS.items():
        if not wanted & {name, SECTION_OF[name]}:
            continue
        extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        words: Any = extra.get("enum", [word for word in get_args(field.annotation) if isinstance(word, str)])
        bounds = ", ".join(map(value_text, (True, False) if field.annotation is bool else words))
        if limits := field_limits(field):
            lower = f"[{value_text(limits['ge'])}" if "ge" in limits else f"({value_text(limits.get('gt', '−∞'))}"
            upper = f"{value_text(limits['le'])}]" if "le" in limits else f"{value_text(limits.get('lt', '∞'))})"
            bounds = f"{lower}, {upper}"
        unit = field_unit(field).removeprefix("1")
        rows.append((name, SYMBOL_OF.get(name, ""), value_text(values[name]), unit, bounds, str(field.description)))
    headings = ("name", "symbol", "value", "unit", "bounds", "meaning")
    print_table(headings, rows, left=set(headings) - {"value"})


def schema(
    path: Annotated[Path | None, output("FILE", "Write the schema to this file instead of standard output.")] = None,
) -> None:
    """Print a JSON schema of sweep files, for editors.

    An editor with a YAML language server finds the schema by the first line of a sweep file:
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


def bench(
    device: Annotated[str, typer.Option(metavar="NAME", help="cpu, cuda (the first GPU) or cuda:N.")] = "cpu",
    links: Annotated[
        list[int] | None, option("N", "Links of the chains that fly; may be repeated. Default: 60 and 150.")
    ] = None,
    as_json: Annotated[bool, JSON] = False,
) -> None:
    """Measure the speed and the errors of each method.

    Steps are attempted steps of one chain in free flight (4000 chains on a GPU), with Table 1's values and the
    method's default tolerance. Errors are the largest errors of a link's position and velocity after 1 ms, compared
    with SciPy's DOP853 at 1e-10 on a NumPy model. Walks have 60 links at 15 Hz, the default method and a warm kernel
    cache; beside their rate stands the share of the time in which the host waited for a GPU.
    """
    from warpchain.bench.measurements import machine, step_costs, walk_rate
    from warpchain.cli.output import print_table
    from warpchain.inputs.options import Options
    from warpchain.inputs.scene import Scene, check_links_on_gpu
    from warpchain.inputs.validation import InputError, json_value, validated
    from warpchain.run.progress_bar import changing_line

    where = validated(Options, {"device": device}, "bench").device
    lengths = [validated(Scene, {"links": count}, "bench").links for count in links or (60, 150)]
    for count in lengths:
        check_links_on_gpu(count, where, "bench.links")
        if count % 2:
            raise InputError(f"bench.links: expected an even number, got {count}; inner and outer links alternate")
    about = machine(where)
    with changing_line() as show:
        steps, walks = step_costs(where, lengths, show), walk_rate(where, show)
    if as_json:
        print(json.dumps(json_value({"machine": about, "steps": steps, "walks": walks}), indent=2, allow_nan=False))
        return
    print(", ".join(f"{name} {value}" for name, value in about.items()))
    for columns, rows in ((STEPS, steps), (WALKS, [walks])):
        print()
        print_table(columns, ([form.format(row) for form in columns.values()] for row in rows))
