"""The command `warpchain bench`."""

import json
from typing import Annotated, Final

import typer

from warpchain.cli.words import JSON, option

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
}
"""Heading of each column of a table → its text, filled in from a row."""


def bench(
    device: Annotated[str, typer.Option(metavar="NAME", help="cpu, cuda (the first GPU) or cuda:N.")] = "cpu",
    links: Annotated[
        list[int] | None, option("N", "Links of the chains that fly; may be repeated. Default: 60 and 150.")
    ] = None,
    as_json: Annotated[bool, JSON] = False,
) -> None:
    """Measure steps and errors of each method, and walks a second.

    A step is an attempted one of one chain in flight, of 4000 side by side on a GPU, at Table 1's values and the
    method's default tolerance. Errors are the greatest of a link's position and velocity after a millisecond, against
    SciPy's DOP853 at 1e-10 on a model in NumPy. Walks are those of 60 links at 15 Hz with the default method, kernels
    loaded before.
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
            raise InputError(f"bench.links: {count} is odd; inner and outer links alternate: give an even number")
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
