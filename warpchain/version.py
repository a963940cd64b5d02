"""The versions of warpchain, of its numbers and of its files, and those of the software that its numbers depend on."""

from typing import Final

VERSION: Final = "0.2.0.dev0"

NUMERICS_VERSION: Final = 20
"""Raised by every change that changes a number of any walk; shards of two versions never mix.

19: on a CPU links of a tilting plane fall by its loads in the middle of a step, mean Δx 0.003 ± 0.020 %; on a GPU one
kernel carries chains on the sprocket and on the floor, which changes roundings.
"""
FORMAT_VERSION: Final = 11
"""Of all files of results: sweep.h5, shards, merged files and walks."""


def package_versions() -> dict[str, str]:
    """Versions of all that may change a number, for the provenance of a result; warpchain need not be installed."""
    from importlib.metadata import version  # takes longer to import than the package does
    from platform import python_version

    return {"warpchain": VERSION, **{n: version(n) for n in ("warp-lang", "numpy")}, "python": python_version()}
