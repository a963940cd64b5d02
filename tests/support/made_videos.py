"""Motions of chains by formula, and training_sets of them: nothing is simulated."""

from dataclasses import replace
from statistics import NormalDist

import numpy as np

from warpchain import video

TIME = np.arange(0.0, 0.39, 0.004)
GRAVITY = 9.809


def motion(friction: float, clearance: float = 0.01, stiffness: float = 1.0, frequency: float = 20.0) -> video.Video:
    """A video without errors: a free fall from a clearance, then a lift and, by Coulomb's law, μ times as much way.

    The sprocket's surface, and so the speed of the loop, is that of a radius of 6 cm; the outline is a box.
    """
    on_floor = np.maximum(TIME - np.sqrt(2 * clearance / GRAVITY), 0)
    lift = stiffness * (4 * on_floor**2 + 3e-4 * np.sin(60 * on_floor) ** 2)
    center = np.column_stack([friction * lift - 0.01, 0.17 + clearance - GRAVITY * TIME**2 / 2 + lift])
    outline = np.array([-0.06, 0.06, clearance + 0.004, clearance + 0.34])
    return video.Video(
        time=TIME, center=center, links=60, frequency=frequency, outline=outline, speed=0.12 * np.pi * frequency
    )


def made_training_set(
    chains: int,
    seed: int,
    repetitions: int = 4,
    experiments: tuple[tuple[int, float], ...] = ((60, 20.0),),
    clearances: tuple[float, ...] | None = None,
) -> video.TrainingSet:
    """Chains with drawn friction, radius (which outline and speed show) and restitution (which nothing shows).

    Each repetition has its clearance; None: each video has its own.
    """
    random = np.random.default_rng(seed)
    normal = [NormalDist().inv_cdf((number + 0.5) / chains) for number in range(chains)]  # so that few are enough
    drawn = np.column_stack([random.permutation(normal) for _ in range(3)])
    values = np.array([0.27, 0.056, 0.05]) + np.array([0.05, 0.0015, 0.01]) * drawn

    def clip(chain: int, frequency: float, repetition: int) -> video.Video:
        clearance = random.uniform(0.006, 0.014) if clearances is None else clearances[repetition]
        seen = motion(values[chain, 0], clearance, frequency=frequency)
        assert seen.outline is not None
        outline = seen.outline + (values[chain, 1] - 0.056 + random.normal() * 1e-4) * np.array([-1, 1, 0, 2])
        return replace(seen, outline=outline, speed=2 * np.pi * frequency * (values[chain, 1] + 0.004))

    walks = [
        [[clip(chain, frequency, number) for number in range(repetitions)] for _, frequency in experiments]
        for chain in range(chains)
    ]
    return video.TrainingSet(("floor_friction", "sprocket_radius", "floor_restitution"), values, walks)


def videos_of(
    training: video.TrainingSet, chain: int, count: int, camera: video.Camera, seed: int
) -> list[video.Video]:
    """Videos of a chain by one camera, whose errors they share."""
    random = np.random.default_rng(seed)
    errors = camera.errors(random)
    return [clip.seen(camera, errors, random) for clip in training.videos[chain][0][:count]]
