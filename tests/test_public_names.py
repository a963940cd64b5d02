"""A checkout that is not installed."""

import subprocess
import sys
from pathlib import Path

import warpchain

ROOT = Path(__file__).parents[1]


def test_a_checkout_without_metadata_runs() -> None:
    """Version and provenance need no installed warpchain."""
    program = (
        f"import sys\nsys.path.insert(0, {str(ROOT)!r})\n"
        "import importlib.metadata as metadata\n"
        "found = metadata.version\n"
        "def version(name):\n"
        "    if name == 'warpchain':\n"
        "        raise metadata.PackageNotFoundError(name)\n"
        "    return found(name)\n"
        "metadata.version = version\n"
        "import warpchain\n"
        "walk = warpchain.walk(links=30, frequency=5.0, preset='soft', start='ellipse', walk_limit=0.01)\n"
        "print(warpchain.__version__, walk.versions['warpchain'])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert done.stdout.split() == [warpchain.__version__] * 2, done.stderr
