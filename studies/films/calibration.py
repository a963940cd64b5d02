"""How well the posterior of a bank knows chains that the bank does not have, filmed by cameras with errors."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from studies.common import Array
from warpchain import InputError, films

Wanted = Mapping[tuple[int, float], int]  # Links and frequency of an experiment → number of films of it

CAMERA = films.Camera()


@dataclass(frozen=True)
class Calibration:
    """Errors of the posterior means of hidden chains."""

    names: tuple[str, ...]  # Of the parameters
    errors: Array  # Mean less truth, (films answered, p)
    sigmas: Array  # Standard deviations that the posterior says, likewise
    values: Array  # Truths, likewise
    refused: float  # Share of sets of films that were refused as outside of the bank
    chains: int  # Hidden chains, those that were refused among them

    @property
    def width(self) -> Array:
        """Standard deviation relative to the parameter."""
        return (self.sigmas / self.values).mean(axis=0)

    @property
    def bias(self) -> Array:
        """Mean error in standard deviations."""
        return (self.errors / self.sigmas).mean(axis=0)

    def coverage(self, size: float) -> Array:
        """Share of truths within so many standard deviations."""
        return (np.abs(self.errors) < size * self.sigmas).mean(axis=0)


def set_of_films(
    bank: films.Bank, chain: int, wanted: Wanted, errors: Array, random: np.random.Generator
) -> list[films.Film]:
    """Films of a chain of a bank by one camera, whose errors they share."""
    return [
        film.seen(CAMERA, errors, random)
        for experiment, count in wanted.items()
        for film in bank.films[chain][bank.experiments.index(experiment)][:count]
    ]


def calibrate(
    bank: films.Bank,
    truths: films.Bank,
    wanted: Wanted,
    *,
    believed: films.Camera = CAMERA,
    shared: Array | None = None,
    delay: float = 0.0,
) -> Calibration:
    """Film every hidden chain once and ask the bank for it.

    Films are made by `CAMERA`, with errors that are random or, in all films, `shared`, and a release that was set too
    late by a delay [s]; the posterior believes in a camera that may be another one.
    """
    random, found, refused = np.random.default_rng(1), [], 0
    for chain, values in enumerate(truths.values):
        errors = CAMERA.errors(random) if shared is None else shared
        seen = set_of_films(truths, chain, wanted, errors, random)
        try:
            answer = bank.posterior([replace(film, time=film.time - delay) for film in seen], believed)
        except InputError:
            refused += 1
            continue
        found.append((answer.mean - values, answer.sigma, values))
    errors, sigmas, values = np.reshape(found, (-1, 3, len(bank.names))).swapaxes(0, 1)
    return Calibration(tuple(bank.names), errors, sigmas, values, refused / len(truths.values), len(truths.values))
