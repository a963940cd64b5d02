"""The package works when it is installed from its distributions, outside the repository, and when it is not."""

import json
import os
import shutil
import subprocess
import sys
import tarfile
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


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The source distribution, made from the files under version control."""
    pytest.importorskip("setuptools", minversion="77", reason="the extra `test` has it")
    folder = tmp_path_factory.mktemp("sdist")
    for name in tracked():
        target = folder / "source" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).exists():
            shutil.copy2(ROOT / name, target, follow_symlinks=False)
    name = run(sys.executable, "-c", BUILD.format("sdist", str(folder)), cwd=folder / "source").split()[-1]
    return folder / name


@pytest.mark.slow
def test_wheel_walks_outside_the_repository(sdist: Path, tmp_path: Path) -> None:
    """A wheel made of the source distribution, alone in a fresh environment, shows its help and lets a chain walk."""
    with tarfile.open(sdist) as archive:
        archive.extractall(tmp_path, filter="data")
    source = tmp_path / sdist.name.removesuffix(".tar.gz")
    wheel = tmp_path / run(sys.executable, "-c", BUILD.format("wheel", str(tmp_path)), cwd=source).split()[-1]
    environment = tmp_path / "environment"
    run(sys.executable, "-m", "venv", "--without-pip", environment, cwd=tmp_path)
    python = environment / "bin/python"
    run(
        sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index", wheel, cwd=tmp_path
    )
    packages = environment / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
    # Dependencies come from the running environment. Its own links to the repository are no packages and stay behind.
    others = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    (packages / "dependencies.pth").write_text("\n".join(others) + "\n", encoding="utf-8")
    home = run(
        python, "-c", "import warpchain, warpchain.kernels as k; print(warpchain.__file__, k.__file__)", cwd=tmp_path
    )
    assert all(Path(path).is_relative_to(packages) for path in home.split())
    command = environment / "bin/warpchain"
    assert "Usage" in run(command, "--help", cwd=tmp_path)
    words = "walk --start ellipse --links 10 --frequency 3 --preset soft --json"
    walk = json.loads(run(command, *words.split(), cwd=tmp_path))
    assert walk["status"] == "at_rest" and walk["scene"]["links"] == 10
    run(command, *words.replace("--json", "-o film").split(), cwd=tmp_path)
    run(command, "animate", "film", "-o", "film/walk.html", cwd=tmp_path)
    assert (tmp_path / "film/walk.html").is_file()
    assert run(command, "sweep", "--new", "new.yaml", cwd=tmp_path) == "new.yaml\n"
    for name in ("new.yaml", *(path.stem for path in (ROOT / "sweeps").iterdir())):
        program = f"from warpchain.sweeps.plan import load_sweep; print(load_sweep({name!r}).digest())"
        expected = load_sweep(tmp_path / name if name == "new.yaml" else name).digest()
        assert run(python, "-c", program, cwd=tmp_path) == f"{expected}\n"


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
