"""Reduces the folders of sweeps of chains to small banks, which `studies.films.run` reads.

    python -m studies.films.reduce film_bank film_bank_90 film_truths film_truths_paper

A bank is written for each block: film-banks/SWEEP_BLOCK.npz.
"""

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
            print(f"{result.name}_{name}: {len(bank.values)} chains, {bank.speed.size} walks")


def save(bank: films.Bank, path: Path) -> None:
    """Write a bank to a file, motions in single precision."""
    np.savez_compressed(path, **{k: v.astype("f4") if v.ndim > 2 else v for k, v in vars(bank).items()})


def load(path: Path) -> films.Bank:
    """Read what `save` wrote."""
    with np.load(path) as file:
        return films.Bank(**{name: file[name] if name == "names" else file[name].astype(float) for name in file.files})


if __name__ == "__main__":
    run_study(main)
