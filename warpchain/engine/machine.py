"""What ran a walk, a sweep or `bench`, and when: command, system, processor, GPU and its driver, time."""

import contextlib
import datetime
import os
import platform
import re
import shlex
import sys
from collections.abc import Iterable
from pathlib import Path

from warpchain.engine.devices import Gpu, start_device
from warpchain.engine.processors import processors


def now() -> str:
    """The time in the notation of ISO 8601, to a second."""
    return datetime.datetime.now().astimezone().isoformat(timespec="seconds")


def made_by(devices: Iterable[str]) -> dict[str, str]:
    """The provenance of a result: the command of this process without the folders of its program, and the machine."""
    program, *arguments = sys.argv or [""]
    return {"command": shlex.join([os.path.basename(program) or "python", *arguments])[:1000], **machine_of(devices)}


def machine_of(devices: Iterable[str]) -> dict[str, str]:
    """System, processor, and the GPUs among some devices with their driver; an `InputError` if one is not there."""
    found = {
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
