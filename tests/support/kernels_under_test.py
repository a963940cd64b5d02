"""Warp functions of the kernels, called from NumPy one by one.

What a kernel must fill is poisoned before its first launch: numbers with NaN, list entries with a joint that no
chain has. Kernels are compiled with the flags of the step kernels.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from tests.support.arrays import Array
from tests.support.blocks_under_test import floor_with
from tests.support.unlike_links import UnlikeLinks
from warpchain.chain.floor import Floor
from warpchain.engine.batch import Batch
from warpchain.engine.devices import start_device
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import Parameters
from warpchain.kernels import layout
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.contacts.terrain import Face
from warpchain.kernels.cpu.contacts.neighbour_list import list_slack, neighbour_list
from warpchain.kernels.cpu.contacts.proximity import fixed_contacts, greatest_opening
from warpchain.kernels.cpu.contacts.self_contacts import self_contacts
from warpchain.kernels.cpu.loop import load_state
from warpchain.kernels.cpu.placing import place_ends
from warpchain.kernels.features import COMPILER_FLAGS
from warpchain.kernels.types import Model, Worlds, read_ground

DEVICE = start_device("cpu").warp
POISONED_JOINT = 2**30
LEVEL = np.array([[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
"""Points of a level profile."""


compiled = functools.partial(
    wp.kernel, module="unique", enable_backward=False, module_options={"cpu_compiler_flags": COMPILER_FLAGS}
)


def poisoned(*shape: int) -> wp.array:
    """Memory that nothing has been written to."""
    return wp.full(shape, np.nan, dtype=wp.float64, device=DEVICE)


def model_of(chains: Sequence[tuple[int, Parameters | UnlikeLinks]]) -> Model:
    """Constants of chains of so many links each."""
    batch = Batch(len(chains), max(links for links, _ in chains), Options())
    for world, (links, chain) in enumerate(chains):
        if isinstance(chain, UnlikeLinks):
            batch.worlds[world].set_chain(chain.parameters, links, own=chain.own)
        else:
            batch.worlds[world].set_chain(chain, links)
    return batch.model


def chain_on_cpu(position: Array, velocity: Array, parameters: Parameters | UnlikeLinks) -> Worlds:
    """One chain; of its state only the links and the factor of its loads are set."""
    worlds = Worlds()
    worlds.model = model_of([(len(position), parameters)])
    worlds.load_factor = wp.ones(1, dtype=wp.float64, device=DEVICE)
    worlds.links = wp.array(np.hstack([position, velocity]).T[None], dtype=wp.float64, device=DEVICE)
    return worlds


# --- the contact pass ---

LIST, FLOOR, SPROCKET, SELF, TERRAIN, FAR = 1, 2, 4, 8, 16, 32
"""Parts of a pass, to be added up: make the neighbour list; resolve contacts; nothing was listed before."""

RESULTS = (
    *("opening", "floor_gap", "sprocket_gap", "fits", "slack"),
    *("floor", "sprocket", "self", "self_loss", "self_depth", "strands", "terrain_gap", "terrain"),
)


@functools.cache
def _contact_pass(columns: int) -> wp.Kernel:
    build_list = neighbour_list(columns)
    resolve_self_contacts = self_contacts(columns)
    floor_gap, resolve_floor = fixed_contacts("floor")
    sprocket_gap, resolve_sprocket = fixed_contacts("sprocket")
    terrain_gap, resolve_terrain = fixed_contacts("terrain")
    layout_of_list = list_layout(columns)

    @compiled
    def contact_pass(
        worlds: Worlds,
        scratch: wp.array3d(dtype=wp.float64),
        lists: wp.array2d(dtype=wp.int32),
        skin: wp.float64,
        sprocket_speed: wp.float64,
        push_rate: wp.float64,
        parts: int,
        results: wp.array2d(dtype=wp.float64),
    ):
        world = wp.tid()
        chain = worlds.model.chains[world]
        chain.push_rate = push_rate
        block = scratch[world]
        row = lists[world]
        plane = results[world]  # none of these bodies tilts
        pairs = wp.array(ptr=row.ptr, shape=(wp.static(layout_of_list.size),), dtype=wp.int32)
        load_state(block, chain, worlds, world)
        place_ends(block, chain)
        opening = greatest_opening(block, chain)
        results[world, 0] = opening
        face = Face()
        ground = read_ground(worlds.model, world)
        face.turning = sprocket_speed
        face.push_rate = push_rate
        results[world, 1] = floor_gap(block, chain, ground, face)
        results[world, 2] = sprocket_gap(block, chain, ground, face)
        if (parts & 1) != 0:
            pairs[wp.static(layout_of_list.count)] = wp.where((parts & 32) != 0, 0, 1)
            fits = build_list(block, pairs, chain, skin, opening)
            results[world, 3] = wp.where(fits, wp.float64(1.0), wp.float64(0.0))
        results[world, 4] = list_slack(block, chain, pairs[wp.static(layout_of_list.nearest)], opening)
        if (parts & 2) != 0:
            results[world, 1] = floor_gap(block, chain, ground, face)
            results[world, 5] = wp.float64(resolve_floor(block, plane, chain, ground, face))
        if (parts & 4) != 0:
            results[world, 2] = sprocket_gap(block, chain, ground, face)
            results[world, 6] = wp.float64(resolve_sprocket(block, plane, chain, ground, face))
        if (parts & 8) != 0:
            hits, strands, lost, depth = resolve_self_contacts(block, pairs, chain, opening)
            results[world, 7] = wp.float64(hits)
            results[world, 8] = lost
            results[world, 9] = depth
            results[world, 10] = wp.float64(strands)
        if (parts & 16) != 0:
            results[world, 11] = terrain_gap(block, chain, ground, face)
            results[world, 12] = wp.float64(resolve_terrain(block, plane, chain, ground, face))

    return contact_pass


@dataclass(frozen=True)
class Placed:
    """A chain to run the contact pass on: position (n, 3), velocity (n, 3), parameters."""

    position: Array
    velocity: Array
    parameters: Parameters | UnlikeLinks


class ContactPass:
    """Many chains, one after the other, on which parts of the contact pass are run."""

    def __init__(
        self,
        chains: Sequence[Placed],
        *,
        skin: float = 2e-3,
        sprocket_speed: float = 0.0,
        push_rate: float = 0.0,
        profile: Array = LEVEL,
        laws: Array | None = None,
    ) -> None:
        """Make room for chains and place them; the sprocket about the origin has their sprocket_radius."""
        self.links = [len(chain.position) for chain in chains]
        self.columns = layout.padded_width(max(self.links))
        self.skin, self.sprocket_speed, self.push_rate = skin, sprocket_speed, push_rate
        self.model = model_of([(len(chain.position), chain.parameters) for chain in chains])
        sizes = chains[0].parameters.link_length, max(self.model.chains.numpy()["circle_radius"])
        floor = floor_with(profile, chains[0].parameters) if laws is None else Floor(profile, laws)
        for name, rows in (("faces", floor.faces()), ("cells", floor.cells(*sizes))):
            same = np.repeat(rows[None], len(chains), axis=0)
            setattr(self.model, name, wp.array(same, dtype=wp.float64, device=DEVICE))
        worlds, rows, size = len(chains), layout.SCRATCH_ROWS, list_layout(self.columns).size
        self.worlds = Worlds()
        self.worlds.model = self.model
        self.worlds.load_factor = wp.ones(worlds, dtype=wp.float64, device=DEVICE)
        self.worlds.links = poisoned(worlds, 6, max(self.links))
        self.scratch = poisoned(worlds, rows, self.columns)
        self.lists = wp.full((worlds, size), POISONED_JOINT, dtype=wp.int32, device=DEVICE)
        self.place(chains)

    def place(self, chains: Sequence[Placed]) -> None:
        """Give the chains other positions and velocities; neighbour lists stay."""
        for world, chain in enumerate(chains):
            self.worlds.links.numpy()[world, :, : len(chain.position)] = np.hstack([chain.position, chain.velocity]).T

    def run(self, parts: int) -> list[dict[str, float]]:
        """Run parts of a pass from the states placed last: `RESULTS` of each chain, NaN if not computed."""
        results = poisoned(len(self.links), len(RESULTS))
        speeds = [self.sprocket_speed, self.push_rate]
        inputs = [self.worlds, self.scratch, self.lists, self.skin, *speeds, parts]
        kernel = _contact_pass(self.columns)
        wp.launch(kernel, dim=len(self.links), inputs=[*inputs, results], device=DEVICE)
        return [dict(zip(RESULTS, map(float, row), strict=True)) for row in results.numpy()]

    def velocity(self, world: int) -> Array:
        """Velocities (n, 3) that the last pass left."""
        return self._rows(world, layout.U, layout.V, layout.OMEGA).T

    def fixed_loss(self, world: int) -> float:
        """Energy lost to floor and sprocket in the last pass."""
        return float(self._rows(world, layout.LOST_FIXED).sum())

    def _rows(self, world: int, *rows: int) -> Array:
        return self.scratch.numpy()[world, list(rows), : self.links[world]].copy()
