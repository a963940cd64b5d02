"""The command `warpchain bench`."""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Final

import typer

from warpchain.cli.words import output_path

STEPS: Final = {
    "links": "{.links}",
    "method": "{.method}",
    "tolerance": "{.tolerance:g}",
    "chains": "{.chains:,}",
    "µs/step": "{.microseconds:.3g}",
    "mean step / s": "{.step:.2e}",
    "rejected": "{.rejected:.1%}",
    "simulated s/s": "{.chain_seconds:.3g}",
    "error / m": "{.position_error:.1e}",
    "error / (m/s)": "{.velocity_error:.1e}",
}
WALKS: Final = {
    "method": "{.method}",
    "tolerance": "{.tolerance:g}",
    "walks": "{.walks:,}",
    "at rest": "{.at_rest:,}",
    "s": "{.seconds:.1f}",
    "walks/s": "{.walks_per_second:.3g}",
}
"""Heading of each column of a table → its text, filled in from a row."""


def bench(
    device: Annotated[str, typer.Option(metavar="NAME", help="cpu, cuda (the first GPU) or cuda:N.")] = "cpu",
    links: Annotated[
        list[int] | None,
        typer.Option(metavar="N", help="Links of the chains that fly; may be repeated. Default: 60 and 150."),
    ] = None,
    chains: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Chains that fly at a time. Default: 1, on a GPU 4000."),
    ] = None,
    rounds: Annotated[int, typer.Option(metavar="N", min=1, help="Flights of each method; medians are printed.")] = 5,
    walks: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Walks of the sweep. Default: 32, on a GPU 2000.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", parser=output_path, help="Write what --json prints to it, too."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object, in SI units but for µs, instead of tables.")
    ] = False,
) -> None:
    """Measure steps and errors of each method, and walks a second.

    A step is an attempted one of one chain in flight, at Table 1's values and the method's default tolerance. Errors
    are the greatest of a link's position and velocity after a millisecond, against SciPy's DOP853 at 1e-10 on a model
    in NumPy. Walks are those of 60 links at 15 Hz with the default method, kernels loaded before.
    """
    from warpchain.bench.flights import step_costs
    from warpchain.bench.machine import machine
    from warpchain.bench.walk_rate import walk_rate
    from warpchain.cli.terminal import json_value, status_line
    from warpchain.files import checked_output, write_whole
    from warpchain.inputs.options import Options, on_gpu
    from warpchain.inputs.scene import Scene, check_links_on_gpu
    from warpchain.inputs.validation import InputError, validated

    where = validated(Options, {"device": device}, "bench").device
    lengths = [validated(Scene, {"links": count}, "bench").links for count in links or (60, 150)]
    for count in lengths:
        check_links_on_gpu(count, where, "bench.links")
        if count % 2:
            raise InputError(f"bench.links: {count} is odd; inner and outer links alternate: give an even number")
    if output is not None:
        checked_output(output)
    about, many = machine(where), on_gpu(where)
    with status_line() as show:
        steps = step_costs(where, links=lengths, chains=chains or (4000 if many else 1), rounds=rounds, report=show)
        rate = walk_rate(where, walks or (2000 if many else 32), show)
    record = {
        "machine": about,
        "steps": [{name: json_value(value) for name, value in asdict(step).items()} for step in steps],
        "walks": asdict(rate),
    }
    text = json.dumps(record, indent=2, allow_nan=False)
    if output is not None:
        write_whole(output, text + "\n")
    if as_json:
        print(text)
        return
    _print(", ".join(f"{name} {value}" for name, value in about.items()), (STEPS, steps), (WALKS, [rate]))


def _print(heading: str, *tables: tuple[Mapping[str, str], Sequence[object]]) -> None:
    """Print tables on standard output, numbers to the right; a number that is NaN is left out."""
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else 130)
    console.print(heading)
    for columns, rows in tables:
        table = Table(box=None, pad_edge=False)
        for title, form in columns.items():
            table.add_column(title, justify="right" if ":" in form else "left")
        for row in rows:
            texts = [form.format(row) for form in columns.values()]
            table.add_row(*("" if text.startswith("nan") else text for text in texts))
        console.print()
        console.print(table)
