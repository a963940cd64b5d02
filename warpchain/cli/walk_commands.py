"""What the command line does with the file of a saved walk: its figures, its animation, the same walk again."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from warpchain.cli.output_paths import output_path

if TYPE_CHECKING:
    from warpchain.inputs.setup import Setup
    from warpchain.pictures.walk_shape import Kind


def plot_walk(path: Path, output: Path | None, kind: "Kind | None" = None) -> bool:
    """Draw every figure that a saved walk has something for, and say on stderr what is left out and why.

    Args:
        path: file of the walk.
        output: folder of the figures; None: that of the file.
        kind: the only figure to draw; None: all.

    Returns:
        Whether anything was drawn.

    Raises:
        InputError: the file is no walk, or the folder cannot be written to.
        OSError: a file cannot be read or written.
    """
    from warpchain.cli.terminal import try_folder
    from warpchain.files import make_folder
    from warpchain.inputs.validation import one_line, printable
    from warpchain.pictures.style import save_figure
    from warpchain.pictures.walk_shape import kinds_of
    from warpchain.walks.walk_result import load_walk

    walk, folder, drawn = load_walk(path), path.parent if output is None else output, False
    try_folder(folder)
    make_folder(folder)
    for each in kinds_of(walk) if kind is None else (kind,):
        target = folder / f"{each}.png"
        try:
            figure = walk.plot(each)
        except ValueError as error:
            print(one_line(f"{target}: not drawn; {error}"), file=sys.stderr)
            continue
        save_figure(figure, target)
        print(printable(str(target)))
        drawn = True
    return drawn


def animate(
    walk: Annotated[
        Path, typer.Argument(metavar="WALK.h5", help="A walk that `warpchain walk -o DIR` wrote.", show_default=False)
    ],
    output: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            parser=output_path,
            help="The file to write; its name ends in .gif, .mp4 or .html.",
            show_default=False,
        ),
    ],
    fps: Annotated[
        float,
        typer.Option(
            metavar="NUMBER", help="Pictures per second; in HTML the browser decides. Default: 30.", show_default=False
        ),
    ] = 30.0,
    slow: Annotated[
        float,
        typer.Option(metavar="NUMBER", help="Playing time per simulated time. Default: 4.", show_default=False),
    ] = 4.0,
) -> None:
    """Write a moving picture of a saved walk: GIF, MP4 or a page with a player."""
    from warpchain.inputs.validation import InputError, printable
    from warpchain.walks.walk_result import load_walk

    result = load_walk(walk)
    try:
        result.animate(output, fps=fps, slow=slow)
    except (ValueError, ImportError) as error:
        raise InputError(str(error)) from None
    print(printable(str(output)))


def setup_like(
    path: Path, given: Mapping[str, Mapping[str, object]], records_loads: bool
) -> "tuple[Setup, int | None]":
    """Setup of a saved walk with other values in place of some of its own, and its seed.

    A method that is given brings its own settings, and a tolerance also holds where joints are soft, as in a new walk.

    Args:
        path: file of the walk.
        given: section → field → value.
        records_loads: whether joint forces are recorded; `standard` then is another integrator.

    Raises:
        InputError: the file is no walk, or a value is refused.
        OSError: the file cannot be read.
    """
    from warpchain.inputs.methods import METHODS_BY_NEED
    from warpchain.inputs.parameters import warn_of_units
    from warpchain.inputs.setup import resolve
    from warpchain.walks.walk_result import load_walk

    saved = load_walk(path)
    options = given["options"]
    replaced = {"soft_tolerance"} if "tolerance" in options else set()
    if "method" in options:
        replaced |= {"tolerance", "soft_tolerance"}.union(*METHODS_BY_NEED.values())
    sections = {
        section: {**getattr(saved.setup, section).model_dump(exclude=replaced), **values}
        for section, values in given.items()
    }
    setup = resolve(
        saved.setup.preset,
        scene=sections["scene"],
        options=sections["options"],
        parameters=sections["parameters"],
        records_loads=records_loads,
    )
    warn_of_units((f"parameters.{name}", name, value) for name, value in given["parameters"].items())
    return setup, saved.seed
