"""Options and arguments that several commands share."""

from pathlib import Path
from typing import Any

import typer

from warpchain.files import given_path


def output_path(text: str) -> Path:
    """The path of an option or argument; one that is empty, or is none, is refused with the option's name."""
    try:
        return given_path(text)
    except OSError as error:
        raise typer.BadParameter(str(error)) from None


def option(metavar: str, text: str, *names: str, **more: Any) -> Any:
    """An option with a value; the text of its help says its default."""
    return typer.Option(*names, metavar=metavar, help=text, show_default=False, **more)


def output(metavar: str, text: str, *names: str) -> Any:
    """The option -o, or that of other names, what a command writes."""
    return option(metavar, text, *(names or ("-o", "--output")), parser=output_path)


def argument(metavar: str, text: str, **more: Any) -> Any:
    """A positional argument."""
    return typer.Argument(metavar=metavar, help=text, show_default=False, **more)


JSON = typer.Option("--json", help="Print one JSON object, in SI units, instead of a table.")
