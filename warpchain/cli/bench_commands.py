"""The command `warpchain bench`: speed of steps, and its subcommands `accuracy` and `sweep`."""

import json
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from warpchain.cli.sweep_commands import SweepFile
from warpchain.cli.words import output_path

bench_app = typer.Typer()


@bench_app.callback(invoke_without_command=True)
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
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", parser=output_path, help="Write what --json prints to this file, too."
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object, units in its keys or in s, instead of tables.")
    ] = False,
) -> None:
    """Measure what integration costs: µs a step on one core beside SciPy's DOP853, or of many chains on a GPU."""
    if context.invoked_subcommand is not None:
        return
    from warpchain.bench.record import machine, plain
    from warpchain.cli.bench_tables import print_bench
    from warpchain.cli.terminal import status_line
    from warpchain.files import checked_output, write_whole
    from warpchain.inputs.options import Options
    from warpchain.inputs.scene import Scene, check_links_on_gpu
    from warpchain.inputs.validation import InputError, validated

    where = validated(Options, {"device": device}, "bench").device
    lengths = [validated(Scene, {"links": count}, "bench").links for count in links or ()]
    if output is not None:
        checked_output(output)
    tables: dict[str, Sequence[object]]
    if where == "cpu":
        for option, value in (("--method", methods), ("--chains", chains), ("--scene", scenes)):
            if value:
                raise InputError(f"{option}: only measurements on a GPU can be restricted so; add --device cuda")
        if find_spec("scipy") is None:
            raise InputError("bench: SciPy is not installed; pip install 'warpchain[scipy]'")
        from warpchain.bench.cpu_steps import broad_phase_costs, step_costs

        with status_line() as show:
            steps = step_costs(lengths or (60, 150), rounds=rounds, report=show)
            tables = {"steps": steps, "broad_phase": broad_phase_costs(rounds=rounds, report=show)}
        about, more = machine(), {}
    else:
        from warpchain.bench import gpu_steps

        for count in lengths:
            check_links_on_gpu(count, where, "bench.links")
        with status_line() as show:
            costs = gpu_steps.gpu_costs(
                where,
                scenes=scenes or gpu_steps.SCENES,
                methods=methods or gpu_steps.METHODS,
                links=lengths or gpu_steps.LINKS,
                chains=chains or gpu_steps.CHAINS,
                rounds=rounds,
                report=show,
            )
        tables, about = {"attempts": costs}, gpu_steps.gpu_machine(where)
        more = {"flops_per_attempt": {name: gpu_steps.flops_per_attempt(name) for name in gpu_steps.METHODS}}
    text = json.dumps(plain({"machine": about, **more, **tables}), indent=2, allow_nan=False)
    if output is not None:
        write_whole(output, text + "\n")
    if as_json:
        print(text)
    else:
        print_bench(about, *tables.items())


@bench_app.command()
def accuracy(
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            parser=output_path,
            help="Folder of the results; those of other parts are kept.",
        ),
    ],
    parts: Annotated[
        str, typer.Option(metavar="NAME,…", help="Parts to run.")
    ] = "work-precision,reversals,walks,ensembles,hard-cases",
    chosen: Annotated[
        str | None,
        typer.Option(
            "--methods",
            metavar="NAME[@TOL][+SETTING],…",
            help="standard, explicit, reference or integrators. In walks and ensembles @TOL sets the tolerance, by "
            "default 1e-6 (hybrid 1e-4) or that of the word, +NAME an option that is off by default and +NAME=NUMBER "
            "another, as in rkf78+soften_pile+soften_area=0.7. rkf78 at 1e-6, the reference, runs beside them in any "
            "case. Default: the three words, and every integrator with the settings of explicit.",
        ),
    ] = None,
    tolerances: Annotated[
        str | None, typer.Option(metavar="TOL,…", help="Of the work–precision diagrams. Default: 1e-3 … 1e-9.")
    ] = None,
    links: Annotated[
        str, typer.Option(metavar="N,…", help="Links, in all parts but reversals and hard-cases.")
    ] = "60,150",
    problems: Annotated[
        str, typer.Option(metavar="NAME,…", help="What the diagrams are about.")
    ] = "flight,impact,sprocket",
    presets: Annotated[str, typer.Option(metavar="NAME,…", help="Of the ensembles.")] = "soft,paper",
    start: Annotated[
        Literal["rest", "spinning", "ellipse"], typer.Option(help="How the chains of the ensembles start.")
    ] = "spinning",
    samples: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Walks of each ensemble. Default: 200, and 60 from 100 links on."),
    ] = None,
    device: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Where the ensembles run: cpu, cuda or cuda:N; the other parts are measured on one core.",
        ),
    ] = "cpu",
    tight: Annotated[
        bool,
        typer.Option(
            "--tight", help="Make ensembles of rkf78 at 1e-9 as well, which take longer still than the reference."
        ),
    ] = False,
    cases: Annotated[str | None, typer.Option(metavar="NAME,…", help="Hard cases. Default: all.")] = None,
    rounds: Annotated[
        int,
        typer.Option(
            metavar="N", min=1, help="Measurements of each run in the diagrams; walks of each that are timed."
        ),
    ] = 5,
    scipy: Annotated[bool, typer.Option(help="Run SciPy's DOP853 and Radau as well, which takes minutes.")] = True,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the results as one JSON object instead of the paths of the files.")
    ] = False,
) -> None:
    """Measure error against cost of every method, also where joints reverse; time and compare walks; run hard cases.

    Results go to accuracy.json, figures and a page beside it; what is run again replaces just its own rows. The table
    of reversals is printed as well. Ensembles are sweeps: killed ones go on. At release, chains below 100 links turn at
    15 Hz, longer ones at 20 Hz. The walks that are timed start as an ellipse at Table 1's values.
    """
    from warpchain.bench.accuracy.page import write_pictures_and_page
    from warpchain.bench.accuracy.plan import FILE, Plan, run_accuracy
    from warpchain.cli.bench_tables import print_table
    from warpchain.cli.terminal import status_line
    from warpchain.cli.walk_files import try_folder

    texts = {"parts": parts, "problems": problems, "presets": presets, "methods": chosen, "cases": cases}
    given: dict[str, Any] = {name: _words(f"--{name}", text) for name, text in texts.items() if text is not None}
    if tolerances is not None:
        given["tolerances"] = _numbers("--tolerances", tolerances)
    plan = Plan(
        **given,
        links=[int(number) for number in _numbers("--links", links, whole=True)],
        start=start,
        samples=samples,
        device=device,
        tight=tight,
        rounds=rounds,
        scipy=scipy,
    )
    try_folder(output)
    with status_line() as show:
        document = run_accuracy(output, plan, show)
        show("drawing")
        paths = write_pictures_and_page(output, document)
    if as_json:
        print((output / FILE).read_text(encoding="utf-8"))
        return
    if "reversals" in plan.parts and document["reversals"]:
        print_table("reversals", document["reversals"])
        print()
    from warpchain.inputs.validation import printable

    for path in (output / FILE, *paths):
        print(printable(str(path)))


@bench_app.command("tilting")
def tilting(
    device: Annotated[str, typer.Option(metavar="NAME", help="cpu, cuda or cuda:N.")] = "cpu",
    methods: Annotated[
        list[str] | None,
        typer.Option("--method", metavar="NAME", help="Explicit integrator; may be repeated. Default: dp5, os32."),
    ] = None,
    links: Annotated[
        list[int] | None, typer.Option(metavar="N", help="Number of links; may be repeated. Default: 60 and 150.")
    ] = None,
    chains: Annotated[
        list[int] | None,
        typer.Option(metavar="N", min=1, help="Chains at a time; may be repeated. Default: 1, on a GPU 400 and 4000."),
    ] = None,
    rounds: Annotated[int, typer.Option(metavar="N", min=1, help="Measurements of each; medians are printed.")] = 7,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of a table.")] = False,
) -> None:
    """Measure what a plane that tilts adds to a step, beside the same chains in a plane that is fixed."""
    from warpchain.bench.record import machine, plain
    from warpchain.bench.tilting_cost import tilting_costs
    from warpchain.cli.bench_tables import print_bench
    from warpchain.cli.terminal import status_line
    from warpchain.inputs.options import Options
    from warpchain.inputs.scene import Scene, check_links_on_gpu
    from warpchain.inputs.setup import check_can_tilt
    from warpchain.inputs.validation import validated

    chosen = methods or ["dp5", "os32"]
    for method in chosen:
        check_can_tilt(validated(Options, {"method": method, "device": device}, "bench"))
    lengths = [validated(Scene, {"links": count}, "bench").links for count in links or (60, 150)]
    for count in lengths:
        check_links_on_gpu(count, device, "bench.links")
    with status_line() as show:
        costs = tilting_costs(
            device,
            methods=chosen,
            links=lengths,
            chains=chains or ([1] if device == "cpu" else [400, 4000]),
            rounds=rounds,
            report=show,
        )
    if as_json:
        print(json.dumps(plain({"machine": machine(), "tilting": costs}), indent=2, allow_nan=False))
    else:
        print_bench(machine(), ("tilting", costs))


@bench_app.command("sweep")
def sweep(
    source: SweepFile,
    output: Annotated[
        Path,
        typer.Option(
            "-o",
            "--output",
            metavar="DIR",
            parser=output_path,
            help="Folder of the results, with a folder for each place.",
        ),
    ],
    devices: Annotated[
        str,
        typer.Option(
            metavar="[Kx]NAME[@N],…",
            help="Places to run on: cpu, one core; Kxcpu, K cores; cuda or cuda:N, a GPU; Kxcuda, K GPUs, a process "
            "for each, as --gpus K. @N takes N samples per cell there. Ratios are to the first place.",
        ),
    ],
    samples: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Samples per cell where @N does not say. Default: as the sweep says."),
    ] = None,
    rounds: Annotated[
        int, typer.Option(metavar="N", min=1, help="Runs on each place, in turn; medians are printed.")
    ] = 1,
    fresh: Annotated[bool, typer.Option("--fresh", help="Discard what an earlier measurement left in DIR.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print DIR/scaling.json, which is written in any case, instead of a table.")
    ] = False,
) -> None:
    """Run a sweep on several places: walks a second on one core, many, a GPU, several; whether their bits are equal.

    The clock runs from when every worker has its kernels loaded until the last walk is on disk.
    """
    from warpchain.bench.places import places_of
    from warpchain.bench.scaling import FILE, measure
    from warpchain.cli.bench_tables import print_bench
    from warpchain.cli.terminal import status_line
    from warpchain.cli.walk_files import try_folder

    places = places_of(_words("--devices", devices), samples)
    try_folder(output)
    with status_line() as show:
        scaling = measure(source, output, places, rounds=rounds, fresh=fresh, report=show)
    if as_json:
        print((output / FILE).read_text(encoding="utf-8"), end="")
    else:
        heading = f"{scaling.sweep}, medians of {scaling.rounds}, kernels loaded before"
        comparisons = ["\n".join(map(str, scaling.comparisons))] if scaling.comparisons else []
        print_bench(scaling.machine, heading, ("costs", scaling.costs), *comparisons)


def _words(option: str, text: str) -> list[str]:
    """The words of a list with commas.

    Raises:
        InputError: there are none.
    """
    from warpchain.inputs.validation import InputError

    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words:
        raise InputError(f"{option}: nothing in it; give names with commas between them, or leave it out")
    return words


def _numbers(option: str, text: str, *, whole: bool = False) -> list[float]:
    """The numbers of a list with commas.

    Raises:
        InputError: one is no number.
    """
    from warpchain.inputs.validation import InputError, shown

    numbers = []
    for word in _words(option, text):
        try:
            numbers.append(int(word) if whole else float(word))
        except ValueError:
            kind = "whole number" if whole else "number"
            raise InputError(f"{option}: {shown(word)} is no {kind}; give numbers with commas between them") from None
    return numbers
