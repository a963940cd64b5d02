"""How well a posterior recovers held-out chains from videos with the errors of a camera."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from studies.common import Array
from warpchain import InputError, video

Wanted = Mapping[tuple[int, float], int]  # Links and frequency of an experiment → number of videos of it

CAMERA = video.Camera()


@dataclass(frozen=True)
class Calibration:
    """Errors of the posterior means of hidden chains."""

    names: tuple[str, ...]  # Of the parameters
    errors: Array  # Mean less truth, (videos answered, p)
    sigmas: Array  # Standard deviations that the posterior says, likewise
    values: Array  # Truths, likewise
    refused: float  # Share of sets of videos that were refused as outside of the training set
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


def set_of_videos(
    training: video.TrainingSet, chain: int, wanted: Wanted, errors: Array, random: np.random.Generator
) -> list[video.Video]:
    """Videos of a chain of a training set by one camera, whose errors they share."""
    return [
        clip.seen(CAMERA, errors, random)
        for experiment, count in wanted.items()
        for clip in training.videos[chain][training.experiments.index(experiment)][:count]
    ]


def calibrate(
    training: video.TrainingSet,
    truths: video.TrainingSet,
    wanted: Wanted,
    *,
    believed: video.Camera = CAMERA,
    shared: Array | None = None,
    delay: float = 0.0,
) -> Calibration:
    """Record every hidden chain once and ask the training set for it.

    Videos are made by `CAMERA`, with errors that are random or, in all videos, `shared`, and a release that was set too
    late by a delay [s]; the posterior believes in a camera that may be another one.
    """
    random, found, refused = np.random.default_rng(1), [], 0
    for chain, values in enumerate(truths.values):
        errors = CAMERA.errors(random) if shared is None else shared
        seen = set_of_videos(truths, chain, wanted, errors, random)
        try:
            answer = training.posterior([replace(clip, time=clip.time - delay) for clip in seen], believed)
        except InputError:
            refused += 1
            continue
        found.append((answer.mean - values, answer.sigma, values))
    errors, sigmas, values = np.reshape(found, (-1, 3, len(training.names))).swapaxes(0, 1)
    return Calibration(tuple(training.names), errors, sigmas, values, refused / len(truths.values), len(truths.values))
