"""The imports between subpackages, and what the repository may hold; docs/architecture.md has the rules."""

import ast
import graphlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

import warpchain.kernels

ROOT = Path(__file__).parents[1]
HOST = sorted((ROOT / "warpchain").rglob("*.py"))
KERNELS = sorted((ROOT / "kernels").rglob("*.py"))
STUDIES = sorted((ROOT / "studies").rglob("*.py"))
LONGEST_FILE = 450

STOREYS = (
    ("cli",),
    ("bench",),
    ("live_page", "reports", "video"),
    ("run",),
    ("results",),
    ("pictures", "store"),
    ("sweeps",),
    ("walks",),
    ("engine", "loop"),
    ("hdf5_files",),
    ("chain",),
    ("inputs",),
    ("files", "status", "version"),
    ("kernels/cpu", "kernels/gpu"),
    ("kernels/events",),
    ("kernels/features",),
    ("kernels/contacts", "kernels/methods"),
    ("kernels/physics",),
    ("kernels/types",),
    ("kernels/layout", "kernels/codes", "kernels/hooks"),
)
"""Subpackages, from top to bottom: imports go downwards only."""
KERNELS_FOR_ALL = {"kernels/codes", "kernels/features", "kernels/layout", "kernels/methods"}
"""Subpackages of kernels/ that hold data; all others are for engine/ alone …"""
LAUNCHERS = {"warpchain.engine.batch", "warpchain.engine.devices"}
"""… which launches kernels."""
GPU_OR_NOT = "warpchain.engine.devices"
"""The only module that asks Warp whether a device is a GPU: what differs stands there, with a form for CPU fibers."""
LAUNCHES = ("launch", "launch_tiled", "capture_launch")


def module_of(path: Path) -> str:
    """Dotted name of a file's module."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    dotted = ".".join(("warpchain", *parts) if parts[0] == "kernels" else parts)
    return dotted.removesuffix(".__init__")


MODULES = {module_of(path): path for path in (*HOST, *KERNELS)}


def imports(source: str) -> set[str]:
    """Absolute names of all that a text imports, wherever in it: modules, and names out of modules.

    What is imported for type checkers alone counts: a reader follows it, too.
    """
    found, tree = set(), ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def real_graph() -> dict[str, set[str]]:
    """All modules of this project and those that they import."""
    graph = {}
    for module, path in MODULES.items():
        names = imports(path.read_text(encoding="utf-8"))
        graph[module] = MODULES.keys() & {name if name in MODULES else name.rpartition(".")[0] for name in names}
    return graph


def subpackage_of(module: str) -> str:
    """Subpackage of a module, kernels/NAME for one in kernels/; empty or kernels/ for the two packages themselves."""
    _, part, inner, *_ = [*module.split("."), "", ""]
    return f"kernels/{inner}" if part == "kernels" else part


def arrows() -> set[tuple[str, str]]:
    """Imports between subpackages."""
    pairs = {
        (subpackage_of(name), subpackage_of(target)) for name, targets in real_graph().items() for target in targets
    }
    return {(own, other) for own, other in pairs if own != other and not {own, other} & {"", "kernels/"}}


def tracked() -> list[str]:
    """Files of the repository, relative to its root."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    command = ["git", "-c", f"safe.directory={ROOT}", "ls-files", "-z"]
    listing = subprocess.run(command, cwd=ROOT, capture_output=True, check=True, encoding="utf-8").stdout
    return listing.split("\0")[:-1]


def test_every_module_has_a_subpackage() -> None:
    """The package finds its kernels at the top level; each module stands on a storey, and its package is installed."""
    assert len(HOST) > 50 and len(KERNELS) > 30
    assert (
        Path(warpchain.kernels.__file__) == ROOT / "kernels/__init__.py" and not (ROOT / "warpchain/kernels").exists()
    )
    known = {part for storey in STOREYS for part in storey} | {"", "__main__", "kernels/"}
    assert {subpackage_of(name) for name in MODULES} <= known
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    listed = set(re.findall(r'^    "(warpchain[\w.]*)",$', text, flags=re.MULTILINE))
    packages = {name for name, path in MODULES.items() if path.name == "__init__.py"}
    assert listed == packages | {"warpchain.shipped_sweeps"}


def test_there_are_no_symbolic_links() -> None:
    """A ZIP of the repository, and a checkout on a system without symbolic links, has every file."""
    assert not [name for name in tracked() if (ROOT / name).is_symlink()]


def test_imports_go_downwards() -> None:
    """No subpackage imports one above it, none what is not for it, and there is no circle."""
    level = {"__main__": -1} | {part: number for number, storey in enumerate(STOREYS) for part in storey}
    for own, other in arrows():
        assert level[other] > level[own], f"{own} imports {other}: not downwards"
        assert other != "bench" or own == "cli", f"{own} imports {other}: only cli may"
        of_kernels = not other.startswith("kernels/") or own.startswith("kernels/") or other in KERNELS_FOR_ALL
        assert of_kernels or own == "engine", f"{own} imports {other}: only engine may"
    graphlib.TopologicalSorter(real_graph()).prepare()  # a CycleError names a circle


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_study_takes_public_names_only(path: Path) -> None:
    """What studies import of the package or get as its attribute any user can reach; and their files are as short."""
    text = path.read_text(encoding="utf-8")
    taken = {name for name in imports(text) if name.startswith("warpchain") and name != "warpchain"}
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Attribute)]
    taken |= {ast.unparse(node) for node in nodes if ast.unparse(node.value) == "warpchain"}
    assert taken <= {f"warpchain.{name}" for name in warpchain.__all__}
    assert len(text.splitlines()) <= LONGEST_FILE


def test_the_drawing_shows_the_arrows() -> None:
    """Arrows between subpackages in docs/architecture.md are those of the code, no more and no fewer."""
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    drawn = set()
    for block in re.findall(r"```mermaid\n(.*?)```", text, flags=re.DOTALL):
        for left, right in re.findall(r"^ *([\w/ &]+?) *--> *([\w/ &]+?) *$", block, flags=re.MULTILINE):
            drawn |= {(one.strip(), other.strip()) for one in left.split("&") for other in right.split("&")}
    assert drawn == arrows()


def test_what_the_pages_name_exists() -> None:
    """Files, folders, functions and fields that docs/architecture.md names in code are in the tree."""
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    names = set(re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL)))
    code = "\n".join(path.read_text(encoding="utf-8") for path in (*HOST, *KERNELS))
    words = set(re.findall(r"\w+", code)) | {"warpchain", "kernels"} | {path.stem for path in ROOT.glob("docs/*.py")}
    files = [f"/{name}" for name in tracked()]
    for name in names:
        if "/" in name or name.endswith((".py", ".toml", ".md", ".json", ".html")):
            path = name.split(" ")[-1].split(".py:")[0]
            assert [file for file in files if f"/{path}" in file or file.endswith(f"/{path}")], f"no file {name}"
        elif re.fullmatch(r"[A-Za-z_][\w.]*", name):
            assert set(name.split(".")) <= words, f"no code is named {name}"


@pytest.mark.parametrize("path", [*HOST, *KERNELS], ids=module_of)
def test_a_file_is_short_and_knows_its_place(path: Path) -> None:
    """A file is one concept, which fits in so many lines; it knows no study, and a kernel neither NumPy nor the host.

    Only the engine launches.
    """
    text = path.read_text(encoding="utf-8")
    names = imports(text)
    assert not [name for name in names if name.startswith("studies")]
    foreign = {name.partition(".")[0] for name in names if not f"{name}.".startswith("warpchain.kernels.")}
    assert path not in KERNELS or foreign <= {"warp", *sys.stdlib_module_names}
    assert len(text.splitlines()) <= LONGEST_FILE
    calls = {ast.unparse(node.func) for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)}
    launches = calls & {f"{prefix}{name}" for prefix in ("wp.", "warp.", "") for name in LAUNCHES}
    assert not launches or module_of(path) in LAUNCHERS
    assert "is_cuda" not in text or module_of(path) == GPU_OR_NOT


def test_public_names() -> None:
    """Each is described and in `dir` before it is used; no submodule takes the place of a function."""
    assert len(warpchain.__all__) == len(set(warpchain.__all__))
    described = re.findall(r"^    (\w+)(?:\(.*?\))?  +\S", warpchain.__doc__ or "", re.MULTILINE)
    assert sorted(described) == sorted(warpchain.__all__)
    with pytest.raises(AttributeError, match="no attribute 'wlak'"):
        _ = warpchain.wlak
    modules = [module_of(path) for path in HOST if not path.stem.startswith("__")]
    program = (
        "import types, warpchain\n"
        "print(*(name for name in dir(warpchain) if not name.startswith('__')))\n"
        f"import {', '.join(modules)}\n"
        "names = warpchain.__all__\n"
        "print([name for name in names if isinstance(getattr(warpchain, name), types.ModuleType)])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    listed, taken = done.stdout.splitlines()
    assert set(listed.split()) == set(warpchain.__all__) and (taken, done.stderr) == ("['video']", "")


def test_importing_starts_and_loads_nothing() -> None:
    """Importing the package and looking up all of its names starts no device and loads no heavy library.

    What reads and prints results loads no Warp either.
    """
    program = (
        "import sys, warpchain\n"
        "light = set(sys.modules)\n"
        "import warpchain.cli.output, warpchain.results.sweep_result\n"
        "print('warp' in sys.modules)\n"
        "[getattr(warpchain, name) for name in warpchain.__all__]\n"
        "import warp._src.context\n"
        "print(sorted(light & {'warp', 'numpy', 'pydantic', 'yaml', 'rich', 'typer'}))\n"
        "print(sorted(set(sys.modules) & {'h5py', 'matplotlib', 'PIL', 'scipy', 'rich', 'typer'}))\n"
        "print(warp._src.context.runtime)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert (done.stdout, done.stderr) == ("False\n[]\n[]\nNone\n", "")


def test_tests_of_a_gpu_start_no_cpu() -> None:
    """They can be collected on a machine that has nothing but a GPU."""
    program = (
        "from warpchain.engine import devices\ndevices.start_device = None\nimport tests.kernels.gpu.test_on_gpu\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8", cwd=ROOT)
    assert done.returncode == 0, done.stderr


def test_texts_do_not_point_outside() -> None:
    """No file names a folder of the machine it was written on."""
    outside = ["/".join(("", "work", "")), "/".join(("shared", "")), "/".join(("", "tmp", "plan"))]
    for name in tracked():
        path = ROOT / name
        if path.is_file():
            text = path.read_bytes()
            assert not [word for word in outside if word.encode() in text], name
