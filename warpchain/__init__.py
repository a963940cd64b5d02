"""warpchain: ensembles of walking roller chains on NVIDIA Warp.

    import warpchain
    walk = warpchain.walk(links=60, frequency=15.0, preset="soft")
    print(walk.status.label, walk.dx, "m")

Importing the package starts no device and reads no heavy library; the first walk compiles its kernels.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from warpchain.parameters import InputError, Parameters
    from warpchain.parameters import preset as preset
    from warpchain.results import Trajectory, WalkResult, load_walk
    from warpchain.runner import sweep
    from warpchain.status import Status
    from warpchain.sweep_result import SweepResult, load
    from warpchain.trajectory import simulate
    from warpchain.walker import walk

_HOMES = {
    "InputError": "parameters",
    "Parameters": "parameters",
    "Status": "status",
    "SweepResult": "sweep_result",
    "Trajectory": "results",
    "WalkResult": "results",
    "load": "sweep_result",
    "load_walk": "results",
    "preset": "parameters",
    "simulate": "trajectory",
    "sweep": "runner",
    "walk": "walker",
}

__all__ = [
    "InputError",
    "Parameters",
    "Status",
    "SweepResult",
    "Trajectory",
    "WalkResult",
    "load",
    "load_walk",
    "preset",
    "simulate",
    "sweep",
    "walk",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module 'warpchain' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"warpchain.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
