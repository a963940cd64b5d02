"""Whether waves matter for the distance walked: pairs of walks that differ in them, and the table of waves.md.

    python docs/do_waves_matter.py --device cuda   # three minutes → docs/results/do_waves_matter.csv, table
    python docs/do_waves_matter.py                 # that file → table

Every walk of Table 1's chain with soft joints is held and released as ever. Then it walks several times from the same
state: as it is, with a drag on waves (see `warpchain.loop.wave_drag`), and with other viscous friction in its joints.
"""

import argparse
import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from page_tables import with_tables

from warpchain.engine.batch import Batch
from warpchain.files import write_whole
from warpchain.inputs.distributions import random_generator, sampled
from warpchain.inputs.setup import Setup, resolve
from warpchain.kernels import layout
from warpchain.loop.wave_drag import drag_waves
from warpchain.status import Status
from warpchain.walks.walk_phases import WalkRun

CELLS = ((60, 15.0), (60, 25.0), (120, 20.0), (120, 30.0), (180, 20.0), (180, 30.0))
STEP = 2e-3
"""Time [s] between two applications of the drag."""
LATEST = 5.0
"""Time [s] after which the drag ends; it ends earlier when the loop collapses and its joints soften."""
CLOSE = 0.06
"""The energy of waves is averaged over this time [s] after the first impact."""
SEED = 20180607
FOLDER = Path(__file__).parent
RESULTS = FOLDER / "results" / "do_waves_matter.csv"
PAGE = FOLDER / "waves.md"


@dataclass(frozen=True)
class Variant:
    """What differs from the plain walk after the release.

    Attributes:
        name: for people.
        drag: rate [1/s] at which fast waves die of it.
        longest: longest waves that are dragged, in links.
        friction: factor of the viscous friction of the joints.
    """

    name: str
    drag: float = 0.0
    longest: float = math.inf
    friction: float = 1.0


VARIANTS = (
    Variant("plain"),
    Variant("drag 1e-9/s", drag=1e-9),
    Variant("drag 50/s", drag=50.0),
    Variant("drag 50/s on waves of up to 24 links", drag=50.0, longest=24.0),
    Variant("drag 50/s on waves of up to 12 links", drag=50.0, longest=12.0),
    Variant("joint friction × 0.1", friction=0.1),
    Variant("joint friction × 10", friction=10.0),
)


@dataclass
class Walker:
    """One walk on its world.

    Attributes:
        cell: index in the cells.
        variant: index in the variants.
        run: its phases and outcome.
        energies: energy of waves over kinetic energy of the run along the path, at every step after the release.
        floor_at: step of the first impact on the floor; −1 before it.
    """

    cell: int
    variant: int
    run: WalkRun
    energies: list[float]
    floor_at: int = -1


def setups(cells: Sequence[tuple[int, float]], samples: int, device: str) -> Iterator[tuple[int, int, Setup]]:
    """Cell, variant and setup of every walk; variants of one sample share all that is drawn."""
    for cell, (links, frequency) in enumerate(cells):
        scene = {"links": links, "frequency": frequency, "start": "spinning"}
        options = {"method": "explicit", "device": device}
        plain = resolve("soft", scene=scene, options=options, parameters={})
        for sample in range(samples):
            drawn = sampled(plain, random_generator(SEED + 1_000_000 * cell + sample))
            for variant in range(len(VARIANTS)):
                yield cell, variant, drawn


def release(batch: Batch, walkers: Sequence[Walker]) -> list[int]:
    """Carry all walks to their release; returns the worlds that were released."""
    driven = list(range(len(walkers)))
    while driven:
        batch.run(driven, walkers[driven[0]].run.features)
        driven = [w for w in driven if walkers[w].run.next_phase() and walkers[w].run.phase.value != "walk"]
    released = [w for w, walker in enumerate(walkers) if walker.run.status == Status.RUNNING]
    for w in released:
        setup, variant = walkers[w].run.setup, VARIANTS[walkers[w].variant]
        friction = variant.friction * setup.parameters.viscous_friction
        batch.set_chain(w, setup.parameters.with_values({"viscous_friction": friction}), setup.scene.links)
    return released


def drag(batch: Batch, walkers: Sequence[Walker], worlds: Sequence[int], links: int) -> None:
    """Apply the drag to loops of n links, and note the energy of their waves."""
    position, velocity = batch.motions(worlds, links)
    chains = [walkers[w].run.setup.parameters for w in worlds]
    halves = np.array(
        [[(c.inner_mass, c.inner_mass, c.inner_inertia), (c.outer_mass, c.outer_mass, c.outer_inertia)] for c in chains]
    )
    inertia = np.tile(halves, (1, links // 2, 1))
    variants = [VARIANTS[walkers[w].variant] for w in worlds]
    share = np.array([1 - np.exp(-variant.drag * STEP) for variant in variants])
    length = np.array([c.link_length for c in chains])
    least = np.array([links / variant.longest for variant in variants])
    changed, energy, speed = drag_waves(position, velocity, inertia, length, share, least)
    is_dragged = np.flatnonzero(share > 0)
    batch.set_velocities([worlds[k] for k in is_dragged], changed[is_dragged])
    running = 0.5 * inertia[..., 0].sum(axis=1) * speed**2
    for w, ratio in zip(worlds, energy / running, strict=True):
        walker = walkers[w]
        walker.energies.append(float(ratio))
        if walker.floor_at < 0 and batch.counts(w)["floor"] > 0:
            walker.floor_at = len(walker.energies) - 1


def carry_on(batch: Batch, worlds: Sequence[int], walkers: Sequence[Walker], time: float, status: Status) -> None:
    """Carry worlds on to a time after their release."""
    batch.resume(worlds, time, status)
    batch.run(worlds, walkers[worlds[0]].run.features)


def walk_all(cells: Sequence[tuple[int, float]], samples: int, device: str) -> list[Walker]:
    """All walks, to their ends."""
    planned = list(setups(cells, samples, device))
    longest = max(links for links, _ in cells)
    batch = Batch(len(planned), longest, planned[0][2].options)
    walkers = [Walker(cell, variant, WalkRun(batch, w, s), []) for w, (cell, variant, s) in enumerate(planned)]
    waiting = release(batch, walkers)
    print(f"{len(waiting)} of {len(planned)} walks released", flush=True)
    looping, time = list(waiting), 0.0
    while looping and time < LATEST:
        for links in sorted({batch.links[w] for w in looping}):
            drag(batch, walkers, [w for w in looping if batch.links[w] == links], links)
        time += STEP
        carry_on(batch, looping, walkers, time, Status.FINISHED)
        looping = [
            w for w in looping if batch.status(w) == Status.FINISHED and np.isnan(batch.watched(w, layout.SOFTENED_AT))
        ]
    unfinished = [w for w in waiting if batch.status(w) == Status.FINISHED]
    if unfinished:
        carry_on(batch, unfinished, walkers, planned[0][2].scene.walk_limit, Status.TIME_LIMIT)
    for w in waiting:
        walkers[w].run.next_phase()
    return walkers


def mean_error(values: np.ndarray) -> tuple[float, float]:
    """Mean of what is a number, and its standard error; NaN of fewer than two."""
    known = values[~np.isnan(values)]
    if len(known) < 2:
        return float(np.sum(known)) if len(known) else math.nan, math.nan
    return float(known.mean()), float(known.std(ddof=1) / np.sqrt(len(known)))


def table(cells: Sequence[tuple[int, float]], samples: int, walkers: Sequence[Walker]) -> list[dict[str, object]]:
    """A row for each cell and variant: distance, its change against the plain walk in pairs, energy of the waves."""
    shape = (len(cells), samples, len(VARIANTS))
    dx, early, bounces, softened = (np.full(shape, np.nan) for _ in range(4))
    places = iter(np.ndindex(shape))
    for walker, place in zip(walkers, places, strict=True):
        outcome = walker.run.outcome()
        dx[place], softened[place] = outcome["dx"], outcome["softened_at"]
        if outcome["status"] == Status.AT_REST:
            bounces[place] = outcome["bounces"]
        if walker.floor_at >= 0:
            after = walker.energies[walker.floor_at : walker.floor_at + round(CLOSE / STEP)]
            early[place] = np.mean(after)
    rows: list[dict[str, object]] = []
    for cell, (links, frequency) in enumerate(cells):
        for k, variant in enumerate(VARIANTS):
            mean, error = mean_error(dx[cell, :, k])
            change, change_error = mean_error(dx[cell, :, k] - dx[cell, :, 0])
            rows.append(
                {
                    "links": links,
                    "frequency": frequency,
                    "variant": variant.name,
                    "walks": int(np.sum(~np.isnan(dx[cell, :, k]))),
                    "dx": round(mean, 4),
                    "dx_error": round(error, 4),
                    "change_percent": round(100 * change / np.nanmean(dx[cell, :, 0]), 2),
                    "change_error_percent": round(100 * change_error / np.nanmean(dx[cell, :, 0]), 2),
                    "wave_energy_percent": round(100 * float(np.nanmean(early[cell, :, k])), 3),
                    "bounces": round(float(np.nanmean(bounces[cell, :, k])), 2),
                    "softened_at": round(float(np.nanmean(softened[cell, :, k])), 3),
                }
            )
    return rows


def read(path: Path) -> list[dict[str, str]]:
    """The rows of a file."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def text(rows: Sequence[Mapping[str, str]]) -> str:
    """Markdown: mean Δx of the plain walks and its changes in pairs, ± standard error; and the energy of the waves."""
    names = list(dict.fromkeys(row["variant"] for row in rows))
    lines = ["| links, Hz | Δx / m | " + " | ".join(names[1:]) + " |", "|" + "---|" * (len(names) + 1)]
    for plain in (row for row in rows if row["variant"] == names[0]):
        cell = [row for row in rows if all(row[key] == plain[key] for key in ("links", "frequency"))][1:]
        changes = (f"{float(r['change_percent']):+.1f} ± {float(r['change_error_percent']):.1f} %" for r in cell)
        title = f"{plain['links']}, {float(plain['frequency']):g}"
        distance = f"{float(plain['dx']):.3f} ± {float(plain['dx_error']):.3f}"
        lines.append(f"| {title} | {distance} | " + " | ".join(changes).replace("-", "−") + " |")
    lines += ["", "| links, Hz | " + " | ".join(names) + " |", "|" + "---|" * (len(names) + 1)]
    for plain in (row for row in rows if row["variant"] == names[0]):
        cell = [row for row in rows if all(row[key] == plain[key] for key in ("links", "frequency"))]
        shares = (f"{float(row['wave_energy_percent']):.2g} %" for row in cell)
        lines.append(f"| {plain['links']}, {float(plain['frequency']):g} | " + " | ".join(shares) + " |")
    return "\n".join(lines)


def main() -> None:
    """Walk if a device is given; then write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--device", help="where to walk; none: the committed file")
    parser.add_argument("--samples", type=int, help="of each cell; 100 if not given")
    given = parser.parse_args()
    if given.samples and not given.device:
        parser.error("--samples: has no effect without --device; give one")
    if given.device:
        samples = given.samples or 100
        rows = table(CELLS, samples, walk_all(CELLS, samples, given.device))
        lines = [",".join(rows[0]), *(",".join(map(str, row.values())) for row in rows)]
        write_whole(RESULTS, "\n".join(lines) + "\n")
    found = text(read(RESULTS))
    print(found)
    write_whole(PAGE, with_tables(PAGE.read_text(encoding="utf-8"), {"matter": found}))


if __name__ == "__main__":
    main()
