"""`WalkResult`, which `warpchain.walk` and `load_walk` return, and the HDF5 file of a saved walk.

A saved walk has the groups `series` (time series), `frames` (joint positions), `summary` (numbers), `parameters`
(physical parameters with their symbols) and, if it was recorded, `before_release`. Every dataset has its unit and
meaning. The attributes `setup`, `seed` and `versions`, in JSON, suffice to repeat the walk. Shards and merged files of
sweeps store the motion of a walk in the same groups. The fields are those of `warpchain.walks.walk_numbers`.
All dimensions have names and coordinates, so that `xarray.open_datatree(path)` reads the file.
"""

import json
import os
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from warpchain.chain.setup import Setup, State
from warpchain.files import write_whole
from warpchain.hdf5_files import (
    SWEEP_FILE,
    WALK_FILE,
    Format,
    dataset_of,
    hdf5_image,
    put,
    read_fields,
    reading_hdf5,
    write_fields,
)
from warpchain.inputs.fields import SECTIONS
from warpchain.inputs.figure_kinds import FigureWord
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError, checked_path, json_value, validated
from warpchain.loop.stationary_loop import LOOP_FIELDS
from warpchain.status import Status
from warpchain.walks.landmarks import MOST_ENERGY_ERROR
from warpchain.walks.walk_numbers import MOTION, NUMBERS, STORED, WalkNumbers, read_motion, write_motion

if TYPE_CHECKING:
    import h5py
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WANTED: Final = "use a saved walk; `walk --like SWEEP --index I` saves one"
SHOWN: Final = 12_000
"""Maximum number of joint positions that a notebook shows; 200 frames of 60 links take 0.12 MB."""

_GROUP: Final = "start"
"""Group of the state that a walk began from, so that the walk can be repeated bit for bit."""
_STATE: Final = {
    "position": ("m, m, rad", "x, y and angle of each link"),
    "velocity": ("m/s, m/s, rad/s", "their rates"),
    "origin": ("m", "origin of the plane's coordinates in the laboratory frame"),
    "axes": ("1", "x and y axes of the plane in the laboratory frame"),
    "plane_rates": ("m/s, rad/s, rad/s", "speed across the plane, and its turning rates about x and y"),
}
_FORMAT: Final = Format.of("warpchain walk", STORED, LOOP_FIELDS, {name: unit for name, (unit, _) in _STATE.items()})


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WalkResult(WalkNumbers):
    """One walk from its release to its end; `warpchain.walk` and `load_walk` return it.

    A walk has t record times and f frames of a chain of n links; units, meanings and shapes stand beside the fields.
    Time is measured from the release, x from the centre of the sprocket or ellipse, and y upwards from the floor. Time
    series have a row at every multiple of `record_interval` and at the end; at an impact, velocities and energies lie
    between the values before and after. Frames are taken at the ends of steps. `setup` is the complete definition of
    the walk, `seed` the seed of its sample (None: nothing was sampled), and `versions` names the software.
    `provenance` names command, date, system, processor or GPU and driver; it is empty for a walk recorded by a sweep.
    `before_release` is the motion on the sprocket just before the release, None if it was not recorded.

    Check `status` before you use `dx`, which is NaN unless the chain came to rest.
    """

    def __repr__(self) -> str:
        """One line with the most important numbers."""
        error = self.energy_error
        warning = f", energy error {error:.1e}" if error > MOST_ENERGY_ERROR else ", inaccurate" * bool(self.warnings())
        return (
            f"<WalkResult {self.status.label}: dx {self.dx:.4g} m in {self.walk_time:.4g} s, "
            f"{self.bounces} bounce{'s' * (self.bounces != 1)}, {self.setup.described}, {self.setup.preset}{warning}>"
        )

    def state(self, t: float) -> State:
        """Return the state of the chain at the end of the first step at or after a time.

        The walk is run again until then, which takes as long as the first time. `warpchain.walk(start=state)` continues
        from the state; `dataclasses.replace` makes a perturbed one.

        Args:
            t: time since the release [s], at most `walk_time`. With a moving sprocket (`release`), the time must be
                after the sprocket has vanished, because a state has no sprocket.

        Raises:
            InputError: `t` is outside this range, the chain was never released, or the walk's device is missing.
        """
        from warpchain.walks.restart import state_at  # brings Warp, which commands that read results do without

        is_released = not np.isnan(self.energy["kinetic_at_release"])
        return state_at(self.setup, t, self.walk_time if is_released else np.nan)

    def plot(
        self,
        kind: FigureWord = "height_and_speed",
        *,
        figure: "Figure | None" = None,
        ax: "Axes | None" = None,
        width: float | None = None,
    ) -> "Figure":
        """Draw the walk.

        Args:
            kind: `height_and_speed` of the centre of mass, `film_strip` of the chain, `loop` for the loop on the
                sprocket just before the release, `energy`, or `tilt` for tilt, yaw and lateral motion of a tilting
                plane.
            figure: an empty matplotlib figure to draw into; None: a new one, which a notebook shows.
            ax: axes to draw `energy` into, the only figure with a single pair of axes.
            width: width of a new figure [mm], e.g. 85 for a column of a paper; texts then have at least 6 pt.

        Returns:
            The figure; if `ax` is given, the figure of `ax`.

        Raises:
            ValueError: the kind is unknown, the walk lacks the data of this figure (frames, `before_release`,
                energies), or `ax` is not possible for the kind.
        """
        from warpchain.pictures.style import on_paper
        from warpchain.pictures.walk_figures import draw

        with on_paper(width) as inches:
            return draw(self, kind, figure=figure, ax=ax, width=inches)

    def animate(self, path: str | os.PathLike[str], *, fps: float = 30.0, slow: float = 4.0) -> None:
        """Write an animation of the walk; the suffix of `path` sets the format: .gif, .mp4 or .html.

        Args:
            path: file to write, completely or not at all; an older file is replaced.
            fps: frames per second of playing time; ignored for .html, where the browser decides.
            slow: playing time divided by simulated time; for .html the initial value.

        Raises:
            ValueError: the walk has no frames, the suffix is unknown, `fps` or `slow` is not positive, or a GIF or
                MP4 would have too many frames.
            ImportError: an .mp4 is requested, and imageio-ffmpeg is not installed.
            OSError: the file cannot be written.
        """
        from warpchain.pictures.animation import animate

        animate(self, path, fps=fps, slow=slow)

    def _repr_png_(self) -> bytes | None:
        """The film strip, or height and speed if there are no frames; None if there is nothing to draw."""
        from warpchain.pictures.style import first_png

        return first_png(partial(self.plot, kind) for kind in ("film_strip", "height_and_speed"))

    def _repr_html_(self) -> str:
        """The main numbers, warnings of inaccuracy, a player if there are frames, and the film strip.

        A notebook that is not trusted cannot run the player and shows the film strip only.
        """
        from warpchain.pictures.player import framed_player
        from warpchain.pictures.style import fragment

        shown = fragment("\n".join([repr(self), *self.warnings()]), self._repr_png_())
        try:
            return framed_player(self, max(60, SHOWN // self.setup.scene.links)) + shown
        except ValueError:  # no frames, or broken ones
            return shown

    def to_dict(self) -> dict[str, Any]:
        """Everything but time series and frames, for JSON; a number that is not finite is None."""
        plain: dict[str, Any] = json_value(
            {
                "dx": self.dx,
                "status": self.status.label,
                "status_sentence": self.status.sentence,
                **{name: getattr(self, name) for name in NUMBERS},
                **{name: getattr(self, name) for name in ("sprocket_center", "sprocket_radius", "energy_error")},
                "preset": self.setup.preset,
                **self.setup.sections,
                "seed": self.seed,
                "versions": self.versions,
                "provenance": self.provenance,
            }
        )
        return plain

    def to_xarray(self) -> "xarray.Dataset":
        """Numbers, time series and frames as a data set with named coordinates, units and meanings.

        Its dimensions are `time`, `frame_time`, `joint` and `axis`, and `room_axis` if the plane tilts. What a number
        has by key is named as in `energy_residual`; status, setup, seed and versions are attributes. The motion
        `before_release` has a data set of its own, `walk.before_release.to_xarray()`.
        """
        return dataset_of(vars(self), STORED).assign_attrs(self._notes())

    def to_pandas(self) -> "pandas.DataFrame":
        """The time series as a table with a row for each time; x and y have a column each, such as `center_x`."""
        import pandas

        columns: dict[str, Any] = {}
        for name in (name for name, each in MOTION.items() if each.shape in ("t", "t 2")):
            values = getattr(self, name)
            if values.ndim == 2:
                columns |= {f"{name}_{axis}": values[:, place] for place, axis in enumerate("xy")}
            elif len(values) == len(self.time):  # else the plane is fixed
                columns[name] = values
        return pandas.DataFrame(columns).set_index("time")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the walk to an HDF5 file, whole or not at all; an older file of that name is replaced.

        Raises:
            OSError: the file cannot be written, or something else than a regular file is there; one line that names it.
        """
        write_whole(path, hdf5_image(_FORMAT, self._fill))

    def _notes(self) -> dict[str, str]:
        """Attributes of a file or a data set: how the walk ended, and how to make it again."""
        return {
            "status": self.status.label,
            "status_sentence": self.status.sentence,
            "setup": json.dumps({"preset": self.setup.preset, **self.setup.sections}, allow_nan=False),
            "seed": json.dumps(self.seed),
            "versions": json.dumps(self.versions),
            "provenance": json.dumps(self.provenance),
        }

    def _fill(self, file: "h5py.File") -> None:
        """Fill an empty file."""
        file.attrs.update(self._notes())
        write_fields(file, vars(self), NUMBERS)
        write_motion(file, vars(self))
        if self.setup.start is not None:
            write_state(file, self.setup.start)
        for name, quantity in Parameters.quantities().items():
            value = getattr(self.setup.parameters, name)
            put(file, f"parameters/{name}", value, quantity.unit, quantity.meaning).attrs["symbol"] = quantity.symbol


def load_walk(path: str | os.PathLike[str]) -> WalkResult:
    """Load a walk that `WalkResult.save` wrote, or the `walk.h5` of a folder, with bitwise identical numbers.

    Raises:
        OSError: the file cannot be read.
        InputError: the file is no walk, or belongs to another version of warpchain. It is a `ValueError`.
        DamagedFileError: the file is damaged, cut short or of an earlier warpchain. It is an `InputError`.
    """
    path = checked_path(path, "path")
    if os.path.isdir(path):
        record = os.path.join(path, WALK_FILE)
        if not os.path.exists(record) and os.path.exists(os.path.join(path, SWEEP_FILE)):
            raise InputError(f"{path}: expected a saved walk, got the folder of a sweep; {WANTED}")
        path = record
    remedy = "run the walk again, or fetch another copy of the file"
    with reading_hdf5(path, _FORMAT, remedy, WANTED) as file:
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
            provenance=json.loads(file.attrs.get("provenance", "{}")),
            **read_fields(file, NUMBERS, setup.scene.links),
            **read_motion(file, setup.scene.links),
        )


def write_state(file: "h5py.File", state: State) -> None:
    """Write a state of a walk; its setup is that of the file."""
    put(file, f"{_GROUP}/time", state.time, "s", "time since the release")
    for name, (unit, meaning) in _STATE.items():
        if (values := getattr(state, name)) is not None:
            put(file, f"{_GROUP}/{name}", values, unit, meaning, _numbered(name, values))
    for name, values in state.memory.items():
        put(file, f"{_GROUP}/memory/{name}", values, "1", "what else the walk had then", _numbered(name, values))


def _numbered(name: str, values: Any) -> tuple[str, ...]:
    """Names of dimensions that have no meaning but for `State`, different for each array."""
    return tuple(f"{name.rpartition('/')[2]}_{place}" for place in range(np.ndim(values)))


def read_state(file: "h5py.File", setup: Setup) -> State | None:
    """The state that a walk began from; None if it began as its scene says."""
    if _GROUP not in file:
        return None
    group, memory = file[_GROUP], {}

    def remember(name: str, node: Any) -> None:
        if hasattr(node, "dtype") and not node.is_scale:
            memory[name] = np.array(node)

    if "memory" in group:
        group["memory"].visititems(remember)
    arrays = {name: group[name][()] for name in _STATE if name in group}
    return State(setup=setup, time=float(group["time"][()]), memory=memory, **arrays)
