"""Waves of either direction given to loops at their release: how far do these walk?

Links turn by δθ cos(2πmj/n + φ), which bends the loop alike for both directions. Their rates say which way the wave
runs: a slow one stands in the room, against the motion of the links; a fast one runs with them. φ is drawn.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

import warpchain
from studies import common
from studies.common import Array, Columns, OverCells
from studies.waves import wave_drag
from studies.waves.drag import END, released
from studies.waves.wave_drag import RIGID, RUNNING, inertia_of, loop_motions, lowest, wave_motion

FOLDER = Path(__file__).parent
RESULTS = FOLDER / "results" / "directions.csv"
CELLS = tuple((links, frequency) for links in (60, 90, 120, 180) for frequency in (20.0, 30.0))
SAMPLES = 40
SEED = 3000
LENGTH = 12  # Links in a wave, about: a whole number of waves fits around the loop
ALIKE = "none, as slow and high as fast"
"""A loop without a wave that runs as slowly along itself, and whose lowest joint is as high, as with a fast wave."""
VARIANTS = (("none", 0.0), *((way, size) for size in (0.05, 0.15) for way in ("slow", "fast", ALIKE)))
"""Direction, and the amplitude of the links' angles [rad]."""


def with_wave(
    position: Array, velocity: Array, parameters: warpchain.Parameters, way: str, size: float, phase: float
) -> tuple[Array, Array]:
    """The state (n, 3), (n, 3) of a loop with a wave: joints are as open as before, momentum stays."""
    if way == ALIKE:
        moved, speeds = with_wave(position, velocity, parameters, "fast", size, phase)
        lift = lowest(moved, parameters.link_length) - lowest(position, parameters.link_length)
        ratio = running(moved, speeds, parameters) / running(position, velocity, parameters)
        return position + np.array([0, lift, 0]), velocity * ratio
    links, length, inertia = len(position), parameters.link_length, inertia_of(len(position), parameters)
    speed = running(position, velocity, parameters)
    number = max(3, round(links / LENGTH))
    wave = size * np.exp(1j * (2 * np.pi * number * np.arange(links) / links + phase))
    back = 1.0 if way == "slow" else -(number**2 - 3) / (number**2 + 1)
    before = position[:, 2]
    turn = _closing(lambda turn: np.exp(1j * (before + turn)) - np.exp(1j * before), wave.real, before)
    angle = before + turn

    def ends_of(rate: Array) -> Array:
        return 1j * ((velocity[:, 2] + rate) * np.exp(1j * angle) - velocity[:, 2] * np.exp(1j * before))

    wanted = back * speed / length * np.sin(2 * np.pi * number / links) * (1j * wave).real
    rate = _closing(ends_of, wanted, angle)
    # middles of links, from what their ends are moved
    ends = (length * (np.exp(1j * angle) - np.exp(1j * before)), length * ends_of(rate))
    places, speeds = (np.cumsum(end) - end / 2 for end in ends)
    moved = position + np.column_stack([places.real, places.imag, turn])
    moved[:, :2] += np.average(position[:, :2] - moved[:, :2], axis=0, weights=inertia[:, 0])
    change = np.column_stack([speeds.real, speeds.imag, rate])
    rigid = loop_motions(moved[None], np.array([length]))[0][:, RIGID]
    return moved, velocity + wave_motion(rigid, change[None], inertia[None])[1][0]


def running(position: Array, velocity: Array, parameters: warpchain.Parameters) -> float:
    """Speed [m/s] with which a loop runs along itself."""
    motions, _ = loop_motions(position[None], np.array([parameters.link_length]))
    inertia = inertia_of(len(position), parameters)
    return float(wave_motion(motions[:, RUNNING], velocity[None], inertia[None])[0][0, -1])


def _closing(ends: Callable[[Array], Array], values: Array, angle: Array) -> Array:
    """Values changed as little as may be so that the ends of all links add up to nothing, by Newton's method."""
    basis = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
    for _ in range(20):
        gap = np.sum(ends(values))
        values = values - basis @ np.linalg.solve(basis.T @ basis, [gap.real, gap.imag])
    return values


def distances(links: int, frequency: float) -> tuple[Array, Array]:
    """Δx (variants, samples), and the phases."""
    phases = 2 * np.pi * np.random.default_rng(SEED).random(SAMPLES)
    chains, states = [], []
    for sample, phase in enumerate(phases):
        position, velocity, parameters = released(links, frequency, SEED + sample)
        chains += [parameters] * len(VARIANTS)
        states += [with_wave(position, velocity, parameters, way, size, phase) for way, size in VARIANTS]
    position, velocity = (np.array(each) for each in zip(*states, strict=True))
    walking = warpchain.Chains(chains, position, velocity)
    walking.run(END, to_rest=True)
    dx = wave_drag.distances(walking, np.array([inertia_of(links, each) for each in chains]))
    return dx.reshape(SAMPLES, -1).T, phases


def reduced(dx: Array, phases: Array) -> Iterator[dict[str, object]]:
    """Of each variant: mean change of Δx in pairs, and its part ∝ cos(φ − φ₀) over that of Δx, in per cent."""
    for (way, size), walks in zip(VARIANTS[1:], dx[1:], strict=True):
        both = np.isfinite(walks) & np.isfinite(dx[0])
        change = 100 * (walks - dx[0])[both] / dx[0][both].mean()
        design = np.column_stack([np.ones(both.sum()), np.cos(phases[both]), np.sin(phases[both])])
        found, left, *_ = np.linalg.lstsq(design, change, rcond=None)
        variance = left[0] / (both.sum() - 3)
        explained = change.var() * both.sum() - left[0]
        numbers = {"change": change.mean(), "error": common.standard_error(change)}
        numbers |= {"by_phase": np.hypot(*found[1:]), "f": explained / 2 / variance}
        words = {"wave": way, "size": f"{size:g}", "pairs": int(both.sum())}
        yield words | {name: f"{value:.3f}" for name, value in numbers.items()}


def run() -> None:
    """Let all loops walk, and write the file."""
    rows = []
    for links, frequency in CELLS:
        print(links, frequency, flush=True)
        cell = {"links": links, "frequency": f"{frequency:g}"}
        rows += [cell | row for row in reduced(*distances(links, frequency))]
    common.write_rows(RESULTS, rows, SEED)


def change(way: str, size: float) -> OverCells:
    """What a wave changes of Δx, in per cent, from the file."""
    rows = rows_of(way, size)
    return common.OverCells(rows["change"], rows["error"])


def rows_of(way: str, size: float) -> Columns:
    """The rows of a wave in the file: change of Δx, its error, its part that follows the phase, F of that."""
    columns = common.read_columns(RESULTS)
    chosen = (columns["wave"] == way) & (columns["size"] == size)
    return {name: values[chosen] for name, values in columns.items()}


def summary() -> str:
    """Each wave over the cells, in Markdown."""
    lines = []
    for way, size in VARIANTS[1:]:
        over, rows = change(way, size), rows_of(way, size)
        ends = f"{over.values.min():+.0f} to {over.values.max():+.0f}"
        texts = over.text().removesuffix(" %"), ends, f"{over.typical:.1f}", f"{over.chi2:.0f}"
        lines.append([way.replace("none", "control"), f"{size:g}", *texts, f"{rows['f'].mean():.1f}"])
    head = "wave | amplitude / rad | mean / % | range / % | typical / % | χ² (8 d.o.f.) | F"
    return common.minus(common.table(head, lines))


def main(command: Annotated[str, typer.Argument()] = "") -> None:
    """Run the study if told so, by the word run; write the table of the page."""
    if command == "run":
        run()
    common.publish(FOLDER, {"directions": summary()})


if __name__ == "__main__":
    common.run_study(main)
