"""The arrows between the modules, and what the repository may hold."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import warpchain

ROOT = Path(__file__).parents[1]
HOST = sorted(path for path in (ROOT / "warpchain").rglob("*.py") if "kernels" not in path.parts)
KERNELS = sorted((ROOT / "kernels").rglob("*.py"))
LAUNCHERS = {"batch.py", "cpu_steps.py"}
LAUNCHES = ("launch", "launch_tiled", "capture_launch")
LONGEST_FILE = 600
TOP_LEVEL = {
    ".ci",
    ".gitignore",
    ".pre-commit-config.yaml",
    ".readme",
    "CHANGELOG.md",
    "LICENSE",
    "README.md",
    "docs",
    "kernels",
    "pyproject.toml",
    "sweeps",
    "tests",
    "warpchain",
}


def imports(path: Path) -> set[str]:
    """Absolute names of all modules that a file imports, wherever in it; of a relative import, `.` and name."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level:
            found.add("." * node.level + (node.module or ""))
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def tracked() -> list[str]:
    """Files of the repository, relative to its root."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    command = ["git", "-c", f"safe.directory={ROOT}", "ls-files", "-z"]
    listing = subprocess.run(command, cwd=ROOT, capture_output=True, check=True, encoding="utf-8").stdout
    return listing.split("\0")[:-1]


def test_there_is_something_to_check() -> None:
    """The lists below are not empty, and the package finds its kernels at the top level."""
    assert len(HOST) > 5 and len(KERNELS) > 5
    assert (ROOT / "warpchain/kernels").resolve() == ROOT / "kernels"


@pytest.mark.parametrize("path", KERNELS, ids=lambda path: str(path.relative_to(ROOT)))
def test_kernels_know_only_warp_and_their_siblings(path: Path) -> None:
    """Kernels import warp, the standard library and one another: no NumPy, nothing of the host."""
    for name in imports(path):
        top = name.partition(".")[0]
        sibling = (name + ".").startswith("warpchain.kernels.")
        assert sibling or top == "warp" or top in sys.stdlib_module_names, name


@pytest.mark.parametrize("path", [*HOST, *KERNELS], ids=lambda path: str(path.relative_to(ROOT)))
def test_only_the_engine_launches(path: Path) -> None:
    """One host module launches kernels; the benchmark may, to time them."""
    calls = {
        ast.unparse(node.func)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call)
    }
    launches = {f"{module}{name}" for module in ("wp.", "warp.", "") for name in LAUNCHES}
    assert not calls & launches or path.name in LAUNCHERS


@pytest.mark.parametrize("path", [*HOST, *KERNELS], ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_is_too_long(path: Path) -> None:
    """A file is one concept, which fits in so many lines."""
    assert len(path.read_text(encoding="utf-8").splitlines()) <= LONGEST_FILE


def test_the_package_exports_little() -> None:
    """At most a dozen public names, each of them there."""
    assert len(warpchain.__all__) == len(set(warpchain.__all__)) <= 12
    for name in warpchain.__all__:
        assert getattr(warpchain, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'wlak'"):
        _ = warpchain.wlak


def test_public_names_survive_the_import_of_modules() -> None:
    """Importing a submodule does not put it in the place of a public function or class."""
    modules = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts) for path in HOST if not path.stem.startswith("__")
    ]
    program = (
        "import types, warpchain\n"
        f"import {', '.join(modules)}\n"
        "names = warpchain.__all__\n"
        "print([name for name in names if isinstance(getattr(warpchain, name), types.ModuleType)])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_importing_starts_and_loads_nothing() -> None:
    """Importing the package and looking up all of its names starts no device and loads no heavy library."""
    program = (
        "import sys, warpchain\n"
        "light = set(sys.modules)\n"
        "[getattr(warpchain, name) for name in warpchain.__all__]\n"
        "import warp._src.context\n"
        "print(sorted(light & {'warp', 'numpy', 'pydantic', 'yaml', 'rich', 'typer'}))\n"
        "print(sorted(set(sys.modules) & {'h5py', 'matplotlib', 'PIL', 'scipy', 'rich', 'typer'}))\n"
        "print(warp._src.context.runtime)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert (done.stdout, done.stderr) == ("[]\n[]\nNone\n", "")


def test_the_repository_holds_only_the_project() -> None:
    """The top level is fixed: no environment, cache or result is under version control."""
    assert {name.partition("/")[0] for name in tracked()} <= TOP_LEVEL


def test_texts_do_not_point_outside() -> None:
    """No file names a folder of the machine it was written on."""
    outside = ["/".join(("", "work", "")), "/".join(("shared", "")), "/".join(("", "tmp", "plan"))]
    for name in tracked():
        path = ROOT / name
        if name.partition("/")[0] in TOP_LEVEL and path.is_file():
            text = path.read_bytes()
            assert not [word for word in outside if word.encode() in text], name
