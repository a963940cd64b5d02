"""One chain of a batch, as the host sees it between launches: what is set before, read behind, taken out and put back.

Phases of walks, recorders, experiments with given chains and `bench` work on worlds. The names of arrays, such as
`state/time`, are those of the structs in `warpchain.kernels.types`; no other subpackage knows them.
"""

import hashlib
import math
import operator
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import warp as wp
from numpy.typing import ArrayLike, NDArray

from warpchain.chain.floor import Floor
from warpchain.chain.link_values import LinkValues, alternating, link_values
from warpchain.chain.setup import Setup
from warpchain.engine.tallies import COUNTS, EXTREMES, LOSSES
from warpchain.inputs.arrays import Array
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError
from warpchain.kernels import layout
from warpchain.kernels.cpu import stage_rows
from warpchain.kernels.cpu.implicit import rigid_layout
from warpchain.kernels.types import LOADING_TIME, STATE, Drive
from warpchain.status import Status

Snapshot = Mapping[str, NDArray[Any]]
"""Name → one world's part of an array."""

KEPT: Final = ("state/", "drive/")
"""How the names of arrays begin that are kept."""
RESULTS: Final = (
    "model/chains",
    *(f"state/{name}" for name in ("time", "watch", "first_sample", "last_sample", "counts", "extremes", "losses")),
)
"""Names of the arrays that say how a run went."""
CACHES: Final = ("scratch", "lists")
"""What follows from the state but for rounding, and fits a chain of the same constants and options only."""
_LAYOUT: Final = "layout"
"""Name in a snapshot of the digest of rows and fields that it has."""
_PARAMETERS: Final = tuple(Parameters.model_fields)
_VALUES: Final = operator.attrgetter(*_PARAMETERS)
FIRST_STEP = 1e-7  # s; it may grow fivefold per step


def _beginning() -> dict[str, Any]:
    """Fields of :class:`Worlds` of a chain whose clock is at zero."""
    watch, sample = np.full(layout.WATCH_ROWS, -1.0), np.zeros(layout.ALL_COLUMNS)
    watch[layout.GREATEST_LEAN], watch[layout.LAST_FLOOR_IMPULSE], sample[layout.TIME] = 0.0, -np.inf, -1.0
    zeros = ("time", "gap", "time_to_contact", "slack", "next_sample", "counts", "extremes", "losses", "closing_time")
    ones = ("load_factor", "is_fresh", "last_error")
    known = {"step": FIRST_STEP, "other_step": FIRST_STEP, "watch": watch, "last_sample": sample}
    return known | dict.fromkeys((*zeros, "has_first_stage", "is_rigid"), 0) | dict.fromkeys(ones, 1)


_BEGINNING = _beginning()


def _layout_digest() -> NDArray[np.uint8]:
    """What tells snapshots apart that kernels would read otherwise, as bytes: numbers of rows, fields of structs."""
    rows = [
        sorted((name, value) for name, value in vars(module).items() if name.isupper() and isinstance(value, int))
        for module in (layout, stage_rows, rigid_layout)
    ]
    text = repr((rows, [*STATE], [*Drive.vars]))  # type: ignore[attr-defined, unused-ignore]
    return np.frombuffer(hashlib.sha256(text.encode()).digest(), dtype=np.uint8)


class Recorded(NamedTuple):
    """What launches have recorded of a chain of n links: t samples and f frames, see :mod:`warpchain.kernels.layout`.

    Samples are (t, SAMPLE_COLUMNS), or ALL_COLUMNS if planes are kept; of the frames there are times [s], (f,), joints
    x, y [m], (f, n, 2), loads: force x, y [N] and moment [N m] of each joint on the link before it, (f, n, 3), and
    planes, (f, PLANE_VALUES). Of loads and planes that are not kept f is 0.
    """

    samples: Array
    times: Array
    frames: Array
    loads: Array
    planes: Array


class World:
    """One chain of a batch, or several that are set and read alike, between launches.

    Values that are set may be arrays over several worlds, axis 0; what is said of one entry is for one world.
    """

    def __init__(
        self, at: int | Sequence[int], host: Mapping[str, NDArray[Any]], caches: Mapping[str, wp.array]
    ) -> None:
        """See worlds by their numbers in the arrays of a batch, those on the host and those that stay on the device."""
        self._at: Any = at if isinstance(at, int) else np.asarray(at, dtype=np.intp)
        self._host, self._caches = host, caches

    @classmethod
    def together(cls, worlds: Sequence["World"]) -> "World":
        """Several worlds of one batch as one."""
        return cls([world._at for world in worlds], worlds[0]._host, worlds[0]._caches)

    @property
    def records(self) -> bool:
        """Whether samples or frames are kept."""
        return any(self._host[f"record/{name}"].shape[1] > 0 for name in ("samples", "frames"))

    def taken(self) -> "World":
        """A copy of `RESULTS` of several worlds, which may be used again; nothing else can be read from it."""
        return World(range(len(self._at)), {name: self._host[name].take(self._at, axis=0) for name in RESULTS}, {})

    @classmethod
    def joined(cls, taken: Sequence["World"]) -> "World":
        """What was `taken` from worlds of any batches, one behind the other."""
        parts = {name: np.concatenate([each._host[name] for each in taken]) for name in RESULTS}
        return cls(range(sum(len(each._at) for each in taken)), parts, {})

    @property
    def links(self) -> int:
        """Number of links n, of several worlds the greatest."""
        return int(self._host["model/chains"]["link_count"][self._at].max())

    def set_up(self, setups: Sequence[Setup]) -> LinkValues:
        """Set the chains of several worlds, which have equal numbers of links, and their floors: constants of walks.

        Returns what links and joints have of their own.
        """
        own = link_values([setup.scene for setup in setups], [setup.parameters for setup in setups])
        values = dict(zip(_PARAMETERS, np.array([_VALUES(setup.parameters) for setup in setups]).T, strict=True))
        values["sprocket_radius"] = np.array([setup.contact_radius for setup in setups])
        self._set_chain(values, setups[0].scene.links, own)
        for world, setup in zip(np.atleast_1d(self._at), setups, strict=True):
            if not setup.scene.is_level:
                World(int(world), self._host, self._caches).set_floor(setup.floor)
        return own

    def set_chain(self, parameters: Parameters, links: int, own: LinkValues | None = None) -> None:
        """Set the chain; by default, links alternate."""
        self._set_chain(vars(parameters), links, own or alternating(parameters, links))

    def _set_chain(self, parameters: dict[str, Any], links: int, own: LinkValues) -> None:
        """Set chains: values of parameters by name, numbers or arrays over the worlds, and what links have."""
        half = parameters["link_length"] / 2
        values = parameters | {
            "link_count": links,
            "half_length": half,
            "inverse_square": 1 / (half * half),
            "mass": own.total_mass,
            "circle_radius": own.radius.max(-1),
            "inverse_smoothing": 1 / parameters["friction_smoothing"],
        }
        chains = self._host["model/chains"]
        for name in chains.dtype.names or ():
            chains[name][self._at] = values.get(name, 0)
        self._host["model/links"][self._at, :, :links] = np.stack([*vars(own).values()], axis=-2)  # as in the layout

    def set_floor(self, floor: Floor) -> None:
        """Set the floor, after the chain, for whose size the floor's cells are made."""
        chain = self._host["model/chains"][self._at]
        cells = floor.cells(2 * chain["half_length"], chain["circle_radius"])
        for name, rows in (("model/faces", floor.faces()), ("model/cells", cells)):
            self._host[name][self._at, : len(rows)] = rows

    def load(
        self,
        position: Array,
        velocity: Array,
        *,
        stop_time: ArrayLike,
        stop_status: Status,
        attempts_before: ArrayLike = 0,
        softness: ArrayLike = 0.0,
        has_frame_marks: ArrayLike = False,
    ) -> None:
        """Set the state of the chain and start its clock at zero; its statistics and watches start anew.

        Position, (n, 3), is x, y [m], θ [rad], velocity their rates. The run ends exactly at the stop time [s], with
        the stop status. Attempts of earlier phases count towards the option `step_limit`. Softness is that of joints,
        see :mod:`warpchain.kernels.events.softening`. Frames are taken with samples, or at `frame_interval`.
        """
        marks = np.where(has_frame_marks, 0, -1)
        self.set_state(**_BEGINNING, next_frame=marks, softness=softness, attempts_before=attempts_before)
        self._host["record/sample_count"][self._at] = self._host["record/frame_count"][self._at] = 0
        self.place(position, velocity)
        self.resume(stop_time, stop_status)

    def set_state(self, **values: ArrayLike) -> None:
        """Set fields of :class:`Worlds`."""
        for name, value in values.items():
            self._host[f"state/{name}"][self._at] = value

    def set_drive(self, **values: ArrayLike) -> None:
        """Set fields of :class:`Drive`."""
        for name, value in values.items():
            self._host[f"drive/{name}"][self._at] = value

    def place(self, position: Array, velocity: Array) -> None:
        """Give the chain another place and rates, (n, 3) each, of w chains (w, n, 3); losses start anew."""
        rows = np.concatenate([position, velocity], axis=-1).swapaxes(-1, -2)
        self._host["state/links"][self._at, :, : rows.shape[-1]] = rows
        self.set_state(is_fresh=1)

    def resume(self, stop_time: ArrayLike, stop_status: Status) -> None:
        """Let a chain that has stopped run on to a later time, as if it had not stopped there."""
        self.set_state(stop_time=stop_time, stop_status=int(stop_status), status=int(Status.RUNNING))

    def set_plane(self, plane: Array) -> None:
        """Set the plane of the chain, which tilts: (PLANE_VALUES,), see :mod:`warpchain.kernels.layout`."""
        rows = np.zeros(layout.PLANE_ROWS)
        for first in (0, layout.PLANE_MID):
            rows[first : first + layout.PLANE_VALUES] = plane
        self.set_state(plane=rows)

    @property
    def plane(self) -> Array:
        """The plane of the chain, if it tilts: (PLANE_VALUES,), see :mod:`warpchain.kernels.layout`."""
        return np.array(self._host["state/plane"][self._at, : layout.PLANE_VALUES])

    @property
    def position(self) -> Array:
        """Places of the links, (n, 3): x, y [m], θ [rad]; of w chains of equal length (w, n, 3)."""
        return self._host["state/links"][self._at, :3, : self.links].swapaxes(-1, -2).copy()

    @property
    def velocity(self) -> Array:
        """Their rates, of the same shape."""
        return self._host["state/links"][self._at, 3:, : self.links].swapaxes(-1, -2).copy()

    @property
    def status(self) -> Status:
        """Status of the chain."""
        return Status(int(self._host["state/status"][self._at]))

    @property
    def time(self) -> float:
        """Time [s] since loading."""
        return float(self._host["state/time"][self._at])

    def state(self, name: str) -> NDArray[Any]:
        """A field of :class:`Worlds`."""
        return np.array(self._host[f"state/{name}"][self._at])

    def constant(self, name: str) -> NDArray[Any]:
        """A field of :class:`Chain`."""
        return np.array(self._host["model/chains"][name][self._at])

    @property
    def radius(self) -> Array:
        """Radius of the circles of each link [m]."""
        radii: Array = self._host["model/links"][self._at, layout.OWN_RADIUS, : self.links]
        return radii

    @property
    def counts(self) -> dict[str, int]:
        """Counters since loading."""
        return dict(zip(COUNTS, self._host["state/counts"][self._at].tolist(), strict=True))

    @property
    def extremes(self) -> dict[str, float]:
        """Greatest joint opening and depths [m] since loading."""
        return dict(zip(EXTREMES, self._host["state/extremes"][self._at].tolist(), strict=True))

    @property
    def losses(self) -> dict[str, float]:
        """Energy [J] lost since loading, by cause."""
        return dict(zip(LOSSES, self._host["state/losses"][self._at].tolist(), strict=True))

    def watched(self, row: int) -> Any:
        """An entry of :attr:`Worlds.watch` that is −1 until it is set, and then not negative; NaN while it is not."""
        entry = self._host["state/watch"][self._at, row]
        return np.where(entry >= 0, entry, math.nan)[()]

    @property
    def unloaded_at(self) -> Any:
        """Time [s] since loading from which a held loop has been under its own loads; NaN if it was not watched."""
        since = self.watched(layout.UNLOADED_SINCE) + float(LOADING_TIME)
        return np.where(np.isnan(since), self.watched(layout.LOADED_SINCE), since)[()]

    def drain(self) -> Recorded:
        """Take what launches have recorded since it was last taken."""
        n, names = self.links, ("samples", "frame_times", "frames", "frame_loads")
        samples, times, frames, loads = (self._host[f"record/{name}"][self._at] for name in names)
        taken, count = (int(self._host[f"record/{name}"][self._at]) for name in ("sample_count", "frame_count"))
        self._host["record/sample_count"][self._at] = self._host["record/frame_count"][self._at] = 0
        rows = frames[:count]
        return Recorded(
            samples=samples[:taken].copy(),
            times=times[:count].copy(),
            frames=rows[:, : 2 * n].reshape(-1, 2, n).transpose(0, 2, 1).copy(),
            loads=loads[:count, : 3 * n].reshape(-1, 3, n).transpose(0, 2, 1).copy(),
            planes=rows[:, 2 * self._host["state/links"].shape[2] :].reshape(-1, layout.PLANE_VALUES).copy(),
        )

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """All that the next launch depends on."""
        kept = {name: np.array(values[self._at]) for name, values in self._host.items() if name.startswith(KEPT)}
        caches = {name: np.array(array[self._at].numpy()) for name, array in self._caches.items()}
        return kept | caches | {_LAYOUT: _layout_digest()}

    def restore(self, snapshot: Snapshot) -> None:
        """Put a snapshot back, of a chain of equal length, options and parameters; its caches may be absent.

        An `InputError` says that a warpchain with other rows or fields kept it.
        """
        if not np.array_equal(snapshot[_LAYOUT], _layout_digest()):
            raise InputError("start: this state was made with other kernels; take it again from its walk")
        for name, values in snapshot.items():
            if name.startswith(KEPT):
                self._host[name][self._at] = values
        for name, array in self._caches.items():
            if name in snapshot:
                own = array[self._at]
                wp.copy(own, wp.array(snapshot[name], dtype=own.dtype, device=own.device))

    def change(self, position: Array, velocity: Array) -> None:
        """Give a chain that was restored another state, of which nothing is known; its losses and samples start anew.

        Its clock, the softness of its joints, its counters and its watches go on.
        """
        self.place(position, velocity)
        self.set_state(**dict.fromkeys(("has_first_stage", "gap", "time_to_contact", "slack", "losses"), 0))
        if self._host["state/is_rigid"][self._at]:  # joints become rigid again as soon as they are quiet
            step, other = (float(self._host[f"state/{name}"][self._at]) for name in ("step", "other_step"))
            self.set_state(step=other, other_step=step, is_rigid=0, last_error=1.0)
        self._host["state/last_sample"][self._at, layout.TIME] = -1.0
