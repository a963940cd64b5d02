"""Entries: kernels without a body, by which compiled step kernels are loaded and launched.

Warp takes longer to read and hash the source of a step kernel than to load what it compiled, and importing that source
takes as long again. So a compiled kernel is found by a name that stands for all it is compiled from, and its source is
only imported if it must be compiled.
"""

import functools
import hashlib
import inspect
import sys
import threading
from pathlib import Path

import warp as wp

import warpchain.kernels
from warpchain.kernels.features import COMPILER_FLAGS, Features
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.types import make_entry

_making = threading.Lock()
"""Held by the thread that makes a kernel: two that parse their source at once can fail (Python 3.11: SystemError)."""


def digest_of_sources() -> str:
    """SHA-256 of all source files of kernels, with their names."""
    root = Path(*warpchain.kernels.__path__)
    digest = hashlib.sha256()
    for path in sorted(path for path in root.rglob("*") if path.suffix in (".py", ".cpp")):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(root)} {len(content)}\n".encode() + content)
    return digest.hexdigest()


SOURCES = digest_of_sources()
"""What the source files were when this module was imported, before any of them that makes a kernel."""


def _given_by_scripts(features: Features) -> tuple[object, ...]:
    """What a kernel has of a script and not of the source files: a tableau's numbers, the file of another load."""
    tableau = find_method(features.method).tableau
    if features.load == "weight":
        return (tableau,)
    from warpchain.kernels.physics.load import LOADS

    return tableau, Path(inspect.getfile(LOADS[features.load].acceleration.func)).read_text(encoding="utf-8")


@functools.cache
def kernel_entry(features: Features, threads: int, registers: int | None) -> wp.Kernel:
    """The entry of a step kernel, in a module of its own.

    The name of the module stands for source files, features, options of the compiler, Python and Warp; the processor or
    the GPU's generation is in the names of files that Warp compiles. A kernel for CPUs has no bound on registers.
    """
    module = wp.Module("", None)
    options = {"block_dim": threads, "strip_hash": True, "cpu_compiler_flags": COMPILER_FLAGS}
    wp.set_module_options(options, module)
    parts = (SOURCES, features, *_given_by_scripts(features), threads, registers, sys.version, wp.__version__)
    text = repr((*parts, sorted(module.resolve_options(wp.config).items())))
    module.name = f"advance_{hashlib.sha256(text.encode()).hexdigest()[:32]}"
    return make_entry(module, is_block=registers is not None)


def step_module(features: Features, threads: int, registers: int | None) -> wp.Module:
    """The module with the step kernel of an entry, to be compiled; a `RuntimeError` if sources changed meanwhile."""
    with _making:
        if registers is None:
            from warpchain.kernels.cpu.loop import make_advance

            kernel = make_advance(features)
        else:
            from warpchain.kernels.gpu.loop import make_advance_block

            kernel = make_advance_block(features, threads, registers)
        if digest_of_sources() != SOURCES:
            raise RuntimeError("source files of kernels changed while this process ran; restart it")
        wp.set_module_options({"block_dim": threads, "strip_hash": True}, kernel.module)
        kernel.module.name = kernel_entry(features, threads, registers).module.name
        return kernel.module
