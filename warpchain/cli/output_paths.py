"""Paths of what a command writes."""

from pathlib import Path

import typer

from warpchain.files import given_path


def output_path(text: str) -> Path:
    """The path of an option or argument; one that is empty, or is none, is refused with the option's name."""
    try:
        return given_path(text)
    except OSError as error:
        raise typer.BadParameter(str(error)) from None
