"""Reduces the folders of sweeps of chains to small banks, one for each block: film-banks/SWEEP_BLOCK.npz."""

from pathlib import Path

import numpy as np

import warpchain
from studies.common import run_study
from warpchain import films


def main(folders: list[str], to: Path = Path("film-banks")) -> None:
    """Write the banks."""
    to.mkdir(parents=True, exist_ok=True)
    for folder in folders:
        result = warpchain.load(folder)
        for name, block in result.blocks.items():
            bank = films.Bank.of(block)
            save(bank, to / f"{result.name}_{name}.npz")
            print(f"{result.name}_{name}: {bank}")


def save(bank: films.Bank, path: Path) -> None:
    """Write a bank to a file, motions in single precision."""
    first = bank.films[0][0][0]
    arrays = {
        name: np.array([[[getattr(film, name) for film in row] for row in chain] for chain in bank.films])
        for name in ("center", "outline", "speed")
    }
    known = {"names": bank.names, "values": bank.values, "experiments": bank.experiments, "time": first.time}
    np.savez_compressed(path, **known, **{name: array.astype("f4") for name, array in arrays.items()})


def load(path: Path) -> films.Bank:
    """Read what `save` wrote."""
    with np.load(path) as file:
        center, outline, speed = (file[name].astype(float) for name in ("center", "outline", "speed"))
        experiments, time, values = file["experiments"], file["time"], file["values"]
        names = tuple(file["names"].tolist())

    def film(*at: int) -> films.Film:
        links, frequency = experiments[at[1]].tolist()
        seen = {"center": center[at], "outline": outline[at], "speed": float(speed[at])}
        return films.Film(time=time, links=int(links), frequency=frequency, **seen)

    chains, count, most = speed.shape
    walks = [[[film(c, e, r) for r in range(most)] for e in range(count)] for c in range(chains)]
    return films.Bank(names, values, walks)


if __name__ == "__main__":
    run_study(main)
