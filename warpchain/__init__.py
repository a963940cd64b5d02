"""warpchain: ensembles of walking roller chains on NVIDIA Warp.

    import warpchain
    walk = warpchain.walk(links=60, frequency=15.0, preset="soft")
    print(walk.status.label, walk.dx, "m")

Importing the package starts no device and reads no heavy library; the first walk compiles its kernels.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from warpchain.inputs.parameters import Parameters
    from warpchain.inputs.parameters import preset as preset
    from warpchain.inputs.validation import InputError
    from warpchain.run.simulation import simulate
    from warpchain.run.single_walk import walk
    from warpchain.run.sweep_run import sweep
    from warpchain.status import Status
    from warpchain.store.sweep_result import SweepResult, load
    from warpchain.walks.walk_result import Trajectory, WalkResult, load_walk

_HOMES = {
    "InputError": "inputs.validation",
    "Parameters": "inputs.parameters",
    "Status": "status",
    "SweepResult": "store.sweep_result",
    "Trajectory": "walks.walk_result",
    "WalkResult": "walks.walk_result",
    "load": "store.sweep_result",
    "load_walk": "walks.walk_result",
    "preset": "inputs.parameters",
    "simulate": "run.simulation",
    "sweep": "run.sweep_run",
    "walk": "run.single_walk",
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
