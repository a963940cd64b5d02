"""What ran a walk or a sweep, for the provenance of results: command, system, processor, GPU and its driver."""

import contextlib
import os
import platform
import re
import shlex
import sys
from collections.abc import Iterable
from pathlib import Path

from warpchain.engine.devices import Gpu, start_device
from warpchain.engine.processors import processors


def made_by(devices: Iterable[str]) -> dict[str, str]:
    """The command of this process without the folders of its program, and what names the machine, without its name.

    The GPUs among some devices are named with their driver; nothing else of the results depends on any of it.
    """
    program, *arguments = sys.argv or [""]
    found = {
        "command": shlex.join([os.path.basename(program) or "python", *arguments])[:1000],
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "processor": f"{_processor()}, {processors()} usable",
    }
    started = [start_device(device) for device in dict.fromkeys(devices)]
    if gpus := [device.warp.name for device in started if isinstance(device, Gpu) and device.warp.is_cuda]:
        found["GPU"] = ", ".join(gpus)
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
