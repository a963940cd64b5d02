"""warpchain: ensembles of walking roller chains on NVIDIA Warp.

    import warpchain
    walk = warpchain.walk(links=60, frequency=15.0)
    print(walk.status.label, walk.dx, "m")

Importing the package starts no device and reads no heavy library; the first walk compiles its kernels.

To run:

    walk(...)        one walk: hang a chain on its sprocket, spin it up, release it and follow it to rest
    sweep(...)       many walks: a grid of values with random samples, kept in a folder
    simulate(...)    the motion of any given chain, without sprocket
    Chains(...)      many given chains, whose velocities may be changed between runs

    live(folder)     a page in a notebook on which sliders change a walk

To read:

    load(folder)     results of a sweep, as far as it has run
    load_walk(path)  a walk that `WalkResult.save` wrote
    preset(name)     the parameters of a named preset, "paper" or "soft"
    video            a module: estimates floor friction and chain parameters from videos of walks

What they return, take and raise:

    WalkResult       one walk: status, distance, energies, time series, frames; `plot`, `animate`, `save`
    SweepResult      a sweep: arrays with named axes and units
    State            a chain at one instant, from which a walk continues: `WalkResult.state`, `State.of_joints`
    Trajectory       the motion of a given chain
    Parameters       physical parameters of a chain, its sprocket and the floor
    Status           how a walk ended, with a sentence that says what to try
    InputError       a value is refused: one line with the name of the value and the remedy

The version is `__version__`.
"""

from pathlib import Path as _Path
from typing import TYPE_CHECKING, Any

from warpchain import version as _version

if TYPE_CHECKING:
    from warpchain import video as video
    from warpchain.chain.setup import State as State
    from warpchain.inputs.parameters import Parameters as Parameters
    from warpchain.inputs.parameters import preset as preset
    from warpchain.inputs.validation import InputError as InputError
    from warpchain.live_page.server import live as live
    from warpchain.results.sweep_result import SweepResult as SweepResult
    from warpchain.results.sweep_result import load as load
    from warpchain.results.walk_result import WalkResult as WalkResult
    from warpchain.results.walk_result import load_walk as load_walk
    from warpchain.run.simulation import Chains as Chains
    from warpchain.run.simulation import Trajectory as Trajectory
    from warpchain.run.simulation import simulate as simulate
    from warpchain.run.single_walk import walk as walk
    from warpchain.run.sweep_run import sweep as sweep
    from warpchain.status import Status as Status

__version__ = _version.VERSION

_HOME = _Path(__file__).parent
if not (_HOME / "kernels").is_dir():
    # In a checkout the kernels are beside the package instead of in it, where an installation has them.
    __path__.append(str(_HOME.parent))

_NAMES = {
    "video": "video",
    "inputs.parameters": "Parameters preset",
    "chain.setup": "State",
    "inputs.validation": "InputError",
    "live_page.server": "live",
    "run.simulation": "Chains Trajectory simulate",
    "run.single_walk": "walk",
    "run.sweep_run": "sweep",
    "status": "Status",
    "results.sweep_result": "SweepResult load",
    "results.walk_result": "WalkResult load_walk",
}
_HOMES = {name: home for home, names in _NAMES.items() for name in names.split()}

__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module 'warpchain' has no attribute {name!r}")
    from importlib import import_module

    home = import_module(f"warpchain.{_HOMES[name]}")
    value = home if _HOMES[name] == name else getattr(home, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names, also those that were not used yet."""
    return sorted({*__all__, "__version__", "__doc__", "__file__", "__name__", "__path__"})
