"""What a run returns, and the HDF5 file that keeps a walk.

A saved walk has the groups `series` (time series), `frames` (joint positions), `summary` (numbers), `parameters` (the
chain's quantities with their symbols) and, if that was kept, `before_release`; every dataset has its unit and meaning.
The attributes `setup`, `seed` and `versions`, in JSON, say how to make the walk again. Checksums stand at its end, see
`warpchain.hdf5_files`.
"""

import dataclasses
import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError
from pydantic_core import to_jsonable_python

from warpchain.engine.tallies import COUNTS, DEPTHS, EXTREMES, IMPULSES, LOST
from warpchain.files import version_refusal, write_whole
from warpchain.hdf5_files import ContentError, Contents, hdf5_image, put_text, reading_hdf5
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.setup import Setup
from warpchain.inputs.validation import InputError
from warpchain.loop.before_release import BeforeRelease, is_ascending, read_before_release, write_before_release
from warpchain.status import Status
from warpchain.walks.drawn import Drawn
from warpchain.walks.energy_error import MOST_ENERGY_ERROR, energy_error
from warpchain.walks.faults import FAULTS, faults
from warpchain.walks.moving_plane import in_room

if TYPE_CHECKING:
    import h5py

Array = NDArray[np.float64]

FORMAT: Final = "warpchain walk"
FORMAT_VERSION: Final = 6

BEFORE: Final = "before_release"

SINCE_FLOOR: Final = "time since the last impulse on the floor; NaN if there was none before, or never such a sample"
"""Meaning of two fields of `WalkResult`."""

ENERGIES: Final = {
    "kinetic_at_release": "kinetic energy at release",
    "potential_at_release": "energy of gravity and joint springs at release",
    "kinetic_at_end": "kinetic energy at the end",
    "potential_at_end": "energy of gravity and joint springs at the end",
    **LOST,
    "residual": "energy at release, less that at the end and all losses: the error of the integration",
}
"""Keys of `WalkResult.energy`. Losses count as positive."""


@dataclass(frozen=True)
class Stored:
    """Annotation of a field that a file keeps.

    Attributes:
        group: of the file.
        unit: SI unit, "1" for pure numbers.
        meaning: one line saying what the numbers are.
        keys: for a dictionary, which is a group of its own, its keys and their meanings.
    """

    group: str
    unit: str
    meaning: str
    keys: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WalkResult(Drawn):
    """One walk, from the release to its end: t instants and f frames of a chain of n links.

    Time counts from the release, x from the centre of sprocket or ellipse, y up from the floor. Units, meanings and
    shapes stand beside the fields. `setup` is complete; `seed` is that of the random draw, None if nothing was drawn;
    `versions` names the software. `before_release` is the motion on the sprocket just before the release, None if it
    was not kept.

    Raises:
        ValueError: an array has another shape, or a dictionary other keys, than stands beside its field; or times do
            not ascend.
    """

    status: Status
    dx: Annotated[float, Stored("summary", "m", "x of the centre of mass less x of the sprocket; NaN unless at rest")]
    walk_time: Annotated[float, Stored("summary", "s", "from the release to the end")]
    simulated_time: Annotated[float, Stored("summary", "s", "simulated, the phases before the release included")]
    hold_time: Annotated[
        float, Stored("summary", "s", "for which the loop was held at full frequency; NaN without a sprocket")
    ]
    drift: Annotated[
        float,
        Stored(
            "summary",
            "1",
            "greatest change of the held loop's mean height, width or place, relative to height or width, while it was "
            "last watched; NaN if it never was",
        ),
    ]
    lateral_drift: Annotated[
        float, Stored("summary", "m", "z of the centre of mass at rest, to the right; NaN unless the plane tilts")
    ]
    final_tilt: Annotated[
        float, Stored("summary", "rad", "tilt of the plane at the end, positive to the left; NaN if the plane is fixed")
    ]
    final_yaw: Annotated[
        float, Stored("summary", "rad", "heading of the plane at the end, anticlockwise; NaN if the plane is fixed")
    ]
    greatest_tilt: Annotated[
        float, Stored("summary", "rad", "greatest size of the tilt in the walk; NaN if the plane is fixed")
    ]
    fell_at: Annotated[
        float, Stored("summary", "s", "from the release until the plane was first tilted by 45°; NaN if it never was")
    ]
    fell_over: Annotated[
        int, Stored("summary", "1", "1 if the plane was ever tilted by 45°, 0 if not; −1 if the plane is fixed")
    ]
    fell_before_collapse: Annotated[
        int, Stored("summary", "1", "1 if it fell over before its loop collapsed, 0 if not; −1 if the plane is fixed")
    ]
    self_contact_at: Annotated[
        float,
        Stored("summary", "s", "from the release to the sample after the first impulse between links; or NaN"),
    ]
    bounces_before_self_contact: Annotated[
        int, Stored("summary", "1", "bounces begun when links first touched one another; −1 if they never did")
    ]
    flight_before_self_contact: Annotated[
        float,
        Stored("summary", "s", f"at self_contact_at, {SINCE_FLOOR}"),
    ]
    collapsed_at: Annotated[
        float,
        Stored(
            "summary", "s", "from the release until the loop enclosed less than half of its area; NaN if it never did"
        ),
    ]
    bounces_before_collapse: Annotated[
        int, Stored("summary", "1", "bounces begun when the loop collapsed, see collapsed_at; −1 if it never did")
    ]
    flight_before_collapse: Annotated[float, Stored("summary", "s", f"at collapsed_at, {SINCE_FLOOR}")]
    softened_at: Annotated[
        float, Stored("summary", "s", "from the release to the softening of the joints; NaN if they were not")
    ]
    wall_time: Annotated[float, Stored("summary", "s", "that the computer took, without the compilation of kernels")]
    bounces: Annotated[int, Stored("summary", "1", COUNTS["bounces"])]
    steps_accepted: Annotated[int, Stored("summary", "1", COUNTS["accepted"])]
    steps_rejected: Annotated[int, Stored("summary", "1", COUNTS["rejected"])]
    impulses: Annotated[dict[str, int], Stored("summary", "1", "by kind of contact", IMPULSES)]
    greatest_opening: Annotated[float, Stored("summary", "m", EXTREMES["opening"])]
    greatest_penetration: Annotated[dict[str, float], Stored("summary", "m", "by kind of contact", DEPTHS)]
    energy: Annotated[dict[str, float], Stored("summary", "J", "ledger of the walk", ENERGIES)]
    sprocket_center: Annotated[
        Array | None, Stored("summary", "m", "centre of the sprocket, shape (2,); absent without one")
    ]
    sprocket_radius: Annotated[float, Stored("summary", "m", "radius of the sprocket that links touch")]
    setup: Setup
    seed: int | None
    versions: dict[str, str]
    time: Annotated[Array, Stored("series", "s", "time since the release, shape (t,)")]
    center: Annotated[Array, Stored("series", "m", "centre of mass x, y, shape (t, 2)")]
    center_velocity: Annotated[Array, Stored("series", "m/s", "velocity of the centre of mass x, y, shape (t, 2)")]
    kinetic_energy: Annotated[Array, Stored("series", "J", "kinetic energy, shape (t,)")]
    gravitational_energy: Annotated[Array, Stored("series", "J", "energy in the field of gravity, shape (t,)")]
    spring_energy: Annotated[Array, Stored("series", "J", "energy of the joint springs, shape (t,)")]
    lowest: Annotated[Array, Stored("series", "m", "height of the lowest point of all circles, shape (t,)")]
    rms_speed: Annotated[Array, Stored("series", "m/s", "root mean square speed of the links, shape (t,)")]
    frame_time: Annotated[Array, Stored("frames", "s", "time since the release, shape (f,)")]
    frame_joints: Annotated[
        Array, Stored("frames", "m", "joints x, y, shape (f, n, 2); joint i ends link i, even links inner")
    ]
    frame_forces: Annotated[
        Array,
        Stored(
            "frames",
            "N",
            "force x, y in each joint on the link that it ends, with the stiffness and damping of the moment, softened "
            "after a collapse, shape (f, n, 2); (0, n, 2) if not recorded",
        ),
    ]
    frame_moments: Annotated[
        Array,
        Stored(
            "frames", "N m", "friction moment in each joint on the link that it ends, (f, n); (0, n) if not recorded"
        ),
    ]
    center_z: Annotated[
        Array, Stored("series", "m", "centre of mass z, to the right, shape (t,); (0,) if the plane is fixed")
    ]
    tilt: Annotated[Array, Stored("series", "rad", "tilt of the plane, shape (t,); (0,) if the plane is fixed")]
    yaw: Annotated[
        Array,
        Stored("series", "rad", "heading of the plane, all turns counted, shape (t,); (0,) if the plane is fixed"),
    ]
    frame_origin: Annotated[
        Array,
        Stored(
            "frames", "m", "origin of the plane's coordinates in the room, shape (f, 3); (0, 3) if the plane is fixed"
        ),
    ]
    frame_axes: Annotated[
        Array,
        Stored("frames", "1", "axes of x and y of the plane in the room, shape (f, 2, 3); (0, 2, 3) if it is fixed"),
    ]
    before_release: BeforeRelease | None = None

    @property
    def joints_in_room(self) -> Array | None:
        """Joints x, y, z [m] in the room, (f, n, 3), if the plane tilts; else None: `frame_joints` are in the room."""
        if self.setup.scene.plane == "fixed":
            return None
        return in_room(self.frame_joints, self.frame_origin, self.frame_axes)

    def __post_init__(self) -> None:
        """Check that arrays and dictionaries fit together."""
        instants, frames = len(self.time), len(self.frame_time)
        shapes: dict[str, tuple[int, ...]] = {
            name: (instants,) for name, stored in STORED.items() if stored.group == "series"
        }
        shapes["center"] = shapes["center_velocity"] = (instants, 2)
        moving = self.setup.scene.plane == "tilting"
        shapes["center_z"] = shapes["tilt"] = shapes["yaw"] = (instants if moving else 0,)
        shapes["frame_origin"] = (frames if moving else 0, 3)
        shapes["frame_axes"] = (frames if moving else 0, 2, 3)
        shapes["frame_time"] = (frames,)
        shapes["frame_joints"] = (frames, self.setup.scene.links, 2)
        links, before = self.setup.scene.links, self.before_release
        loaded = frames if len(self.frame_forces) else 0
        shapes["frame_forces"], shapes["frame_moments"] = (loaded, links, 2), (loaded, links)
        if before is not None and before.frame_joints.shape[1] != links:
            raise ValueError(f"before_release: its frames are not of {links} links; give those of this walk")
        if self.sprocket_center is not None:
            shapes["sprocket_center"] = (2,)
        for name, shape in shapes.items():
            given = np.shape(getattr(self, name))
            if given != shape:
                raise ValueError(f"{name}: its shape is {given}; give an array of shape {shape}")
        for name, stored in STORED.items():
            if stored.keys and set(getattr(self, name)) != set(stored.keys):
                raise ValueError(f"{name}: wrong keys; give exactly {', '.join(stored.keys)}")
        for name in ("time", "frame_time"):
            if not is_ascending(getattr(self, name)):
                raise ValueError(f"{name}: does not ascend; give finite times in order")

    def __repr__(self) -> str:
        """One line with the most important numbers."""
        scene, error = self.setup.scene, self.energy_error
        warning = f", energy error {error:.1e}" if error > MOST_ENERGY_ERROR else ", inaccurate" * bool(self.warnings())
        return (
            f"<WalkResult {self.status.label}: dx {self.dx:.4g} m in {self.walk_time:.4g} s, "
            f"{self.bounces} bounces, {scene.links} links at {scene.frequency:g} Hz, {self.setup.preset}{warning}>"
        )

    @property
    def energy_error(self) -> float:
        """Size of the energy unaccounted for, relative to the energy at release; above 0.05 the walk is inaccurate."""
        return energy_error(self.energy)

    def warnings(self) -> list[str]:
        """Why the walk is inaccurate, each with what to try: energy, joints or contacts; empty if it is not."""
        deepest, parameters = max(self.greatest_penetration.values()), self.setup.parameters
        lengths = (self.greatest_opening, deepest, parameters.link_length, parameters.circle_radius)
        return [FAULTS[name] for name, found in faults(self.energy_error, *lengths).items() if found]

    def facts(self) -> list[tuple[str, str]]:
        """Names and values that a notebook shows beside the picture."""
        return [
            *super().facts(),
            ("walk time", f"{self.walk_time:.4g} s"),
            ("seed", "none, nothing was drawn" if self.seed is None else str(self.seed)),
            ("bounces", str(self.bounces)),
            ("steps", f"{self.steps_accepted:,} accepted, {self.steps_rejected:,} rejected"),
            ("energy unaccounted for", f"{self.energy['residual']:.1e} J"),
            *(("warning", remedy) for remedy in self.warnings()),
            ("computed in", f"{self.wall_time:.1f} s"),
        ]

    def to_dict(self) -> dict[str, Any]:
        """Everything but time series and frames, for JSON; a number that is not finite is None."""
        summary = {name: getattr(self, name) for name, stored in STORED.items() if stored.group == "summary"}
        plain: dict[str, Any] = _plain(
            {
                "dx": summary.pop("dx"),
                "status": self.status.label,
                "status_sentence": self.status.sentence,
                **summary,
                "energy_error": self.energy_error,
                **_setup_as_dict(self.setup),
                "seed": self.seed,
                "versions": self.versions,
            }
        )
        return plain

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the walk to an HDF5 file, whole or not at all; an older file of that name is replaced.

        Raises:
            OSError: the file cannot be written, or something else than a regular file is there; one line that names it.
        """
        write_whole(path, hdf5_image(partial(_write, self)))


STORED: Final[dict[str, Stored]] = {
    item.name: note
    for item in dataclasses.fields(WalkResult)
    for note in get_args(item.type)
    if isinstance(note, Stored)
}
"""Fields of `WalkResult` that a file keeps as datasets: name → where, in which unit, what."""
_DIMENSIONS: Final = {
    **{name: 1 for name, stored in STORED.items() if stored.group in ("series", "frames")},
    **dict.fromkeys(("center", "center_velocity"), 2),
    "frame_joints": 3,
    "frame_forces": 3,
    "frame_moments": 2,
    "frame_origin": 2,
    "frame_axes": 3,
    "sprocket_center": 1,
}
"""Fields that are arrays: name → number of axes."""
_KINDS: Final = {
    item.name: np.dtype(
        np.int64 if item.type is not None and get_args(item.type)[0] in (int, dict[str, int]) else float
    )
    for item in dataclasses.fields(WalkResult)
    if item.name in STORED
}
"""Types of their numbers."""
_PATHS: Final = {name: f"{stored.group}/{name.removeprefix('frame_')}" for name, stored in STORED.items()}


def load_walk(path: str | os.PathLike[str]) -> WalkResult:
    """Read a walk that `WalkResult.save` wrote; every number comes back to the bit.

    Raises:
        OSError: the file cannot be read.
        InputError: the file is no walk, or belongs to another version of warpchain. It is a `ValueError`.
        DamagedFileError: the file is damaged or cut short. It is an `InputError`.
    """
    refusal, wanted = None, "give a file written by WalkResult.save"
    with reading_hdf5(path, "fetch another copy of the file or run the walk again", wanted) as contents:
        if contents.text("format") != FORMAT:
            refusal = f"HDF5, but not a walk; {wanted}"
        else:
            refusal = version_refusal(contents.whole("format_version"), FORMAT_VERSION, "run the walk again")
        if refusal is None:
            try:
                return _read(contents)
            except ValidationError as error:
                first = ".".join(str(part) for part in error.errors()[0]["loc"])
                refusal = f"this warpchain refuses its setup ({first}); read it with the version that wrote it"
    raise InputError(f"{path}: {refusal}")


def _setup_as_dict(setup: Setup) -> dict[str, Any]:
    models = {name: getattr(setup, name).model_dump() for name in ("parameters", "scene", "options")}
    return {"preset": setup.preset, **models}


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    return to_jsonable_python(value, inf_nan_mode="null", fallback=lambda array: array.tolist())


def _write(walk: WalkResult, file: "h5py.File") -> None:
    """Fill an empty file."""
    file.attrs["format_version"] = FORMAT_VERSION
    texts = {
        "format": FORMAT,
        "status": walk.status.label,
        "status_sentence": walk.status.sentence,
        "setup": json.dumps(_setup_as_dict(walk.setup), allow_nan=False),
        "seed": json.dumps(_plain(walk.seed)),
        "versions": json.dumps(walk.versions),
    }
    for name, text in texts.items():
        put_text(file, name, text)
    for name, stored in STORED.items():
        value = getattr(walk, name)
        if stored.keys:
            for key, meaning in stored.keys.items():
                _put(file, f"{_PATHS[name]}/{key}", value[key], stored.unit, meaning)
        elif value is not None:
            _put(file, _PATHS[name], value, stored.unit, stored.meaning)
    for name, quantity in Parameters.quantities().items():
        value = getattr(walk.setup.parameters, name)
        dataset = _put(file, f"parameters/{name}", value, quantity.unit, quantity.meaning)
        dataset.attrs["symbol"] = quantity.symbol
    if walk.before_release is not None:
        write_before_release(walk.before_release, file.create_group(BEFORE, track_order=True))


def _put(file: "h5py.File", path: str, value: float | Array, unit: str, meaning: str) -> "h5py.Dataset":
    """Write one dataset."""
    dataset = file.create_dataset(path, data=value)
    dataset.attrs["unit"] = unit
    dataset.attrs["description"] = meaning
    return dataset


def _read(contents: Contents) -> WalkResult:
    """The walk in a file of our format."""
    setup, status = contents.json("setup"), Status[contents.text("status").upper()]
    values: dict[str, Any] = {
        "status": status,
        "setup": Setup(
            preset=setup["preset"],
            parameters=Parameters.model_validate(setup["parameters"]),
            scene=Scene.model_validate(setup["scene"]),
            options=Options.model_validate(setup["options"]),
        ),
        "seed": contents.json("seed"),
        "versions": contents.json("versions"),
    }
    for name, path in _PATHS.items():
        group, _, item = path.partition("/")
        part = contents.part(group)
        if keys := STORED[name].keys:
            values[name] = {key: part.array(f"{item}/{key}", _KINDS[name], ()).item() for key in keys}
        elif name == "sprocket_center" and not part.has(item):
            values[name] = None
        else:
            shape = (None,) * _DIMENSIONS.get(name, 0)
            number = part.array(item, _KINDS[name], shape)
            values[name] = number if shape else number.item()
    if contents.has(BEFORE):
        values["before_release"] = read_before_release(contents.part(BEFORE), np.float64)
    preset, seed, versions = setup["preset"], values["seed"], values["versions"]
    texts = (preset, *versions, *versions.values())
    if not all(isinstance(text, str) for text in texts) or not (seed is None or type(seed) is int):
        raise ContentError("preset, seed or versions of another type")
    if status is Status.RUNNING or math.isfinite(values["dx"]) != (status is Status.AT_REST):
        raise ContentError(f"a walk with status {status.label} and distance {values['dx']}")
    return WalkResult(**values)
