"""What a run returns, and the HDF5 file that keeps a walk.

A saved walk has the groups `series` (time series), `frames` (joint positions), `summary` (numbers), `parameters` (the
chain's quantities with their symbols) and, if that was kept, `before_release`; every dataset has its unit and meaning.
The attributes `setup`, `seed` and `versions`, in JSON, say how to make the walk again.
"""

import dataclasses
import json
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
from warpchain.files import reason, replacing, version_refusal
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import Scene
from warpchain.inputs.setup import Setup
from warpchain.loop.before_release import BeforeRelease, read_before_release, write_before_release
from warpchain.pictures.walk_shape import Kind, Walk
from warpchain.status import Status

if TYPE_CHECKING:
    import h5py
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

FORMAT: Final = "warpchain walk"
FORMAT_VERSION: Final = 4

BEFORE: Final = "before_release"

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


class Drawn:
    """A walk that can draw itself, also in a notebook."""

    def plot(
        self: Walk, kind: Kind = "figure5", *, figure: "Figure | None" = None, ax: "Axes | None" = None
    ) -> "Figure":
        """Draw the walk.

        Args:
            kind: `figure5` for height and speed of the centre of mass, `film_strip` for the chain itself, `loop` for
                its loop on the sprocket just before the release, `energy` for its energies, `tilt` for tilt, yaw and
                lateral drift of a plane that tilts.
            figure: an empty matplotlib figure to draw into; by default a new one, which a notebook shows.
            ax: where to draw `energy`, the only figure with one pair of axes.

        Returns:
            The figure, that of `ax` if it is given.

        Raises:
            ValueError: the kind is unknown, the walk does not have what it shows (frames, `before_release`, energies),
                or `ax` does not suit the kind.
        """
        from warpchain.pictures.walk_figures import draw

        return draw(self, kind, figure=figure, ax=ax)

    def animate(self: Walk, path: str | os.PathLike[str], *, fps: float = 30.0, slow: float = 4.0) -> None:
        """Write a moving picture of the walk; the suffix of `path` gives the format: .gif, .mp4 or .html.

        Args:
            path: the file to write, whole or not at all; an older one is replaced.
            fps: pictures per second of playing time; in a .html file the browser decides.
            slow: playing time per simulated time; in a .html file the value at the start.

        Raises:
            ValueError: the walk has no frames, the suffix is another, `fps` or `slow` is not positive, or a GIF would
                have too many pictures.
            ImportError: an .mp4 is asked for, and imageio-ffmpeg is not installed.
            OSError: the file cannot be written.
        """
        from warpchain.pictures.animation import animate

        animate(self, path, fps=fps, slow=slow)

    def facts(self: Walk) -> list[tuple[str, str]]:
        """Names and values that a notebook shows beside the picture."""
        scene = self.setup.scene
        return [
            ("status", self.status.label if self.status.ok else f"{self.status.label}: {self.status.sentence}"),
            ("distance Δx", f"{self.dx:.4g} m"),
            ("chain", f"{scene.links} links at {scene.frequency:g} Hz, preset {self.setup.preset}"),
        ]

    def _repr_png_(self: Any) -> bytes | None:
        """The film strip, or Figure 5 if there are no frames; None if there is nothing to draw."""
        from warpchain.pictures.inline import first_png

        return first_png(partial(self.plot, kind) for kind in ("film_strip", "figure5"))

    def _repr_html_(self: Any) -> str:
        """The most important numbers, and the picture."""
        from warpchain.pictures.inline import page

        return page(type(self).__name__, self.facts(), self._repr_png_())


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WalkResult(Drawn):
    """One walk, from the release to its end: t instants and f frames of a chain of n links.

    Time counts from the release, x from the centre of sprocket or ellipse, y up from the floor. Units, meanings and
    shapes stand beside the fields. `setup` is complete; `seed` is that of the random draw, None if nothing was drawn;
    `versions` names the software. `before_release` is the motion on the sprocket just before the release, None if it
    was not kept.

    Raises:
        ValueError: an array has another shape, or a dictionary other keys, than stands beside its field.
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
    before_release: BeforeRelease | None = None

    def __post_init__(self) -> None:
        """Check that arrays and dictionaries fit together."""
        instants, frames = len(self.time), len(self.frame_time)
        shapes: dict[str, tuple[int, ...]] = {
            name: (instants,) for name, stored in STORED.items() if stored.group == "series"
        }
        shapes["center"] = shapes["center_velocity"] = (instants, 2)
        shapes["frame_time"] = (frames,)
        shapes["frame_joints"] = (frames, self.setup.scene.links, 2)
        links, before = self.setup.scene.links, self.before_release
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

    def __repr__(self) -> str:
        """One line with the most important numbers."""
        scene = self.setup.scene
        return (
            f"<WalkResult {self.status.label}: dx {self.dx:.4g} m in {self.walk_time:.4g} s, "
            f"{self.bounces} bounces, {scene.links} links at {scene.frequency:g} Hz, {self.setup.preset}>"
        )

    def facts(self) -> list[tuple[str, str]]:
        """Names and values that a notebook shows beside the picture."""
        return [
            *super().facts(),
            ("walk time", f"{self.walk_time:.4g} s"),
            ("seed", "none, nothing was drawn" if self.seed is None else str(self.seed)),
            ("bounces", str(self.bounces)),
            ("steps", f"{self.steps_accepted:,} accepted, {self.steps_rejected:,} rejected"),
            ("energy unaccounted for", f"{self.energy['residual']:.1e} J"),
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
                **_setup_as_dict(self.setup),
                "seed": self.seed,
                "versions": self.versions,
            }
        )
        return plain

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the walk to an HDF5 file, whole or not at all; an older file of that name is replaced.

        Raises:
            OSError: the file cannot be written; one line that names it.
        """
        import h5py

        with replacing(path) as part, h5py.File(part, "w") as file:
            _write(self, file)


@dataclass(frozen=True, eq=False, kw_only=True)
class Trajectory:
    """Motion of a chain of n links at t chosen instants, as `warpchain.simulate` returns it.

    Attributes:
        status: how the simulation ended.
        time: instants [s], shape (t,).
        position: x, y [m] and θ [rad] of each link's centre of mass, shape (t, n, 3).
        velocity: their rates [m/s, m/s, rad/s], shape (t, n, 3).
        steps_accepted: number of accepted steps.
        steps_rejected: number of rejected steps.
        impulses: number of impulses by kind of contact.
        losses: energy lost by cause [J], positive.
        greatest_opening: greatest distance between two joined link ends [m].
        greatest_penetration: greatest overlap by kind of contact [m].
    """

    status: Status
    time: Array
    position: Array
    velocity: Array
    steps_accepted: int
    steps_rejected: int
    impulses: dict[str, int]
    losses: dict[str, float]
    greatest_opening: float
    greatest_penetration: dict[str, float]


STORED: Final[dict[str, Stored]] = {
    item.name: note
    for item in dataclasses.fields(WalkResult)
    for note in get_args(item.type)
    if isinstance(note, Stored)
}
"""Fields of `WalkResult` that a file keeps as datasets: name → where, in which unit, what."""
_PATHS: Final = {name: f"{stored.group}/{name.removeprefix('frame_')}" for name, stored in STORED.items()}


def load_walk(path: str | os.PathLike[str]) -> WalkResult:
    """Read a walk that `WalkResult.save` wrote; every number comes back to the bit.

    Raises:
        OSError: the file cannot be opened.
        ValueError: the file is no walk, is damaged, or belongs to another version of warpchain.
    """
    import h5py

    try:
        with open(path, "rb") as content:
            content.read(1)
    except OSError as error:
        raise OSError(f"{path}: {reason(error)}; give the path of a readable walk file") from None
    if not h5py.is_hdf5(path):
        raise ValueError(f"{path}: not an HDF5 file; give a file written by WalkResult.save")
    try:
        with h5py.File(path, "r") as file:
            if file.attrs.get("format") != FORMAT:
                refusal = "HDF5, but not a walk; give a file written by WalkResult.save"
            elif (found := version_refusal(file.attrs["format_version"], FORMAT_VERSION, "run the walk again")) is None:
                return _read(file)
            else:
                refusal = found
    except ValidationError as error:
        first = ".".join(str(part) for part in error.errors()[0]["loc"])
        refusal = f"this warpchain refuses its setup ({first}); read it with the version that wrote it"
    except (OSError, RuntimeError, KeyError, TypeError, ValueError):
        refusal = "damaged or cut short; fetch another copy of the file or run the walk again"
    raise ValueError(f"{path}: {refusal}")


def _setup_as_dict(setup: Setup) -> dict[str, Any]:
    models = {name: getattr(setup, name).model_dump() for name in ("parameters", "scene", "options")}
    return {"preset": setup.preset, **models}


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    return to_jsonable_python(value, inf_nan_mode="null", fallback=lambda array: array.tolist())


def _write(walk: WalkResult, file: "h5py.File") -> None:
    """Fill an empty file."""
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["status"] = walk.status.label
    file.attrs["status_sentence"] = walk.status.sentence
    file.attrs["setup"] = json.dumps(_setup_as_dict(walk.setup), allow_nan=False)
    file.attrs["seed"] = json.dumps(_plain(walk.seed))
    file.attrs["versions"] = json.dumps(walk.versions)
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
        write_before_release(walk.before_release, file.create_group(BEFORE))


def _put(file: "h5py.File", path: str, value: float | Array, unit: str, meaning: str) -> "h5py.Dataset":
    """Write one dataset; arrays are compressed without loss, and so carry the checksums of gzip."""
    filters = {"compression": "gzip", "shuffle": True} if np.size(value) > 1 else {}
    dataset = file.create_dataset(path, data=value, **filters)
    dataset.attrs["unit"] = unit
    dataset.attrs["description"] = meaning
    return dataset


def _read(file: "h5py.File") -> WalkResult:
    """The walk in a file of our format."""
    setup = json.loads(file.attrs["setup"])
    values: dict[str, Any] = {
        "status": Status[file.attrs["status"].upper()],
        "setup": Setup(
            preset=setup["preset"],
            parameters=Parameters.model_validate(setup["parameters"]),
            scene=Scene.model_validate(setup["scene"]),
            options=Options.model_validate(setup["options"]),
        ),
        "seed": json.loads(file.attrs["seed"]),
        "versions": json.loads(file.attrs["versions"]),
    }
    for name, path in _PATHS.items():
        if keys := STORED[name].keys:
            values[name] = {key: file[f"{path}/{key}"][()].item() for key in keys}
        elif name == "sprocket_center" and path not in file:
            values[name] = None
        else:
            number = file[path][()]
            values[name] = number if number.shape else number.item()
    if BEFORE in file:
        values["before_release"] = read_before_release(file[BEFORE])
    return WalkResult(**values)
