"""Estimate a chain's parameters from videos, with a training set of simulated chains.

`TrainingSet.of` takes a sweep of chains whose parameters are sampled from a prior; each chain walks every experiment a
few times. `TrainingSet.posterior` adds a camera's errors to these walks, as many of each experiment as there are
videos. One ridge regression then maps all videos of a chain together to its parameters, and its residuals on held-out
chains are the uncertainties. Errors that the videos of one chain share, such as the camera's scale, are shared in the
training set as well. So more videos of one chain do not reduce them.

Clearance and phase, however, differ between the releases of one chain, so the training set must vary them between
its walks of a chain as well. Otherwise the regression would treat them as known, and its answers would be wrong.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations, product
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import InstanceOf

from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError, checked
from warpchain.results.block_result import BlockResult
from warpchain.results.sweep_result import SweepResult
from warpchain.video.camera import CAREFUL, CLOCK, Camera, Video, edges, summary
from warpchain.walks.rows import MISSING

FOUND: Final = (
    *("floor_friction", "viscous_friction", "coulomb_friction"),
    *("sprocket_radius", "circle_radius", "floor_restitution"),
)
"""Parameters that are estimated, if the training set samples them."""
OF_RELEASES: Final = ("clearance", "phase")
"""Quantities that differ between the releases of one chain; all other sampled quantities belong to the chain."""
DRAWS: Final = 4
"""Number of camera errors that are sampled for each chain of a training set."""
PENALTIES: Final = 10.0 ** np.arange(-6, 1.5, 0.5)
"""Penalties of the ridge regression. For each parameter the one with the smallest held-out residuals is used."""
FOLDS: Final = 8
"""Number of folds of the cross-validation; each fold is held out once."""
NEAR: Final = 0.5
"""Distance within which chains count as similar, in standard deviations of the prior."""
FEW: Final = 16.0
"""Number of similar chains (times `DRAWS`) at which errors are half theirs and half those of all chains."""
EDGE: Final = 2.0
"""An estimate more prior standard deviations than this from the prior mean, where chains are rare, is refused. …"""
IDENTIFIED: Final = 0.8
"""… If its error exceeds this many prior standard deviations, one more standard deviation is allowed."""


@dataclass(frozen=True, eq=False, repr=False)
class TrainingSet:
    """Simulated chains with known parameters, and error-free videos of their walks, to learn from.

    Make one with `TrainingSet.of`; then call `posterior` with the videos of a real chain.

    Attributes:
        names: names of the p parameters.
        values: parameters of each chain in SI units, shape (c, p).
        videos: `videos[c][e]` holds the videos of chain c in experiment e, one per repetition.
        tied: which of clearance and phase are equal in all videos of a chain, although real releases differ in them.
    """

    names: tuple[str, ...]
    values: Array
    videos: Sequence[Sequence[Sequence[Video]]]
    tied: tuple[str, ...] = ()

    @property
    def experiments(self) -> list[tuple[int, float]]:
        """Number of links and frequency [Hz] of each experiment."""
        return [(videos[0].links, videos[0].frequency) for videos in self.videos[0]]

    def __repr__(self) -> str:
        """One line."""
        names, experiments = ", ".join(self.names), len(self.experiments)
        return f"<TrainingSet of {len(self.values)} chains, {experiments} experiments each: {names}>"

    @classmethod
    def of(cls, result: SweepResult | BlockResult) -> Self:
        """Make a training set from a sweep or one of its blocks.

        Its axes are links, frequency and then repetitions, such as `phase`; its samples are the chains. Chains with a
        walk that failed, or that lasted less than 0.4 s, are left out. All parameters must be the same along the axes
        (`same_samples_along`). Clearance and phase must differ between the walks of a chain, so each of the two is an
        axis, or sampled and listed as `independent`.

        Raises:
            InputError: walks or recorded motions are missing, the axes are others, or parameters differ along them.
        """
        axes, shape = list(result.axes), result.shape
        names = tuple(name for name in FOUND if name in result.drawn)
        if axes[:2] != ["links", "frequency"]:
            raise InputError(
                f"grid: expected links, frequency and then repetitions, got {', '.join(axes)}; change the axes"
            )
        if not names or np.any(result.columns["status"] == MISSING):
            raise InputError("training_set: expected a finished sweep that samples parameters; run it to its end")
        columns = {name: result.columns[f"{name}_drawn"].reshape(-1, shape[-1]) for name in result.drawn}
        if any(np.any(columns[name] != columns[name][0]) for name in columns if name in Parameters.model_fields):
            remedy = f"use same_samples_along: [{', '.join(axes)}], and list no parameter as independent"
            raise InputError(f"training_set: its chains differ along the axes; {remedy}")
        alike = {name for name in columns if any(np.array_equal(*two) for two in combinations(columns[name], 2))}
        tied = tuple(name for name in OF_RELEASES if name not in axes and (name in alike or name not in columns))
        drawn = np.stack([columns[name] for name in names], axis=-1)
        walks, end = {}, CLOCK[-1] + 0.03
        for place, group in result.kept_motions(np.flatnonzero(result.kept)):  # in the order of the files
            if "frames/joints" in group and (time := group["series/time"][()])[-1] >= end:  # else it failed early
                links, frequency, *_ = at = tuple(map(int, np.unravel_index(place, shape)))
                setup = result.setup_at(at)
                walks[place] = Video(
                    time=time[time < end],
                    center=group["series/center"][time < end],
                    links=int(result.axes["links"][links]),
                    frequency=float(result.axes["frequency"][frequency]),
                    outline=edges(group["frames/joints"][0].astype(float)),
                    speed=setup.loop_speed,
                )
        places = np.moveaxis(np.arange(drawn[..., 0].size).reshape(shape[0] * shape[1], -1, shape[-1]), 2, 0)
        chains = np.flatnonzero(np.isin(places, list(walks)).all(axis=(1, 2)))
        if not len(chains):
            raise InputError("training_set: no motion was recorded; use record: {series: true, frames: true}")
        videos = [[[walks[place] for place in row] for row in chain] for chain in places[chains].tolist()]
        return cls(names, drawn[0, chains], videos, tied)

    def posterior(self, videos: Sequence[Video], camera: Camera = CAREFUL) -> "Posterior":
        """Estimate the parameters of the chain in these videos, with uncertainties.

        Args:
            videos: videos of one chain in experiments of this set, at most as many of each as it has repetitions.
                Outline and speed are used if all videos have them.
            camera: standard deviations of the errors of the camera that recorded all videos.

        Raises:
            InputError: a video belongs to no experiment of this set, contradicts the camera, or differs too much from
                the simulated chains; or clearance or phase is tied, and there are several videos.
        """
        videos = checked(videos, "videos", list[InstanceOf[Video]])
        if self.tied and len(videos) > 1:
            names = " and ".join(self.tied)
            remedy = f"sample it, and use independent: [{', '.join(self.tied)}]"
            raise InputError(f"training_set: {names} is the same in all videos of a chain, not in reality; {remedy}")
        groups: dict[tuple[int, float], list[Video]] = {}
        for video in videos:
            video.check(camera)
            groups.setdefault((video.links, video.frequency), []).append(video)
        counts, most = [len(group) for group in groups.values()], len(self.videos[0][0])
        if not counts or max(counts) > most or set(groups) - set(self.experiments) or len(self.values) < 4 * FOLDS:
            known = ", ".join(f"{n} links at {f:g} Hz" for n, f in self.experiments)
            enough = f"1 to {most} of each of {known}, and a training set of at least {4 * FOLDS} chains"
            raise InputError(f"videos: they do not match the training set; use {enough}")
        design = tuple((self.experiments.index(one), len(group)) for one, group in groups.items())
        has = all(video.outline is not None for video in videos), all(video.speed is not None for video in videos)
        trained = _trained(self, design, has, camera)
        found, distances = _regression(trained.rows, trained.values, _features(groups.values(), *has)[None])
        found, distance = _chosen(found, trained.penalties), distances[trained.penalties.min(), 0] / trained.furthest
        sigma, prior, residuals = _widths(trained, found)[0], self.values.std(axis=0), trained.residuals
        mean = (middle := self.values.mean(axis=0)) + prior * found[0]
        scale = prior * sigma / np.sqrt(np.mean(residuals**2, axis=0))
        edge = np.abs(found[0]) > np.where(sigma < IDENTIFIED, EDGE, EDGE + 1)
        if not distance <= 1 or edge.any():  # NaN, too
            numbers = zip(self.names, mean, middle, prior, edge | ~edge.any(), strict=True)
            off = [f"{name}: expected {m:.2g} ± {s:.2g}, got {x:.3g}" for name, x, m, s, shown in numbers if shown]
            suspects = "direction, origin, outline, speed (m/s), frequency, unit and release"
            raise InputError(f"videos: unlike the training set; check {suspects}, or widen the training set", *off)
        return Posterior(
            names=self.names,
            mean=mean,
            covariance=residuals.T @ residuals / len(residuals) * np.outer(scale, scale),
            prior_sigma=prior,
            coverage=trained.coverage,
            videos=len(videos),
            chains=len(self.values),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Estimated parameters of a chain, as a Gaussian; `TrainingSet.posterior` returns it and `print` shows it.

    Its errors are those that held-out chains of the training set have, with the most weight on similar chains.

    Attributes:
        names: names of the p parameters.
        mean: estimate of each parameter in SI units, shape (p,).
        covariance: covariance of the estimates, shape (p, p).
        prior_sigma: standard deviation of each parameter in the training set, shape (p,).
        coverage: fraction of held-out chains within 1 and within 1.96 standard deviations, shape (2, p).
        videos: number of videos.
        chains: number of chains in the training set.
    """

    names: tuple[str, ...]
    mean: Array
    covariance: Array
    prior_sigma: Array
    coverage: Array
    videos: int
    chains: int

    @property
    def sigma(self) -> Array:
        """Standard deviation of each estimate, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    def given(self, **measured: tuple[float, float]) -> Self:
        """The posterior after additional measurements, given as name=(value, standard error) in SI units.

        `coverage` does not change, because it was measured with the videos alone.
        """
        mean, covariance = self.mean, self.covariance
        for name, given in measured.items():
            if name not in self.names:
                raise InputError(f"{name}: not in the posterior; use one of {', '.join(self.names)}")
            value, error = checked_array(given, f"{name}=(value, error)", 2)
            k = self.names.index(name)
            gain = covariance[k] / (covariance[k, k] + error**2)
            mean, covariance = mean + gain * (value - mean[k]), covariance - np.outer(gain, covariance[k])
        return replace(self, mean=mean, covariance=covariance)

    def __str__(self) -> str:
        """A line for each parameter: estimate, relative error, and the coverage of its 68 and 95 % intervals."""
        count = "1 video" if self.videos == 1 else f"{self.videos} videos"
        lines = [f"{count}, a training set of {self.chains} chains; last: coverage of 68 and 95 % intervals"]
        for k, name in enumerate(self.names):
            unit = "" if (unit := Parameters.quantities()[name].unit) == "1" else f" {unit}"
            value = f"{self.mean[k]:.4g} ± {self.sigma[k]:.2g}{unit}"
            share = f"{100 * self.sigma[k] / self.mean[k]:.1f} %"
            covers = " and ".join(f"{100 * inside:.0f} %" for inside in self.coverage[:, k])
            known = ", no better than the prior" if self.sigma[k] > IDENTIFIED * self.prior_sigma[k] else ""
            lines.append(f"{name:18} {value:30} {share:>7}; {covers}{known}")
        return "\n".join(lines)


class _Trained(NamedTuple):
    """A fitted regression: features (k, m), parameters in prior standard deviations (k, p), best penalties.

    Residuals (k, p) are those of each chain's videos, from a fit without that chain. `furthest` is the distance of the
    most remote of them from the mean of the features.
    """

    rows: Array
    values: Array
    penalties: NDArray[np.intp]
    residuals: Array
    furthest: float
    coverage: Array


def _features(groups: Iterable[Iterable[Video]], outline: bool, speed: bool) -> Array:
    """Features of a set of videos: the mean summary of each experiment, concatenated."""
    return np.concatenate([np.mean([summary(video, outline, speed) for video in videos], axis=0) for videos in groups])


def _regression(rows: Array, values: Array, to: Array) -> tuple[Array, Array]:
    """Predictions of one ridge regression per penalty at other features, and their distances from the mean."""
    middle, spread, level = rows.mean(axis=0), rows.std(axis=0), values.mean(axis=0)
    scaled, to = (rows - middle) / spread, (to - middle) / spread
    power, axes = np.linalg.eigh(scaled.T @ scaled / len(scaled))
    turned, sizes = to @ axes, (np.maximum(power, 0) + PENALTIES[:, None])[:, None]
    slopes = axes.T @ (scaled.T @ (values - level)) / len(scaled)
    return level + turned / sizes @ slopes, np.sqrt((turned**2 / sizes).sum(axis=-1))


def _chosen(found: Array, penalties: NDArray[np.intp]) -> Array:
    """The prediction of each parameter with its own penalty, (penalties, k, p) → (k, p)."""
    return found[penalties, :, np.arange(len(penalties))].T


@lru_cache(16)
def _trained(
    training: TrainingSet, design: tuple[tuple[int, int], ...], has: tuple[bool, bool], camera: Camera
) -> _Trained:
    """Add camera errors to walks of all chains, as many of each experiment as in `design`, and cross-validate."""
    random, rows = np.random.default_rng(0), []
    for _, videos in product(range(DRAWS), training.videos):
        errors = camera.errors(random)
        walks = [[videos[at][k] for k in random.permutation(len(videos[at]))[:count]] for at, count in design]
        rows.append(_features([[walk.seen(camera, errors, random) for walk in group] for group in walks], *has))
    features, chains = np.array(rows), np.tile(np.arange(len(training.values)), DRAWS)
    values = ((training.values - training.values.mean(axis=0)) / training.values.std(axis=0))[chains]
    found, distances = np.empty((len(PENALTIES), *values.shape)), np.empty((len(PENALTIES), len(rows)))
    for fold in range(FOLDS):
        out = chains % FOLDS == fold
        found[:, out], distances[:, out] = _regression(features[~out], values[~out], features[out])
    penalties = ((values - found) ** 2).mean(axis=1).argmin(axis=0)
    residuals, furthest = values - _chosen(found, penalties), float(distances[penalties.min()].max())
    trained = _Trained(features, values, penalties, residuals, furthest, np.empty(0))
    sizes = np.abs(residuals) / _widths(trained, values - residuals, chains[:, None] == chains)
    return trained._replace(coverage=np.array([(sizes < size).mean(axis=0) for size in (1, 1.96)]))


def _widths(trained: _Trained, at: Array, but: Array | bool = False) -> Array:
    """Errors of predictions (m, p): those of similar chains, at least those of all; `but` excludes chains."""
    found, squares = trained.values - trained.residuals, trained.residuals**2
    away = (at**2).sum(axis=1)[:, None] + (found**2).sum(axis=1) - 2 * at @ found.T
    weights, common = np.exp(-away / (2 * NEAR**2)) * np.logical_not(but), squares.mean(axis=0)
    nearby = (weights @ squares + FEW * common) / (weights.sum(axis=1, keepdims=True) + FEW)
    return np.asarray(np.sqrt(np.maximum(nearby, common)))
