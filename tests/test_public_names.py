"""What `import warpchain` shows: public names, their descriptions, and a version that stands once."""

import re
import subprocess
import sys
from pathlib import Path

import warpchain

ROOT = Path(__file__).parents[1]


def run_python(program: str, *flags: str) -> str:
    """What a program prints in a new interpreter that finds this checkout."""
    start = f"import sys\nsys.path.insert(0, {str(ROOT)!r})\n"
    done = subprocess.run([sys.executable, *flags, "-c", start + program], capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_public_names_are_listed_before_they_are_used() -> None:
    """`dir(warpchain)` of a new interpreter has every public name, and nothing but these and module attributes."""
    names = run_python("import warpchain; print(*dir(warpchain))").split()
    assert {name for name in names if not name.startswith("__")} == set(warpchain.__all__)
    assert "__version__" in names


def test_public_names_are_described() -> None:
    """The module's documentation has a line for each public name."""
    described = re.findall(r"^    (\w+)(?:\(.*?\))?  +\S", warpchain.__doc__ or "", re.MULTILINE)
    assert sorted(described) == sorted(warpchain.__all__)


def test_a_checkout_without_metadata_runs() -> None:
    """Version and provenance need no installed warpchain."""
    program = (
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
    assert run_python(program).split() == [warpchain.__version__] * 2
