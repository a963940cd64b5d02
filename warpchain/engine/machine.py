"""What ran a walk, a sweep or `bench`: command, system, processor, GPU and its driver."""

import contextlib
import os
import platform
import re
import shlex
import sys
from collections.abc import Iterable
from pathlib import Path

from warpchain.engine.devices import start_device
from warpchain.engine.processors import processors
from warpchain.inputs.options import FIBERS, on_gpu


def own_command() -> str:
    """The command of this process, without the folders of its program."""
    program, *arguments = sys.argv or [""]
    return shlex.join([os.path.basename(program) or "python", *arguments])[:1000]


def machine_text(devices: Iterable[str]) -> str:
    """`machine_of` in one line."""
    return "; ".join(f"{name}: {value}" for name, value in machine_of(devices).items())


def machine_of(devices: Iterable[str]) -> dict[str, str]:
    """System, processor, and the GPUs among some devices with their driver; an `InputError` if one is not there."""
    found = {
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "processor": f"{_processor()}, {processors()} usable",
    }
    gpus = [device for device in dict.fromkeys(devices) if on_gpu(device) and device != FIBERS]
    if gpus:
        found["GPU"] = ", ".join(start_device(device).warp.name for device in gpus)
        with contextlib.suppress(OSError, AttributeError):  # of Linux
            text = Path("/proc/driver/nvidia/version").read_text()
            found["driver"] = re.search(r"\d+(\.\d+)+", text)[0]  # type: ignore[index]
    return found


def _processor() -> str:
    """Name of the processor's model."""
    with contextlib.suppress(OSError):
        if found := re.search(r"^model name\s*: (.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE):
            return found[1].strip()
    return platform.processor() or platform.machine()
