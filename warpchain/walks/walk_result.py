"""What a run returns, and the HDF5 file that keeps a walk.

A saved walk has the groups `series` (time series), `frames` (joint positions), `summary` (numbers), `parameters` (the
chain's quantities with their symbols) and, if that was kept, `before_release`; every dataset has its unit and meaning.
The attributes `setup`, `seed` and `versions`, in JSON, say how to make the walk again. Shards and merged files of
sweeps keep the motion of a walk in the same groups.

The annotations of `WalkResult` are the one table of a walk's quantities: files, columns of a sweep, units and the
reference derive from them.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np

from warpchain.engine.tallies import COUNTS, DEPTHS, EXTREMES, IMPULSES, LOST
from warpchain.files import write_whole
from warpchain.hdf5_files import Stored, hdf5_image, put, read_fields, reading_hdf5, stored_fields, write_fields
from warpchain.inputs.arrays import Array
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.scene import contact_radius
from warpchain.inputs.setup import SECTIONS, Setup
from warpchain.inputs.state import State
from warpchain.inputs.validation import InputError, json_value, validated
from warpchain.kernels import layout
from warpchain.loop.stationary_loop import BEFORE, FIELDS, BeforeRelease
from warpchain.pictures.labels import Kind
from warpchain.status import Status
from warpchain.walks.landmarks import FAULTS, LENGTHS, MOST_ENERGY_ERROR, RELEASE, bounces, energy_error, faults, least

if TYPE_CHECKING:
    import h5py
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from warpchain.loop.stationary_loop import StationaryLoop

KIND: Final = "warpchain walk"
WANTED: Final = "give a saved walk; `walk --like SWEEP --index I` saves one"

SHOWN: Final = 12_000
"""Joints that a notebook keeps of the frames of a walk: 200 frames of 60 links take 0.12 MB."""
_SINCE_FLOOR: Final = "time since the last impulse on the floor; NaN if there was none"
_FIXED: Final = "if the plane is fixed"
_NEVER: Final = "NaN if it never was"

ENERGIES: Final = {
    "kinetic_at_release": "kinetic energy at release",
    "potential_at_release": "energy of gravity, from the floor below the release, and joint springs at release",
    "kinetic_at_end": "kinetic energy at the end",
    "potential_at_end": "energy of gravity and joint springs at the end",
    **LOST,
    "residual": "energy at release, less that at the end and all losses: the error of the integration",
}
"""Keys of `WalkResult.energy`. Losses count as positive."""
_GROUP: Final = "start"
"""Group of the state that a walk began from, so that it can be run again to the bit."""
_STATE: Final = {
    "position": ("m, m, rad", "x, y and angle of each link"),
    "velocity": ("m/s, m/s, rad/s", "their rates"),
    "origin": ("m", "origin of the plane's coordinates in the room"),
    "axes": ("1", "axes of x and y of the plane in the room"),
    "plane_rates": ("m/s, rad/s, rad/s", "speed across the plane, and its turning rates about x and y"),
}


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WalkResult:
    """One walk, from the release to its end: t instants and f frames of a chain of n links.

    Time counts from the release, x from the centre of sprocket or ellipse, y up from the floor. Units, meanings and
    shapes stand beside the fields. Time series have a row at every `record_interval` exactly, and at the end; at an
    impact a row of a velocity or an energy lies between the values before and after. Frames are at the ends of steps.
    `setup` is complete; `seed` is that of the random draw, None if nothing was drawn; `versions` names the software.
    `before_release` is the motion on the sprocket just before the release, None if it was not kept.
    """

    status: Status
    dx: Annotated[
        float,
        Stored(
            "m", "x of the centre of mass from the sprocket (x = 0) on, on a slope along the floor; NaN unless at rest"
        ),
    ]
    walk_time: Annotated[float, Stored("s", "from the release to the end")]
    simulated_time: Annotated[float, Stored("s", "simulated, the phases before the release included")]
    hold_time: Annotated[float, Stored("s", "for which the loop was held at full frequency; NaN without a sprocket")]
    drift: Annotated[
        float,
        Stored(
            "1",
            "greatest change of the held loop's mean height, width or place, relative to height or width, while it was "
            f"last watched; {_NEVER}",
        ),
    ]
    lateral_drift: Annotated[
        float, Stored("m", "z of the centre of mass at rest, to the right; NaN unless the plane tilts")
    ]
    final_tilt: Annotated[float, Stored("rad", f"tilt of the plane at the end, positive to the left; NaN {_FIXED}")]
    final_yaw: Annotated[float, Stored("rad", f"heading of the plane at the end, as yaw but within ±π; NaN {_FIXED}")]
    greatest_tilt: Annotated[float, Stored("rad", f"greatest size of the tilt in the walk; NaN {_FIXED}")]
    fell_at: Annotated[float, Stored("s", f"from the release until the plane was first tilted by 45°; {_NEVER}")]
    fell_over: Annotated[int, Stored("1", "1 if the plane was ever tilted by 45°, 0 if not; −1 if the plane is fixed")]
    fell_before_collapse: Annotated[
        int, Stored("1", "1 if it fell over before its loop collapsed, 0 if not; −1 if the plane is fixed")
    ]
    self_contact_at: Annotated[
        float, Stored("s", "from the release to the sample after the first impulse between links; or NaN")
    ]
    bounces_before_self_contact: Annotated[int, Stored("1", "bounces begun at self_contact_at; −1 if it never came")]
    flight_before_self_contact: Annotated[float, Stored("s", f"at self_contact_at, {_SINCE_FLOOR}")]
    strands_met_at: Annotated[
        float,
        Stored("s", f"the same of strands of the loop: links {layout.STRANDS_APART} or more apart along the chain"),
    ]
    bounces_before_strands_met: Annotated[int, Stored("1", "bounces begun at strands_met_at; −1 if it never came")]
    flight_before_strands_met: Annotated[float, Stored("s", f"at strands_met_at, {_SINCE_FLOOR}")]
    collapsed_at: Annotated[
        float, Stored("s", "from the release until the loop enclosed less than half of its area; NaN if it never did")
    ]
    bounces_before_collapse: Annotated[int, Stored("1", "bounces begun at collapsed_at; −1 if it never came")]
    flight_before_collapse: Annotated[float, Stored("s", f"at collapsed_at, {_SINCE_FLOOR}")]
    softened_at: Annotated[float, Stored("s", "from the release to the softening of the joints; NaN if they were not")]
    wall_time: Annotated[float, Stored("s", "that the computer took, without the compilation of kernels")]
    bounces: Annotated[int, Stored("1", COUNTS["bounces"])]
    steps_accepted: Annotated[int, Stored("1", COUNTS["accepted"])]
    steps_rejected: Annotated[int, Stored("1", COUNTS["rejected"])]
    impulses: Annotated[dict[str, int], Stored("1", "by kind of contact", keys=IMPULSES)]
    greatest_opening: Annotated[float, Stored("m", EXTREMES["opening"])]
    greatest_penetration: Annotated[dict[str, float], Stored("m", "by kind of contact", keys=DEPTHS)]
    energy: Annotated[dict[str, float], Stored("J", "ledger of the walk", keys=ENERGIES)]
    sprocket_height: Annotated[
        float, Stored("m", "height of the sprocket's centre at the release; NaN without a sprocket or a release")
    ]
    release: Annotated[dict[str, float], Stored("m", "the loop at the release", keys=RELEASE)]
    release_speed: Annotated[float, Stored("m/s", "mean speed of link centres along the loop at the release")]
    setup: Setup
    seed: int | None
    versions: dict[str, str]
    time: Annotated[Array, Stored("s", "time since the release", "t")]
    center: Annotated[Array, Stored("m", "centre of mass x, y", "t 2")]
    center_velocity: Annotated[Array, Stored("m/s", "velocity of the centre of mass x, y", "t 2")]
    kinetic_energy: Annotated[Array, Stored("J", "kinetic energy", "t")]
    gravitational_energy: Annotated[Array, Stored("J", "energy of gravity, from the floor below the release", "t")]
    spring_energy: Annotated[Array, Stored("J", "energy of the joint springs", "t")]
    lowest: Annotated[Array, Stored("m", "height of the lowest point of all circles", "t")]
    rms_speed: Annotated[Array, Stored("m/s", "root mean square speed of the links", "t")]
    frame_time: Annotated[Array, Stored("s", "time since the release", "f")]
    frame_joints: Annotated[Array, Stored("m", "joints x, y; joint i ends link i, even links inner", "f n 2")]
    frame_forces: Annotated[
        Array,
        Stored(
            "N",
            "force x, y in each joint on the link that it ends, with the stiffness and damping of the moment, softened "
            "just after the release and after a collapse",
            "f n 2",
            empty="if not recorded",
        ),
    ]
    frame_moments: Annotated[
        Array, Stored("N m", "friction moment in each joint on the link that it ends", "f n", empty="if not recorded")
    ]
    center_z: Annotated[Array, Stored("m", "centre of mass z, to the right", "t", _FIXED)]
    tilt: Annotated[Array, Stored("rad", "tilt of the plane", "t", _FIXED)]
    yaw: Annotated[Array, Stored("rad", "heading of the plane's x axis, anticlockwise, turns counted", "t", _FIXED)]
    frame_origin: Annotated[Array, Stored("m", "origin of the plane's coordinates in the room", "f 3", _FIXED)]
    frame_axes: Annotated[Array, Stored("1", "axes of x and y of the plane in the room", "f 2 3", _FIXED)]
    before_release: BeforeRelease | None = None

    @property
    def sprocket_center(self) -> Array | None:
        """Centre of the sprocket x, y at the release [m], shape (2,); None without one."""
        return None if np.isnan(self.sprocket_height) else np.array([0.0, self.sprocket_height])

    @property
    def sprocket_radius(self) -> float:
        """Radius of the sprocket that links touch [m]; NaN without one."""
        scene, had_none = self.setup.scene, self.setup.start is not None and np.isnan(self.sprocket_height)
        return np.nan if had_none or scene.start == "ellipse" else contact_radius(scene, self.setup.parameters)

    @property
    def joints_in_room(self) -> Array | None:
        """Joints x, y, z [m] in the room, (f, n, 3), if the plane tilts; else None: `frame_joints` are in the room."""
        if self.setup.scene.plane == "fixed":
            return None
        return self.frame_origin[:, None, :] + self.frame_joints @ self.frame_axes

    def __repr__(self) -> str:
        """One line with the most important numbers."""
        error = self.energy_error
        warning = f", energy error {error:.1e}" if error > MOST_ENERGY_ERROR else ", inaccurate" * bool(self.warnings())
        return (
            f"<WalkResult {self.status.label}: dx {self.dx:.4g} m in {self.walk_time:.4g} s, "
            f"{self.bounces} bounce{'s' * (self.bounces != 1)}, {self.setup.described}, {self.setup.preset}{warning}>"
        )

    @property
    def energy_error(self) -> float:
        """Size of the energy unaccounted for, relative to the energy at release; above 0.05 the walk is inaccurate."""
        at_release = self.energy["kinetic_at_release"] + self.energy["potential_at_release"]
        return float(energy_error(at_release, self.energy["residual"]))

    def warnings(self) -> list[str]:
        """Why the walk is inaccurate, each with what to try: energy, joints or contacts; empty if it is not."""
        values = vars(self.setup.scene) | vars(self.setup.parameters)
        lengths = {name: least(values[name]) for name in LENGTHS}
        deepest = max(self.greatest_penetration.values())
        found = faults(self.energy_error, self.greatest_opening, deepest, lengths)
        return [FAULTS[name] for name, is_there in found.items() if is_there]

    def state(self, t: float) -> State:
        """The chain at the end of its first step at or after a time, as samples and frames are taken.

        The walk is run again until then, which takes as long as it took the first time. `warpchain.walk(start=state)`
        goes on with it, `dataclasses.replace` perturbs it.

        Args:
            t: time since the release [s], at most `walk_time`; not before the sprocket of a `release` vanishes, of
                which a state knows nothing.

        Raises:
            InputError: `t` is no such time, the chain was never released, or the device of the walk is not here.
        """
        from warpchain.walks.walk_phases import state_at

        is_released = not np.isnan(self.energy["kinetic_at_release"])
        return state_at(self.setup, t, self.walk_time if is_released else np.nan)

    def plot(
        self, kind: Kind = "height_and_speed", *, figure: "Figure | None" = None, ax: "Axes | None" = None
    ) -> "Figure":
        """Draw the walk.

        Args:
            kind: `height_and_speed` of the centre of mass, `film_strip` for the chain itself, `loop` for its loop on
                the sprocket just before the release, `energy` for its energies, `tilt` for tilt, yaw and lateral drift
                of a plane that tilts.
            figure: an empty matplotlib figure to draw into; by default a new one, which a notebook shows.
            ax: where to draw `energy`, the only figure with one pair of axes.

        Returns:
            The figure, that of `ax` if it is given.

        Raises:
            ValueError: the kind is unknown, the walk does not have what it shows (frames, `before_release`,
                energies), or `ax` does not suit the kind.
        """
        from warpchain.pictures.walk_figures import draw

        return draw(self, kind, figure=figure, ax=ax)

    def mean_loop(self) -> "StationaryLoop":
        """The loop on its sprocket just before the release: its mean shape, the forces in it, its kink.

        Raises:
            ValueError: the walk has kept nothing of that time, or too little.
        """
        from warpchain.loop.stationary_loop import average_loop

        return average_loop(self.setup, self.before_release, self.sprocket_center)

    def bounce_table(self) -> dict[str, Array]:
        """The bounces off a flat or sloping floor: columns of equal length, for example for `pandas.DataFrame`.

        `start` and `end` of contact [s], to a sample; `impulse_x`, `impulse_y` of the floor on the chain [N s];
        `sticks_at` [s], the first sample until which not all that touched slid one way (NaN: all did). A walk without
        series, or that was never released, has none.

        Raises:
            InputError: the plane tilts, or the floor is a profile.
        """
        return bounces(self.time, self.center_velocity, self.setup)

    def animate(self, path: str | os.PathLike[str], *, fps: float = 30.0, slow: float = 4.0) -> None:
        """Write a moving picture of the walk; the suffix of `path` gives the format: .gif, .mp4 or .html.

        Args:
            path: the file to write, whole or not at all; an older one is replaced.
            fps: pictures per second of playing time; in a .html file the browser decides.
            slow: playing time per simulated time; in a .html file the value at the start.

        Raises:
            ValueError: the walk has no frames, the suffix is another, `fps` or `slow` is not positive, or a GIF or
                MP4 would have too many pictures.
            ImportError: an .mp4 is asked for, and imageio-ffmpeg is not installed.
            OSError: the file cannot be written.
        """
        from warpchain.pictures.animation import animate

        animate(self, path, fps=fps, slow=slow)

    def _repr_png_(self) -> bytes | None:
        """The film strip, or height and speed if there are no frames; None if there is nothing to draw."""
        from warpchain.pictures.style import first_png

        return first_png(partial(self.plot, kind) for kind in ("film_strip", "height_and_speed"))

    def _repr_html_(self) -> str:
        """The most important numbers, why the walk is inaccurate if it is, a player if there are frames, the picture.

        What shows no frames, such as a notebook that is not trusted, shows the picture.
        """
        from warpchain.pictures.player import framed_player
        from warpchain.pictures.style import fragment

        shown = fragment("\n".join([repr(self), *self.warnings()]), self._repr_png_())
        try:
            return framed_player(self, max(60, SHOWN // self.setup.scene.links)) + shown
        except ValueError:  # no frames, or broken ones
            return shown

    def unit(self, name: str) -> str:
        """SI unit of a field; a `KeyError` if there is none of that name."""
        return STORED[name].unit

    def meaning(self, name: str) -> str:
        """One line saying what a field is; a `KeyError` if there is none of that name."""
        return STORED[name].described

    def to_dict(self) -> dict[str, Any]:
        """Everything but time series and frames, for JSON; a number that is not finite is None."""
        plain: dict[str, Any] = json_value(
            {
                "dx": self.dx,
                "status": self.status.label,
                "status_sentence": self.status.sentence,
                **{name: getattr(self, name) for name in NUMBERS},
                **{name: getattr(self, name) for name in ("sprocket_center", "sprocket_radius", "energy_error")},
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
        write_whole(path, hdf5_image(KIND, self._fill))

    def _fill(self, file: "h5py.File") -> None:
        """Fill an empty file."""
        file.attrs["status"], file.attrs["status_sentence"] = self.status.label, self.status.sentence
        file.attrs["setup"] = json.dumps(_setup_as_dict(self.setup), allow_nan=False)
        file.attrs["seed"], file.attrs["versions"] = json.dumps(self.seed), json.dumps(self.versions)
        write_fields(file, vars(self), NUMBERS)
        write_motion(file, vars(self))
        if self.setup.start is not None:
            write_state(file, self.setup.start)
        for name, quantity in Parameters.quantities().items():
            value = getattr(self.setup.parameters, name)
            put(file, f"parameters/{name}", value, quantity.unit, quantity.meaning).attrs["symbol"] = quantity.symbol


STORED: Final = stored_fields(WalkResult)
"""Fields of `WalkResult` that a file keeps: name → unit, meaning, shape."""
NUMBERS: Final = {name: stored for name, stored in STORED.items() if not stored.shape}
"""Those that are numbers, or dictionaries of them."""
MOTION: Final = {name: stored for name, stored in STORED.items() if stored.shape}
"""Those that are arrays."""


def write_motion(group: "h5py.Group", values: Mapping[str, Any], joints: type = np.float64) -> None:
    """Write the arrays of a walk, and `before_release`, into a group; `joints`: precision of what each joint has."""
    write_fields(group, values, MOTION, joints)
    if (before := values[BEFORE]) is not None:
        write_fields(group.create_group(BEFORE, track_order=True), vars(before), FIELDS, joints)


def read_motion(group: "h5py.Group", links: int) -> dict[str, Any]:
    """What `write_motion` wrote of a chain of so many links."""
    before = BeforeRelease(**read_fields(group[BEFORE], FIELDS, links)) if BEFORE in group else None
    return {**read_fields(group, MOTION, links), BEFORE: before}


def load_walk(path: str | os.PathLike[str]) -> WalkResult:
    """Read a walk that `WalkResult.save` wrote, or the `walk.h5` of a folder; every number comes back to the bit.

    Raises:
        OSError: the file cannot be read.
        InputError: the file is no walk, or belongs to another version of warpchain. It is a `ValueError`.
        DamagedFileError: the file is damaged, cut short or of an earlier warpchain. It is an `InputError`.
    """
    if os.path.isdir(path):
        record = os.path.join(path, "walk.h5")
        if not os.path.exists(record) and os.path.exists(os.path.join(path, "sweep.h5")):
            raise InputError(f"{path}: the folder of a sweep, not of a saved walk; {WANTED}")
        path = record
    remedy = "run the walk again, or fetch another copy of the file"
    with reading_hdf5(path, KIND, remedy, WANTED) as file:
        given = json.loads(file.attrs["setup"])
        try:
            sections: Any = {name: validated(model, given[name], name) for name, model in SECTIONS.items()}
            setup = Setup(preset=given["preset"], **sections)
            setup = replace(setup, start=read_state(file, setup))
        except InputError as error:
            raise InputError(f"{path}: {error}; read it with the version that wrote it") from None
        return WalkResult(
            status=Status[file.attrs["status"].upper()],
            setup=setup,
            seed=json.loads(file.attrs["seed"]),
            versions=json.loads(file.attrs["versions"]),
            **read_fields(file, NUMBERS, setup.scene.links),
            **read_motion(file, setup.scene.links),
        )


def _setup_as_dict(setup: Setup) -> dict[str, Any]:
    models = {name: getattr(setup, name).model_dump() for name in ("parameters", "scene", "options")}
    return {"preset": setup.preset, **models}


def write_state(file: "h5py.File", state: State) -> None:
    """Write a state of a walk; its setup is that of the file."""
    put(file, f"{_GROUP}/time", state.time, "s", "time since the release")
    for name, (unit, meaning) in _STATE.items():
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
    arrays = {name: group[name][()] for name in _STATE if name in group}
    return State(setup=setup, time=float(group["time"][()]), memory=memory, **arrays)
