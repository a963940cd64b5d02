"""What a run returns, and the HDF5 file that keeps a walk.

Unit and meaning of every field stand beside it, once; the file repeats them on each dataset. A saved walk has the
groups `series` (time series), `frames` (joint positions), `summary` (numbers) and `parameters` (the chain's
quantities with symbols); the root attributes `setup`, `seed` and `versions` (JSON) say how to make it again.
"""

import dataclasses
import json
import math
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from warpchain.options import Options, Scene, Setup
from warpchain.parameters import Parameters
from warpchain.status import Status

if TYPE_CHECKING:
    import h5py
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

FORMAT: Final = "warpchain walk"
FORMAT_VERSION: Final = 1

CONTACTS: Final = {
    "floor": "between links and floor",
    "sprocket": "between links and sprocket",
    "self": "between links of the chain",
}
"""Kinds of contact: keys of `WalkResult.impulses` and `WalkResult.greatest_penetration`."""

ENERGIES: Final = {
    "kinetic_at_release": "kinetic energy at release",
    "potential_at_release": "energy of gravity and joint springs at release",
    "kinetic_at_end": "kinetic energy at the end",
    "potential_at_end": "energy of gravity and joint springs at the end",
    "joint_friction": "energy lost to joint friction, viscous and Coulomb",
    "joint_damping": "energy lost to the damping of the joint springs",
    "floor": "energy lost in impacts on the floor",
    "self_contact": "energy lost in impacts of links on one another",
    "residual": "energy at release, less that at the end and all losses; integration error",
}
"""Keys of `WalkResult.energy`; losses count as positive."""


def _quantity(unit: str, meaning: str, path: str = "", keys: Mapping[str, str] | None = None) -> Any:
    """A field with its unit and meaning; `path` is where a file keeps it, `keys` what a dictionary must hold."""
    metadata = {"unit": unit, "meaning": meaning, "path": path, "keys": keys}
    return field(metadata=metadata, repr=path.startswith("summary/") and keys is None)


@dataclass(frozen=True, eq=False, kw_only=True)
class WalkResult:
    """One walk, from the release to its end: t instants and f frames of a chain of n links.

    Time counts from the release, y from the floor upwards. Unit and meaning of each field are its metadata.

    Raises:
        ValueError: arrays or dictionaries don't have the shapes or keys given beside the fields.
    """

    status: Status
    dx: float = _quantity(
        "m", "x of the centre of mass at rest less x of the sprocket; NaN unless at rest", "summary/dx"
    )
    walk_time: float = _quantity("s", "from release to the end", "summary/walk_time")
    simulated_time: float = _quantity("s", "of all phases, the sprocket's included", "summary/simulated_time")
    wall_time: float = _quantity("s", "that the computer needed", "summary/wall_time")
    bounces: int = _quantity("1", "number of bounces off the floor", "summary/bounces")
    steps_accepted: int = _quantity("1", "accepted steps of all phases", "summary/steps_accepted")
    steps_rejected: int = _quantity("1", "rejected steps of all phases", "summary/steps_rejected")
    impulses: dict[str, int] = _quantity("1", "number of impulses", "summary/impulses", CONTACTS)
    greatest_opening: float = _quantity(
        "m", "greatest distance between the two ends that a joint holds together", "summary/greatest_opening"
    )
    greatest_penetration: dict[str, float] = _quantity(
        "m", "greatest overlap", "summary/greatest_penetration", CONTACTS
    )
    energy: dict[str, float] = _quantity("J", "energy of the walk", "summary/energy", ENERGIES)
    sprocket_center: Array | None = _quantity(
        "m", "centre of the sprocket, shape (2,); absent without sprocket", "summary/sprocket_center"
    )
    sprocket_radius: float = _quantity(
        "m", "radius of the sprocket that the links touch", "summary/sprocket_radius"
    )
    setup: Setup = _quantity("", "parameters, scene and options, complete")
    seed: int | None = _quantity("", "seed that the parameters were drawn with, if any")
    versions: dict[str, str] = _quantity("", "versions of the software, by name")
    time: Array = _quantity("s", "time since release, shape (t,)", "series/time")
    center: Array = _quantity("m", "centre of mass x, y, shape (t, 2)", "series/center")
    center_velocity: Array = _quantity(
        "m/s", "velocity of the centre of mass x, y, shape (t, 2)", "series/center_velocity"
    )
    kinetic_energy: Array = _quantity("J", "kinetic energy, shape (t,)", "series/kinetic_energy")
    gravitational_energy: Array = _quantity(
        "J", "energy in the gravity field, shape (t,)", "series/gravitational_energy"
    )
    spring_energy: Array = _quantity("J", "energy of the joint springs, shape (t,)", "series/spring_energy")
    lowest: Array = _quantity("m", "height of the lowest point of the circles, shape (t,)", "series/lowest")
    rms_speed: Array = _quantity("m/s", "root mean square speed of the links, shape (t,)", "series/rms_speed")
    frame_time: Array = _quantity("s", "time since release, shape (f,)", "frames/time")
    frame_joints: Array = _quantity(
        "m", "joints x, y, shape (f, n, 2); joint i ends link i, even links are inner", "frames/joints"
    )

    def __post_init__(self) -> None:
        """Check that the arrays and dictionaries fit together."""
        instants, frames = len(self.time), len(self.frame_time)
        shapes: dict[str, tuple[int, ...]] = {item.name: (instants,) for item in _fields("series/")}
        shapes["center"] = shapes["center_velocity"] = (instants, 2)
        shapes["frame_time"] = (frames,)
        shapes["frame_joints"] = (frames, self.setup.scene.links, 2)
        if self.sprocket_center is not None:
            shapes["sprocket_center"] = (2,)
        for name, shape in shapes.items():
            given = np.shape(getattr(self, name))
            if given != shape:
                raise ValueError(f"{name}: shape {given} is not {shape}; give an array of that shape")
        for item in _fields("summary/"):
            keys = item.metadata["keys"]
            if keys is not None and set(getattr(self, item.name)) != set(keys):
                raise ValueError(f"{item.name}: keys differ; give exactly {', '.join(keys)}")

    def to_dict(self) -> dict[str, Any]:
        """Everything but the arrays, ready for `json.dumps(…, allow_nan=False)`; what is not finite is None."""
        summary = {item.name: getattr(self, item.name) for item in _fields("summary/")}
        described = {
            "dx": summary.pop("dx"),
            "status": self.status.label,
            "status_sentence": self.status.sentence,
            **summary,
            **_setup_as_dict(self.setup),
            "seed": self.seed,
            "versions": self.versions,
        }
        plain: dict[str, Any] = _plain(described)
        return plain

    def plot(
        self, kind: Literal["figure5", "film_strip"] = "figure5", *, figure: "Figure | None" = None
    ) -> "Figure":
        """Draw the walk.

        Args:
            kind: `figure5` for height and speed of the centre of mass against time, `film_strip` for the chain.
            figure: an empty matplotlib figure to draw into; a new one by default.

        Raises:
            ValueError: the kind is unknown, or a film strip is asked of a walk without frames.
        """
        from warpchain import plots

        if kind == "figure5":
            return plots.figure5([self], figure=figure)
        if kind == "film_strip":
            return plots.film_strip(self, figure=figure)
        raise ValueError(f"kind: {kind!r} is unknown; give 'figure5' or 'film_strip'")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the walk to an HDF5 file, whole or not at all; an older file of that name is replaced.

        Raises:
            OSError: the file cannot be written; one line naming it.
        """
        import h5py

        with replacing(path) as part, h5py.File(part, "w") as file:
            _write(self, file)


@dataclass(frozen=True, eq=False, kw_only=True)
class Trajectory:
    """Motion of a chain of n links at t chosen instants, as `warpchain.simulate` returns it.

    Unit and meaning of each field are its metadata.
    """

    status: Status
    time: Array = _quantity("s", "instants, shape (t,)")
    position: Array = _quantity("m, m, rad", "x, y, θ of the links' centres of mass, shape (t, n, 3)")
    velocity: Array = _quantity("m/s, m/s, rad/s", "time derivative of position, shape (t, n, 3)")
    steps_accepted: int = _quantity("1", "accepted steps")
    steps_rejected: int = _quantity("1", "rejected steps")
    impulses: dict[str, int] = _quantity("1", "number of impulses by kind of contact")
    losses: dict[str, float] = _quantity("J", "energy lost by cause, positive")
    greatest_opening: float = _quantity("m", "greatest distance between the two ends that a joint holds")
    greatest_penetration: dict[str, float] = _quantity("m", "greatest overlap by kind of contact")


def load_walk(path: str | os.PathLike[str]) -> WalkResult:
    """Read a walk that `WalkResult.save` wrote; numbers come back to the bit.

    Raises:
        OSError: the file cannot be opened.
        ValueError: the file is not a walk, is damaged, or was written by another version of the format.
    """
    import h5py

    try:
        with open(path, "rb") as file:
            file.read(1)
    except OSError as error:
        raise OSError(f"{path}: {_reason(error)}; give the path of a readable walk file") from None
    if not h5py.is_hdf5(path):
        raise ValueError(f"{path}: not an HDF5 file; give a file written by WalkResult.save")
    try:
        with h5py.File(path, "r") as file:
            refusal = _refusal(file)
            if refusal is None:
                return _read(file)
    except ValidationError as error:
        first = ".".join(str(part) for part in error.errors()[0]["loc"])
        refusal = f"its setup does not suit this warpchain ({first}); read it with the version that wrote it"
    except (OSError, RuntimeError, KeyError, TypeError, ValueError):
        refusal = "damaged or cut short; fetch another copy of the file or run the walk again"
    raise ValueError(f"{path}: {refusal}")


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path in the same folder; it becomes `path` when the block ends without an error.

    The data are on the disk before the name changes hands, so at any moment, even through a power cut, `path` is
    either the old file or the whole new one.

    Raises:
        OSError: the file cannot be written; one line naming it. The temporary file is removed after any error.
    """
    target = Path(path)
    part = target.with_name(f".{target.stem}.{secrets.token_hex(4)}.part{target.suffix}")
    try:
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        yield part
        with open(part, "r+b") as file:
            os.fsync(file.fileno())
        os.replace(part, target)
    except OSError as error:
        raise OSError(
            f"{target}: cannot be written ({_reason(error)}); choose another path or make room"
        ) from error
    finally:
        part.unlink(missing_ok=True)


def _reason(error: OSError) -> str:
    """What went wrong, in the system's own few words; HDF5 buries them in a paragraph."""
    return os.strerror(error.errno) if error.errno else " ".join(str(error).split())


def _fields(group: str) -> list["dataclasses.Field[Any]"]:
    """The fields of `WalkResult` that a file keeps under `group`; an empty one stands for all groups."""
    return [
        item
        for item in dataclasses.fields(WalkResult)
        if item.metadata.get("path") and item.metadata["path"].startswith(group)
    ]


def _setup_as_dict(setup: Setup) -> dict[str, Any]:
    return {
        "preset": setup.preset,
        "parameters": setup.parameters.model_dump(),
        "scene": setup.scene.model_dump(),
        "options": setup.options.model_dump(),
    }


def _plain(value: Any) -> Any:
    """The same value made of what JSON knows."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _write(walk: WalkResult, file: "h5py.File") -> None:
    """Fill an empty file."""
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["status"] = walk.status.label
    file.attrs["status_sentence"] = walk.status.sentence
    file.attrs["setup"] = json.dumps(_setup_as_dict(walk.setup), allow_nan=False)
    file.attrs["seed"] = json.dumps(walk.seed)
    file.attrs["versions"] = json.dumps(walk.versions)
    for item in _fields(""):
        path, unit, meaning = item.metadata["path"], item.metadata["unit"], item.metadata["meaning"]
        value = getattr(walk, item.name)
        if isinstance(value, dict):
            for key, number in value.items():
                _put(file, f"{path}/{key}", number, unit, f"{meaning}: {item.metadata['keys'][key]}")
        elif value is not None:
            _put(file, path, value, unit, meaning)
    for name, quantity in Parameters.quantities().items():
        number = getattr(walk.setup.parameters, name)
        node = _put(file, f"parameters/{name}", number, quantity.unit, quantity.meaning)
        node.attrs["symbol"] = quantity.symbol


def _put(file: "h5py.File", path: str, value: "float | Array", unit: str, description: str) -> "h5py.Dataset":
    """Write one dataset; arrays are compressed without loss and carry checksums."""
    filters = {"compression": "gzip", "shuffle": True, "fletcher32": True} if np.size(value) > 1 else {}
    node = file.create_dataset(path, data=value, **filters)
    node.attrs["unit"] = unit
    node.attrs["description"] = description
    return node


def _refusal(file: "h5py.File") -> str | None:
    """Why this file can't be read as a walk, if it can't."""
    version = file.attrs.get("format_version")
    if file.attrs.get("format") != FORMAT:
        return "HDF5, but not a walk; give a file written by WalkResult.save"
    if version != FORMAT_VERSION:
        return f"format version {version}, but this warpchain reads {FORMAT_VERSION}; update warpchain"
    return None


def _read(file: "h5py.File") -> WalkResult:
    """The walk in a file of the right format."""
    setup = json.loads(file.attrs["setup"])
    values: dict[str, Any] = {
        "status": Status[file.attrs["status"].upper()],
        "seed": json.loads(file.attrs["seed"]),
        "versions": json.loads(file.attrs["versions"]),
        "setup": Setup(
            preset=setup["preset"],
            parameters=Parameters.model_validate(setup["parameters"]),
            scene=Scene.model_validate(setup["scene"]),
            options=Options.model_validate(setup["options"]),
        ),
    }
    for item in _fields(""):
        path, keys = item.metadata["path"], item.metadata["keys"]
        if keys is not None:
            values[item.name] = {key: file[f"{path}/{key}"][()].item() for key in keys}
        elif item.name == "sprocket_center" and path not in file:
            values[item.name] = None
        else:
            number = file[path][()]
            values[item.name] = number if number.shape else number.item()
    return WalkResult(**values)
