"""The package works when it is installed from its distributions, outside the repository, and when it is not."""

import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import warpchain
from tests.docs.code_blocks import ROOT
from tests.test_architecture import tracked
from warpchain.sweeps.plan import load_sweep

BUILD = "from setuptools import build_meta; print(build_meta.build_{}({!r}))"


def run(*command: str | Path, cwd: Path) -> str:
    """Standard output of a command, which must succeed; the repository is not on its path."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """The files under version control, as a ZIP download gives them: a symbolic link is a file that holds its text."""
    pytest.importorskip("setuptools", minversion="77", reason="the extra `test` has it")
    with zipfile.ZipFile(tmp_path / "tree.zip", "w") as archive:
        for name in tracked():
            if (path := ROOT / name).is_symlink():
                archive.writestr(name, os.readlink(path))
            elif path.exists():
                archive.write(path, name)
    shutil.unpack_archive(tmp_path / "tree.zip", tmp_path / "tree")
    return tmp_path / "tree"


def build(kind: str, source: Path) -> Path:
    """Path of the distribution that the build back end makes of a source tree: of a "wheel", "editable" or "sdist"."""
    folder = source.parent
    return folder / run(sys.executable, "-c", BUILD.format(kind, str(folder)), cwd=source).split()[-1]


def installed(wheel: Path, folder: Path) -> tuple[Path, Path]:
    """Python and folder of packages of a fresh environment with this wheel in it."""
    environment = folder / "environment"
    run(sys.executable, "-m", "venv", "--without-pip", environment, cwd=folder)
    python = environment / "bin/python"
    words = ("install", "-q", "--no-deps", "--no-index", wheel)
    run(sys.executable, "-m", "pip", "--python", python, *words, cwd=folder)
    packages = environment / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
    # Dependencies come from the running environment. Its own links to the repository are no packages and stay behind.
    others = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    (packages / "dependencies.pth").write_text("\n".join(others) + "\n", encoding="utf-8")
    return python, packages


WALK = """
import warpchain, warpchain.kernels as kernels
from warpchain.sweeps.sweep_file import shipped_sweeps
walk = warpchain.walk(links=30, frequency=5.0, preset="soft", start="ellipse", walk_limit=0.01)
print(warpchain.__file__, kernels.__file__, walk.simulated_time, *shipped_sweeps())
"""


def has_everything(words: list[str], root: Path, kernels: Path) -> bool:
    """Whether the output of `WALK` says that package and kernels come from these folders, and names all sweeps."""
    package, of_kernels, time, *sweeps = words
    expected = sorted(path.stem for path in (ROOT / "sweeps").iterdir())
    homes = (Path(package), Path(of_kernels)) == (root / "warpchain/__init__.py", kernels / "__init__.py")
    return homes and float(time) > 0 and sweeps == expected


@pytest.mark.slow
def test_a_zip_of_the_repository_installs_with_kernels_and_sweeps(tree: Path, tmp_path: Path) -> None:
    """Editable, the package is the tree; as a wheel, it has the very files that a wheel of the sdist has."""
    python, _ = installed(build("editable", tree), tmp_path)
    assert has_everything(run(python, "-c", WALK, cwd=tmp_path).split(), tree, tree / "kernels")
    with tarfile.open(sdist := build("sdist", tree)) as archive:
        archive.extractall(tmp_path / "unpacked", filter="data")
    again = build("wheel", tmp_path / "unpacked" / sdist.name.removesuffix(".tar.gz"))
    names = [zipfile.ZipFile(wheel).namelist() for wheel in (build("wheel", tree), again)]
    assert names[0] == names[1] and {"warpchain/shipped_sweeps/tilt.yaml", "warpchain/kernels/codes.py"} <= {*names[0]}


def test_a_zip_of_the_repository_runs_without_an_installation(tree: Path, tmp_path: Path) -> None:
    """Its folder on PYTHONPATH is enough, and no kernel is imported under a second name."""
    others = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    program = f"import sys\nsys.path[:0] = [{str(tree)!r}]\nsys.path += {others!r}\n{WALK}"
    assert has_everything(run(sys.executable, "-I", "-S", "-c", program, cwd=tmp_path).split(), tree, tree / "kernels")
    second = subprocess.run([sys.executable, "-c", "import kernels"], cwd=tree, capture_output=True, encoding="utf-8")
    assert "import warpchain.kernels, not kernels" in second.stderr


@pytest.mark.slow
def test_wheel_walks_outside_the_repository(tree: Path, tmp_path: Path) -> None:
    """A wheel made of the source distribution, alone in a fresh environment, shows its help and lets a chain walk."""
    with tarfile.open(sdist := build("sdist", tree)) as archive:
        archive.extractall(tmp_path, filter="data")
    python, packages = installed(build("wheel", tmp_path / sdist.name.removesuffix(".tar.gz")), tmp_path)
    home = run(
        python, "-c", "import warpchain, warpchain.kernels as k; print(warpchain.__file__, k.__file__)", cwd=tmp_path
    )
    assert all(Path(path).is_relative_to(packages) for path in home.split())
    command = python.with_name("warpchain")
    assert "Usage" in run(command, "--help", cwd=tmp_path)
    words = "walk --start ellipse --links 10 --frequency 3 --preset soft --json -o film"
    walk = json.loads(run(command, *words.split(), cwd=tmp_path))
    assert walk["status"] == "at_rest" and walk["scene"]["links"] == 10
    run(command, "animate", "film", "-o", "film/walk.html", cwd=tmp_path)
    assert (tmp_path / "film/walk.html").is_file()
    assert run(command, "sweep", "--new", "new.yaml", cwd=tmp_path) == "new.yaml\n"
    names = ["new.yaml", *(path.stem for path in (ROOT / "sweeps").iterdir())]
    program = f"from warpchain.sweeps.plan import load_sweep\nprint(*(load_sweep(name).digest() for name in {names}))"
    expected = [load_sweep(tmp_path / name if name == "new.yaml" else name).digest() for name in names]
    assert run(python, "-c", program, cwd=tmp_path).split() == expected


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
