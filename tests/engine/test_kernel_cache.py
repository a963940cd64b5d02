"""Damage in the cache of compiled kernels is found before a kernel is loaded, whatever it hits."""

import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
KERNEL = """
import warp as wp
from warpchain.engine.devices import start_device
from warpchain.engine.kernel_cache import load_checked

@wp.kernel(enable_backward=False, module="unique", module_options={"block_dim": 1, "strip_hash": True})
def root(x: wp.array(dtype=wp.float64)):
    for i in range(x.shape[0]):
        x[i] = wp.sqrt(wp.sin(x[i]) + wp.float64(2.0)) / (x[i] * x[i] + wp.float64(1.0))

device = start_device("cpu").warp
x = wp.array([0.1 * i for i in range(20)], dtype=wp.float64, device=device)
load_checked(root.module, device, lambda: root.module)
wp.launch(root, dim=1, inputs=[x], device=device)
print(x.numpy().tobytes().hex())
"""
WALK = """
import warpchain
lean = {"method": "bs32", "self_contact": False, "frame_interval": None}  # a kernel that is compiled soon
walk = warpchain.walk(links=20, preset="soft", start="ellipse", walk_limit=0.05, **lean)
print(walk.center[-1, 0].hex())
"""


def computed(cache: Path, script: str = KERNEL) -> str:
    """What a process of its own prints that loads its kernels from this cache."""
    file = cache / f"script{len(script)}.py"
    file.write_text(script)
    done = subprocess.run(
        [sys.executable, str(file)],
        env=os.environ | {"WARP_CACHE_PATH": str(cache), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def flip(file: Path) -> None:
    """Flip a bit in the middle of a file."""
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0x10
    file.write_bytes(content)


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A cache with one kernel, and what it computes; two processes filled it at the same time."""
    folder = tmp_path_factory.mktemp("cache")
    with ThreadPoolExecutor(2) as both:
        first, second = both.map(computed, [folder, folder])
    assert first == second
    return folder, first


def compiled(cache: Path, suffix: str) -> Path:
    """The only file of a kind in a cache."""
    (file,) = cache.glob(f"*/wp_*/*{suffix}")
    return file


def cut(file: Path) -> None:
    """Cut a file in half."""
    os.truncate(file, file.stat().st_size // 2)


@pytest.mark.parametrize(("suffix", "damage"), [(".o", flip), (".o", cut), (".meta", Path.unlink)])
def test_what_is_damaged_is_compiled_anew(cache: tuple[Path, str], suffix: str, damage: Callable[[Path], None]) -> None:
    """A flipped bit, a cut and a missing file change no bit of what is computed: the kernel is written anew."""
    folder, expected = cache
    damage(compiled(folder, suffix))
    harmed = [file.read_bytes() for file in folder.glob(f"*/wp_*/*{suffix}")]
    assert computed(folder) == expected
    assert [compiled(folder, suffix).read_bytes()] != harmed


def test_what_fits_is_not_compiled_anew(cache: tuple[Path, str]) -> None:
    """A cache that fits its checksums is left as it is; a damaged list of checksums is made anew."""
    folder, expected = cache
    before = compiled(folder, ".o").stat().st_mtime_ns
    assert computed(folder) == expected
    assert compiled(folder, ".o").stat().st_mtime_ns == before
    (checksums,) = folder.glob("*/*.sha256")
    whole = checksums.read_bytes()
    checksums.write_bytes(whole[:20])
    assert computed(folder) == expected and len(checksums.read_bytes()) == len(whole)


def test_a_walk_compares_its_kernels(tmp_path: Path) -> None:
    """A walk with a damaged kernel in the cache is the same to the bit."""
    expected = computed(tmp_path, WALK)
    flip(compiled(tmp_path, ".o"))
    assert computed(tmp_path, WALK) == expected
