"""Damage in the cache of compiled kernels is found before a kernel is loaded, whatever it hits."""

import hashlib
import json
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from warpchain.chain.resolution import resolve
from warpchain.run.sweep_run import kinds_of_kernels
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.sweep_file import shipped_sweeps
from warpchain.walks.walk_phases import phase_features

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
NO_COMPILER = """
import os, warp
warp.compile_aot_module = lambda *_, **__: (print("compiled anew", flush=True), os._exit(0))
"""
"""Begins a program that says so and ends where it would compile a kernel, which takes long."""
NAMESPACE = ("unshare", "--mount", "--map-root-user", "sh", "-c")
READ_ONLY = (*NAMESPACE, 'mount --bind "$1" "$1" && mount -o remount,bind,ro "$1" && exec $0')
FULL = (*NAMESPACE, 'cp -rT "$1" "$1+" && mount -t tmpfs -o size=2m tmpfs "$1" && cp -r "$1+/." "$1" && exec $0')
"""Shells that run a command, $0, while the folder $1 is read-only, or full but for 2 MB."""


def computed(cache: Path, script: str = KERNEL, within: Sequence[str] = ()) -> str:
    """What a process of its own prints that loads its kernels from this cache, maybe within a shell that mounts it."""
    file = cache / f"script{len(script)}.py"
    file.write_text(script)
    done = subprocess.run(
        [*within, f"{sys.executable} {file}", str(cache)] if within else [sys.executable, str(file)],
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


def test_headers_that_a_process_has_read_serve_others(cache: tuple[Path, str]) -> None:
    """They are read once, and anew if they are damaged."""
    folder, expected = cache
    (kept,) = folder.glob("*/headers_*/*")
    flip(kept)
    compiled(folder, ".o").unlink()
    assert computed(folder) == expected
    assert kept.read_bytes()[:32] == hashlib.sha256(kept.read_bytes()[32:]).digest()


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


def test_a_complete_cache_that_cannot_be_written_is_used(cache: tuple[Path, str], tmp_path: Path) -> None:
    """On a read-only file system what is whole in the cache runs; what is missing or damaged is refused in one line."""
    folder, expected = cache
    if shutil.which("unshare") is None or subprocess.run([*READ_ONLY, "true", folder]).returncode != 0:
        pytest.skip("needs a mount namespace")
    shutil.copytree(folder, kept := tmp_path / "kept")
    assert computed(kept) == expected
    assert computed(kept, within=READ_ONLY) == expected
    flip(compiled(kept, ".o"))
    with pytest.raises(
        AssertionError, match=rf"InputError: WARP_CACHE_PATH: {kept}/\S+: Read-only file system; name a"
    ):
        computed(kept, within=READ_ONLY)


def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    """Without room for a kernel nothing is compiled: an `OSError` in one line, and nothing is left in the cache."""
    if shutil.which("unshare") is None or subprocess.run([*FULL, "true", tmp_path]).returncode != 0:
        pytest.skip("needs a mount namespace")
    program = KERNEL.replace("load_checked(", "try:\n    load_checked(").replace(
        "wp.launch(",
        "except OSError as error:\n    import pathlib, sys\n    left = pathlib.Path(wp.config.kernel_cache_dir)\n"
        "    print(error, *(path for path in left.rglob('*') if path.is_file() and path.stat().st_size))\n"
        "    sys.exit()\nwp.launch(",
    )
    line = computed(tmp_path, program, within=FULL)
    assert line.startswith(str(tmp_path)) and line.endswith(
        ": No space left on device; make room for kernels, or set WARP_CACHE_PATH\n"
    )


def test_a_walk_finds_what_compile_made_and_compares_it(cache: tuple[Path, str], tmp_path: Path) -> None:
    """After `compile` of a sweep its walks find every kernel; one that is damaged would be compiled anew."""
    for read_headers in cache[0].glob("*/headers_*"):  # of the other cache, so that they need not be read again
        shutil.copytree(read_headers, tmp_path / read_headers.relative_to(cache[0]))
    lean = {"method": "bs32", "self_contact": False}
    scene = {"links": 20, "start": "ellipse", "frequency": 3.0, "walk_limit": 0.05}
    sweep = {"version": 1, "name": "lean", "seed": 1, "preset": "soft", "samples": 1, "scene": scene, "options": lean}
    (tmp_path / "lean.yaml").write_text(json.dumps(sweep))
    program = f"from warpchain.cli.main import main\nmain(['compile', {str(tmp_path / 'lean.yaml')!r}])"
    assert computed(tmp_path, program) == "lean: kernels compiled\n"
    kernel = compiled(tmp_path, ".o")
    made = kernel.stat().st_mtime_ns
    assert math.isfinite(float.fromhex(computed(tmp_path, WALK)))
    assert compiled(tmp_path, ".o").stat().st_mtime_ns == made
    flip(kernel)
    assert computed(tmp_path, NO_COMPILER + WALK) == "compiled anew\n"


def test_shipped_sweeps_have_the_kernels_of_usual_walks() -> None:
    """`compile` without a file serves the walks of the README: from rest, spinning, from an ellipse, and tilting."""
    planned = [load_sweep(name) for name in shipped_sweeps()]
    known = {each for sweep in planned for setup in kinds_of_kernels(sweep) for each in phase_features(setup).values()}
    for scene in ({"links": 60}, {"links": 60, "start": "spinning"}, {"links": 30, "start": "ellipse"}):
        setup = resolve("paper", scene={"frequency": 15.0, **scene}, options={}, parameters={})
        assert {*phase_features(setup).values()} <= known, scene
