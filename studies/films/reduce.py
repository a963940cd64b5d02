"""Reduces the folders of sweeps of chains to small banks, which `studies.films.run` reads.

    python -m studies.films.reduce film_bank film_bank_90 film_truths film_truths_paper

A bank is written for each block: film-banks/SWEEP_BLOCK.npz.
"""

from pathlib import Path

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
            bank.save(to / f"{result.name}_{name}.npz")
            print(f"{result.name}_{name}: {len(bank.values)} chains, {bank.speed.size} walks")


if __name__ == "__main__":
    run_study(main)
