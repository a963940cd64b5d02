"""The arrows between wings and modules, and what the repository may hold; the rules stand in docs/architecture.md."""

import ast
import graphlib
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

import warpchain

ROOT = Path(__file__).parents[1]
HOST = sorted(path for path in (ROOT / "warpchain").rglob("*.py") if "kernels" not in path.relative_to(ROOT).parts)
KERNELS = sorted((ROOT / "kernels").rglob("*.py"))
STUDIES = sorted((ROOT / "studies").rglob("*.py"))
LONGEST_FILE = 450

STOREYS = (
    ("cli",),
    ("bench",),
    ("films", "reports"),
    ("run",),
    ("store",),
    ("sweeps",),
    ("walks",),
    ("engine", "pictures"),
    ("loop",),
    ("hdf5_files",),
    ("inputs",),
    ("files", "status", "version"),
    ("kernels",),
)
"""Wings of warpchain/, from top to bottom: imports go downwards only."""
KERNEL_STOREYS = (
    ("cpu", "gpu"),
    ("events",),
    ("contacts", "methods"),
    ("physics",),
    ("types",),
    ("layout", "codes", "features"),
)
"""The same of kernels/."""
KERNELS_FOR_ALL = {"codes", "features", "layout", "methods"}
"""Wings of kernels/ that hold data; all others are for engine/ alone …"""
LAUNCHERS = {"warpchain.engine.batch", "warpchain.engine.devices"}
"""… which launches kernels."""
GPU_OR_NOT = "warpchain.engine.devices"
"""The only module that asks Warp whether a device is a GPU: what differs stands there, with a form for CPU fibers."""
LAUNCHES = ("launch", "launch_tiled", "capture_launch")
Graph = Mapping[str, Iterable[str]]
"""What each module imports."""


def module_of(path: Path) -> str:
    """Dotted name of a file's module."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    dotted = ".".join(("warpchain", *parts) if parts[0] == "kernels" else parts)
    return dotted.removesuffix(".__init__")


MODULES = {module_of(path): path for path in (*HOST, *KERNELS)}


def imports(source: str) -> set[str]:
    """Absolute names of all that a text imports, wherever in it: modules, and names out of modules.

    What is imported for type checkers alone is no arrow: nothing of it is there when the program runs.
    """
    found, tree = set(), ast.parse(source)
    for branch in [node for node in ast.walk(tree) if isinstance(node, ast.If)]:
        if ast.unparse(branch.test) == "TYPE_CHECKING":
            branch.body = [ast.Pass()]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def imported_modules(source: str) -> set[str]:
    """Modules of this project among what a text imports."""
    names = {name if name in MODULES else name.rpartition(".")[0] for name in imports(source)}
    return {name for name in names if name in MODULES}


def real_graph() -> dict[str, set[str]]:
    """All modules and what they import."""
    return {name: imported_modules(path.read_text(encoding="utf-8")) for name, path in MODULES.items()}


def wing_of(module: str) -> str:
    """Wing of a module; of the package itself the empty name."""
    return [*module.split("."), ""][1]


def kernel_wing_of(module: str) -> str:
    """Wing of a module in kernels/; of others the empty name."""
    return [*module.split("."), "", ""][2] if wing_of(module) == "kernels" else ""


def arrows(graph: Graph) -> set[tuple[str, str]]:
    """Imports between wings, those of kernels/ as kernels/NAME."""
    found = set()
    for module, targets in graph.items():
        for target in targets:
            wings = [
                f"kernels/{kernel_wing_of(name)}" if wing_of(name) == "kernels" else wing_of(name)
                for name in (module, target)
            ]
            if wings[0] != wings[1] and "" not in wings and "kernels/" not in wings:
                found.add((wings[0], wings[1]))
    return found


def violations(graph: Graph) -> list[str]:
    """Imports that break a rule, each with the rule."""
    level = {wing: number for number, storey in enumerate(STOREYS) for wing in storey}
    kernel_level = {wing: number for number, storey in enumerate(KERNEL_STOREYS) for wing in storey}
    found = []
    for module, targets in graph.items():
        wing, own = wing_of(module), kernel_wing_of(module)
        for target in targets:
            other, inner = wing_of(target), kernel_wing_of(target)
            if wing == other == "kernels":
                if own and inner and own != inner and kernel_level[inner] <= kernel_level[own]:
                    found.append(f"{module} imports {target}: not downwards")
            elif wing in level and other in level and wing != other and level[other] <= level[wing]:
                found.append(f"{module} imports {target}: not downwards")
            elif other == "bench" and wing not in ("bench", "cli"):
                found.append(f"{module} imports {target}: only cli may")
            elif other == "kernels" and inner not in {"", *KERNELS_FOR_ALL} and wing not in ("kernels", "engine"):
                found.append(f"{module} imports {target}: only engine may")
    return found


def launches(source: str) -> set[str]:
    """Calls in a text that launch kernels."""
    calls = {ast.unparse(node.func) for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)}
    return calls & {f"{prefix}{name}" for prefix in ("wp.", "warp.", "") for name in LAUNCHES}


def foreign(source: str) -> list[str]:
    """What a kernel module imports beside Warp, the standard library and its siblings."""
    tops = {name.partition(".")[0] for name in imports(source) if not f"{name}.".startswith("warpchain.kernels.")}
    return sorted(top for top in tops if top != "warp" and top not in sys.stdlib_module_names)


def private(source: str) -> list[str]:
    """What a study takes of warpchain that is no public name, whether imported or got as an attribute."""
    found = [name for name in imports(source) if name.startswith("warpchain") and name != "warpchain"]
    nodes = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Attribute)]
    found += [ast.unparse(node) for node in nodes if ast.unparse(node.value) == "warpchain"]
    return sorted({name for name in found if name.removeprefix("warpchain.") not in warpchain.__all__})


def tracked() -> list[str]:
    """Files of the repository, relative to its root."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    command = ["git", "-c", f"safe.directory={ROOT}", "ls-files", "-z"]
    listing = subprocess.run(command, cwd=ROOT, capture_output=True, check=True, encoding="utf-8").stdout
    return listing.split("\0")[:-1]


def test_every_module_has_a_wing() -> None:
    """The package finds its kernels at the top level; each module stands on a storey, and its package is installed."""
    assert len(HOST) > 50 and len(KERNELS) > 30
    assert (ROOT / "warpchain/kernels").resolve() == ROOT / "kernels"
    assert {wing_of(name) for name in MODULES} <= {wing for storey in STOREYS for wing in storey} | {"", "__main__"}
    assert {kernel_wing_of(name) for name in MODULES} <= {wing for storey in KERNEL_STOREYS for wing in storey} | {""}
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    listed = set(re.findall(r'^    "(warpchain[\w.]*)",$', text, flags=re.MULTILINE))
    assert listed == {name for name, path in MODULES.items() if path.name == "__init__.py"}


def test_imports_go_downwards() -> None:
    """No wing imports one above it, none what is not for it, and there is no circle."""
    graph = real_graph()
    assert violations(graph) == []
    graphlib.TopologicalSorter(graph).prepare()  # a CycleError names a circle


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_study_takes_public_names_only(path: Path) -> None:
    """What studies need of the package is what any user can reach; and their files are as short."""
    text = path.read_text(encoding="utf-8")
    assert private(text) == []
    assert len(text.splitlines()) <= LONGEST_FILE


def test_the_package_knows_no_study() -> None:
    """Neither the host nor a kernel imports one."""
    for path in MODULES.values():
        assert not [name for name in imports(path.read_text(encoding="utf-8")) if name.startswith("studies")], path


def test_the_drawing_shows_the_arrows() -> None:
    """Arrows between wings in docs/architecture.md are those of the code, no more and no fewer."""
    text = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")
    drawn = set()
    for block in re.findall(r"```mermaid\n(.*?)```", text, flags=re.DOTALL):
        for left, right in re.findall(r"^ *([\w/ &]+?) *--> *([\w/ &]+?) *$", block, flags=re.MULTILINE):
            drawn |= {(one.strip(), other.strip()) for one in left.split("&") for other in right.split("&")}
    assert drawn == arrows(real_graph())


@pytest.mark.parametrize("path", KERNELS, ids=module_of)
def test_kernels_know_only_warp_and_their_siblings(path: Path) -> None:
    """Kernels import warp, the standard library and one another: no NumPy, nothing of the host."""
    assert foreign(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("path", [*HOST, *KERNELS], ids=module_of)
def test_a_file_is_short_and_does_not_launch(path: Path) -> None:
    """A file is one concept, which fits in so many lines; only the engine launches, and what times it."""
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST_FILE
    assert not launches(text) or module_of(path) in LAUNCHERS
    assert "is_cuda" not in text or module_of(path) == GPU_OR_NOT


def test_the_package_exports_little() -> None:
    """At most sixteen public names, each of them there."""
    assert len(warpchain.__all__) == len(set(warpchain.__all__)) <= 16
    for name in warpchain.__all__:
        assert getattr(warpchain, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'wlak'"):
        _ = warpchain.wlak


def test_public_names_survive_the_import_of_modules() -> None:
    """Importing a submodule does not put it in the place of a public function or class; `films` is a module."""
    modules = [module_of(path) for path in HOST if not path.stem.startswith("__")]
    program = (
        "import types, warpchain\n"
        f"import {', '.join(modules)}\n"
        "names = warpchain.__all__\n"
        "print([name for name in names if isinstance(getattr(warpchain, name), types.ModuleType)])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, encoding="utf-8")
    assert (done.stdout, done.stderr) == ("['films']\n", "")


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


def test_texts_do_not_point_outside() -> None:
    """No file names a folder of the machine it was written on."""
    outside = ["/".join(("", "work", "")), "/".join(("shared", "")), "/".join(("", "tmp", "plan"))]
    for name in tracked():
        path = ROOT / name
        if path.is_file():
            text = path.read_bytes()
            assert not [word for word in outside if word.encode() in text], name
