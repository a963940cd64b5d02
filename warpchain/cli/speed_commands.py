"""The command `warpchain bench` without a subcommand: speed, on one core or on a GPU."""

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer


def bench(
    context: typer.Context,
    links: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N", help="Number of links; may be repeated. Default: 60 and 150, on a GPU 60 to 180 by 30."
        ),
    ] = None,
    device: Annotated[
        str, typer.Option(metavar="NAME", help="cpu, cuda or cuda:N: what one core takes, or many chains on a GPU.")
    ] = "cpu",
    methods: Annotated[
        list[str] | None,
        typer.Option(
            "--method",
            metavar="NAME",
            help="On a GPU, one integrator; may be repeated. Default: rkf78, dp5, bs32, os32.",
        ),
    ] = None,
    chains: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N", min=1, help="On a GPU, chains at a time; may be repeated. Default: 1, 132, 400, 1000 and 4000."
        ),
    ] = None,
    scenes: Annotated[
        list[str] | None,
        typer.Option("--scene", metavar="NAME", help="On a GPU, flight or pile; may be repeated. Default: both."),
    ] = None,
    rounds: Annotated[int, typer.Option(metavar="N", min=1, help="Measurements of each; medians are printed.")] = 7,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write what --json prints to this file, too.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object, units in its keys or in s, instead of tables.")
    ] = False,
) -> None:
    """Measure what integration costs: µs a step on one core beside SciPy's DOP853, or of many chains on a GPU."""
    if context.invoked_subcommand is not None:
        return
    from warpchain.cli.terminal import status_line
    from warpchain.inputs.options import Options
    from warpchain.inputs.scene import Scene, check_links_on_gpu
    from warpchain.inputs.validation import InputError, validated

    where = validated(Options, {"device": device}, "bench").device
    lengths = [validated(Scene, {"links": count}, "bench").links for count in links or ()]
    for count in lengths:
        check_links_on_gpu(count, where, "bench.links")
    if where == "cpu":
        for option, value in (("--method", methods), ("--chains", chains), ("--scene", scenes)):
            if value:
                raise InputError(f"{option}: only measurements on a GPU can be restricted so; add --device cuda")
        with status_line() as show:
            costs, print_tables = _bench_cpu(lengths or [60, 150], rounds, show)
    else:
        from warpchain.bench import gpu_steps
        from warpchain.cli.terminal import print_gpu_costs

        with status_line() as show:
            attempts = gpu_steps.gpu_costs(
                where,
                scenes=scenes or gpu_steps.SCENES,
                methods=methods or gpu_steps.METHODS,
                links=lengths or gpu_steps.LINKS,
                chains=chains or gpu_steps.CHAINS,
                rounds=rounds,
                report=show,
            )
        machine = gpu_steps.gpu_machine(where)
        costs, print_tables = gpu_steps.as_json(machine, attempts), partial(print_gpu_costs, machine, attempts)
    text = json.dumps(costs, indent=2, allow_nan=False)
    if output is not None:
        output.write_text(text + "\n", encoding="utf-8")
    if as_json:
        print(text)
    else:
        print_tables()


def _bench_cpu(
    lengths: Sequence[int], rounds: int, show: Callable[[str], None]
) -> tuple[dict[str, Any], Callable[[], None]]:
    """What one core takes, for JSON, and what prints it.

    Raises:
        InputError: SciPy is missing.
    """
    from importlib.util import find_spec

    from warpchain.inputs.validation import InputError

    if find_spec("scipy") is None:
        raise InputError("bench: SciPy is not installed; pip install 'warpchain[scipy]'")

    from warpchain.bench.cpu_steps import as_json, broad_phase_costs, machine, step_costs
    from warpchain.cli.terminal import print_costs

    steps = step_costs(lengths, rounds=rounds, report=show)
    lists = broad_phase_costs(rounds=rounds, report=show)
    return as_json(steps, lists), partial(print_costs, machine(), steps, lists)
