"""What the benchmarks print on a terminal: the machine, tables and lines."""

import math
import sys
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, Final

from rich.console import Console
from rich.table import Table

WIDE: Final = 130
"""Columns of a line where there is no terminal to ask."""

TABLES: Final = {
    "steps": {
        "scene": "{.scene}",
        "links": "{.links}",
        "method": "{.method}",
        "µs/attempt": "{.microseconds:.2f}",
        "ns/link/stage": "{.per_link_stage:.2f}",
        "step µs": "{.step_microseconds:.3g}",
        "rejected": "{.rejected:.1%}",
        "s/s": "{.wall_per_simulated:.3g}",
    },
    "broad_phase": {
        "neighbour list: links": "{.links:d}",
        "pairs": "{.pairs:d}",
        "grid µs": "{.grid_microseconds:.1f}",
    },
    "attempts": {
        "scene": "{.scene}",
        "links": "{.links}",
        "method": "{.method}",
        "chains": "{.chains:d}",
        "µs/attempt": "{.microseconds:.2f}",
        "link stages/s": "{.link_stages:.2e}",
        "chain·s/s": "{.chain_seconds:.3g}",
        "rejected": "{.rejected:.1%}",
        "registers": "{.registers:d}",
        "spilled B": "{.spilled:d}",
        "blocks": "{0.blocks:d} ({0.occupancy:.0%})",
        "of peak": "{.peak:.0%}",
    },
    "reversals": {
        "start": "{.start}",
        "ω_c": "{.friction_smoothing:g}",
        "method": "{.method}",
        "tolerance": "{.tolerance:g}",
        "attempts": "{.attempts:,.0f}",
        "error of ω, rad/s": "{.error:.1e}",
        "greatest": "{.greatest_error:.1e}",
        "references": "{.trust:.1e}",
        "step error / tolerance": "{.step_error:.2g}",
    },
    "tilting": {
        "scene": "{.scene}",
        "links": "{.links}",
        "method": "{.method}",
        "chains": "{.chains:d}",
        "fixed µs/attempt": "{.fixed_microseconds:.2f}",
        "tilting µs/attempt": "{.tilting_microseconds:.2f}",
        "ratio": "{.ratio:.2f}",
    },
    "costs": {
        "place": "{.name}",
        "methods": "{.methods}",
        "walks": "{.walks:,}",
        "not at rest": "{.not_at_rest:,}",
        "s": "{.seconds:.1f}",
        "walks/s": "{.walks_per_second:.3g}",
        "simulated s/s": "{.simulated_per_second:.3g}",
        "processor s": "{.processor_seconds:.1f}",
        "ratio": "{.ratio:.2f}",
        "loading s": "{.loading_seconds:.1f}",
    },
}
"""Name of a table in the JSON of a benchmark → heading of each column → its text, filled in from a row.

s/s is wall time per simulated time, /s is per second of wall time.
"""


def print_bench(machine: Mapping[str, str], *parts: str | tuple[str, Sequence[object]]) -> None:
    """Print on standard output what a benchmark measured, with empty lines between the parts.

    Args:
        machine: Name and value of all that is known of the machine.
        parts: Lines, or a name in :data:`TABLES` with the rows of that table.
    """
    console = _console()
    console.print(", ".join(f"{name} {value}" for name, value in machine.items()))
    for part in parts:
        console.print()
        console.print(part if isinstance(part, str) else _table(TABLES[part[0]], part[1]))


def print_table(name: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Print one of :data:`TABLES` on standard output.

    Args:
        name: Its key.
        rows: Its rows as JSON has them: null is no number, and left out.
    """
    filled = [{key: math.nan if value is None else value for key, value in row.items()} for row in rows]
    _console().print(_table(TABLES[name], [SimpleNamespace(**row) for row in filled]))


def _console() -> Console:
    """Standard output, wide where it is no terminal."""
    return Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else WIDE)


def _table(columns: Mapping[str, str], rows: Sequence[object]) -> Table:
    """A table; columns with a number format are justified to the right, and a number that is NaN is left out."""
    table = Table(box=None, pad_edge=False)
    for heading, form in columns.items():
        table.add_column(heading, justify="right" if ":" in form else "left")
    for row in rows:
        texts = [form.format(row) for form in columns.values()]
        table.add_row(*("" if text.startswith("nan") else text for text in texts))
    return table
