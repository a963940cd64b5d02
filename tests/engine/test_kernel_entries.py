"""Entries launch the kernels that they stand for, and have other names where those would be compiled anew."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import warp as wp

from warpchain.engine import kernel_entries
from warpchain.engine.kernel_entries import kernel_entry
from warpchain.kernels import layout
from warpchain.kernels.features import Features
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS

ROOT = Path(__file__).parents[2]
FEATURES = Features("dp5", layout.padded_width(60), "floor", True)


def test_what_would_be_compiled_anew_has_another_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Features, block, registers, sources, a method's numbers, Warp, Python, options of the compiler each change it."""

    def name(features: Features = FEATURES, threads: int = 1, registers: int | None = None) -> str:
        return kernel_entry.__wrapped__(features, threads, registers).module.name

    names = [name(), name(replace(FEATURES, tilts=True)), name(threads=64), name(threads=64, registers=128)]
    names.append(name(threads=64, registers=168))
    for target, attribute, value in (
        (kernel_entries, "SOURCES", "others"),
        (kernel_entries, "COMPILER_FLAGS", "-O1"),
        (wp, "__version__", "0"),
        (wp.config, "mode", "debug"),
        (sys, "version", "0"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(target, attribute, value)
            names.append(name())
    tableau = TABLEAUS["dp5"]
    monkeypatch.setitem(TABLEAUS, "dp5", replace(tableau, embedded=tableau.weights))
    names.append(name())
    monkeypatch.setitem(TABLEAUS, "dp5", tableau)
    assert len(set(names)) == len(names)
    assert name() == names[0]


def test_sources_that_changed_are_not_compiled(tmp_path: Path) -> None:
    """What was imported before is not what a name would stand for."""
    for folder in ("warpchain", "kernels"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    program = (
        "from warpchain.engine.kernel_entries import step_module\n"
        "from warpchain.kernels.features import Features\n"
        "with open('kernels/codes.py', 'a') as file: file.write('# changed')\n"
        "step_module(Features('dp5', 200, 'floor', True), 1, None)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1 and "changed while this process ran" in done.stderr


def test_a_cached_kernel_is_loaded_without_its_source() -> None:
    """The second of two processes imports no step loop."""
    program = (
        "import sys, warpchain\n"
        "warpchain.walk(links=20, preset='soft', start='ellipse', method='bs32', walk_limit=0.05)\n"
        "print([name for name in sys.modules if name.endswith(('cpu.loop', 'gpu.loop'))])\n"
    )
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert done.stdout == "[]\n"
