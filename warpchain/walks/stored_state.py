"""The state that a walk began from, in the walk's file, so that the walk can be run again to the bit."""

from typing import TYPE_CHECKING, Final

import numpy as np

from warpchain.hdf5_files import put
from warpchain.inputs.setup import Setup
from warpchain.inputs.state import State

if TYPE_CHECKING:
    import h5py

_GROUP: Final = "start"
_ARRAYS: Final = {
    "position": ("m, m, rad", "x, y and angle of each link"),
    "velocity": ("m/s, m/s, rad/s", "their rates"),
    "origin": ("m", "origin of the plane's coordinates in the room"),
    "axes": ("1", "axes of x and y of the plane in the room"),
    "plane_rates": ("m/s, rad/s, rad/s", "speed across the plane, and its turning rates about x and y"),
}


def write_state(file: "h5py.File", state: State) -> None:
    """Write a state of a walk; its setup is that of the file."""
    put(file, f"{_GROUP}/time", state.time, "s", "time since the release")
    for name, (unit, meaning) in _ARRAYS.items():
        if (values := getattr(state, name)) is not None:
            put(file, f"{_GROUP}/{name}", values, unit, meaning)
    for name, values in state.memory.items():
        put(file, f"{_GROUP}/memory/{name}", values, "1", "what else the walk had then")


def read_state(file: "h5py.File", setup: Setup) -> State | None:
    """The state that a walk began from; None if it began as its scene says."""
    if _GROUP not in file:
        return None
    group, memory = file[_GROUP], {}

    def remember(name: str, node: object) -> None:
        if hasattr(node, "dtype"):
            memory[name] = np.array(node)

    if "memory" in group:
        group["memory"].visititems(remember)
    arrays = {name: group[name][()] for name in _ARRAYS if name in group}
    return State(setup=setup, time=float(group["time"][()]), memory=memory, **arrays)
