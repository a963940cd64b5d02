"""What a measurement was made on."""

import platform
from importlib.metadata import version
from pathlib import Path

import warp as wp

from warpchain.engine.devices import start_device, versions
from warpchain.engine.processors import processors
from warpchain.inputs.options import FIBERS, on_gpu


def machine(device: str) -> dict[str, str]:
    """Processor, operating system, GPU if the device is one, and versions.

    Args:
        device: ``"cpu"``, ``"cuda"``, ``"cuda:N"`` or ``"fibers"``.

    Raises:
        InputError: There is no such device.
    """
    found = start_device(device).warp
    about = {"processor": _processor(), "processors": str(processors()), "system": platform.system()}
    if on_gpu(device) and device != FIBERS:
        driver = ".".join(map(str, wp.get_cuda_driver_version()))
        about |= {"GPU": found.name, "multiprocessors": str(found.sm_count), "CUDA driver": driver}
    return about | versions() | {"scipy": version("scipy")}


def _processor() -> str:
    """Model of the processor, as far as the system tells."""
    listing = Path("/proc/cpuinfo")
    lines = listing.read_text(encoding="utf-8").splitlines() if listing.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()
