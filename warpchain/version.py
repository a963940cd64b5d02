"""The version of warpchain, which stands here only, and those of the software that its numbers depend on."""

from typing import Final

VERSION: Final = "0.1.0"


def package_versions() -> dict[str, str]:
    """Versions of warpchain and of the packages that may change a number; warpchain need not be installed."""
    from importlib.metadata import version  # takes longer to import than the package does

    return {"warpchain": VERSION, **{name: version(name) for name in ("warp-lang", "numpy")}}
