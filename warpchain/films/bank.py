"""Which chain is in the films? Simulated chains that were filmed likewise say it, and how far to trust the answer.

A bank is a sweep of chains whose parameters are drawn from a prior; each chain walks every experiment a few times.
A camera with errors films them, as many walks of each experiment as there are films of the chain that is asked for.
One ridge regression gives the parameters from all films of a chain together, and its residuals on chains that it was
not fitted to are the errors. So what films have in common, errors of the camera and of the regression among them,
counts as common: more films do not make it smaller.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from warpchain.films.film import CLOCK, Array, Camera, Film, edges, summary
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError
from warpchain.store.block_result import BlockResult
from warpchain.store.sweep_result import SweepResult
from warpchain.walks.rows import MISSING

FOUND: Final = (
    "floor_friction",
    "viscous_friction",
    "coulomb_friction",
    "sprocket_radius",
    "circle_radius",
    "floor_restitution",
)
"""Parameters that a posterior has, as far as its bank draws them."""
PENALTIES: Final = 10.0 ** np.arange(-6, 1.5, 0.5)
"""Of the ridge regression; the one with the smallest residuals on held-out chains is taken, for each parameter."""
FOLDS: Final = 8
"""Parts of a bank; each is held out once."""
NEAR: Final = 0.5
"""Chains count as alike within so many standard deviations of the bank."""
FEW: Final = 16.0
"""With so many alike (chains times draws) errors are half theirs, half those of all."""
EDGE: Final = 2.0
"""An answer so many standard deviations off the middle of the bank, where few chains are, is refused …"""
IDENTIFIED: Final = 0.8
"""… if its error is smaller than so many of them."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Bank:
    """Chains whose parameters are known, and their walks: chain c, experiment e, repetition r.

    Attributes:
        names: of the parameters.
        values: of each chain, (c, p).
        experiments: links and frequency [Hz] of each, (e, 2).
        time: of the motions [s], (t,).
        center: centre of mass [m], (c, e, r, t, 2).
        outline: at the release [m], (c, e, r, 4).
        speed: of the loop [m/s], (c, e, r).
    """

    names: NDArray[np.str_]
    values: Array
    experiments: Array
    time: Array
    center: Array
    outline: Array
    speed: Array

    def __repr__(self) -> str:
        """One line."""
        return f"<Bank of {len(self.values)} chains, {len(self.experiments)} experiments each: {', '.join(self.names)}>"

    @classmethod
    def of(cls, result: SweepResult | BlockResult) -> Self:
        """The bank of a sweep, or a block, over links, frequency and repetitions, such as `phase`.

        Its samples are the chains; those of which a walk failed, or lasted for less than 0.4 s, are left out.

        Raises:
            InputError: walks or motions are missing, axes are others, or the chains differ along them.
        """
        axes, shape = list(result.axes), result.shape
        if axes[:2] != ["links", "frequency"]:
            raise InputError(f"grid: its axes are {', '.join(axes)}; give links, frequency and then repetitions")
        names = [name for name in FOUND if name in result.drawn]
        if not names or np.any(result.columns["status"] == MISSING):
            raise InputError("bank: walks are missing, or their chains are all the same; run the sweep to its end")
        drawn = np.stack([result.columns[f"{name}_drawn"] for name in names], axis=-1).reshape(
            -1, shape[-1], len(names)
        )
        if np.any(drawn != drawn[0]):
            raise InputError(f"bank: its chains differ along the axes; give same_samples_along: [{', '.join(axes)}]")
        found: dict[int, tuple[Array, ...]] = {}
        for place, group in result.kept_motions(np.flatnonzero(result.kept)):  # in the order of the files
            if "series/time" in group and "frames/joints" in group:  # a walk that failed early has none
                parts = (group[f"series/{name}"][()] for name in ("time", "center", "rms_speed"))
                found[place] = *parts, edges(group["frames/joints"][0].astype(float))
        if not found:
            raise InputError("bank: no motion was recorded; give record: {series: true, frames: true}")
        step = round(float(np.median(np.diff(next(iter(found.values()))[0]))), 4)
        time = np.arange(0.0, CLOCK[-1] + 0.03, step)
        motions = {place: each for place, each in found.items() if each[0][-1] >= time[-1]}
        cells = np.arange(result.columns["index"].size).reshape(shape[0] * shape[1], -1, shape[-1])
        chains = np.flatnonzero(np.isin(cells, list(motions)).all(axis=(0, 1)))
        places = np.moveaxis(cells[..., chains], 2, 0)

        def by_chain(value: Callable[[Array, Array, Array, Array], Any]) -> Array:
            values = np.array([value(*motions[place]) for place in places.ravel().tolist()])
            return values.reshape(*places.shape, *values.shape[1:])

        return cls(
            names=np.array(names),
            values=drawn[0, chains],
            experiments=np.array([(n, f) for n in result.axes["links"] for f in result.axes["frequency"]], float),
            time=time,
            center=by_chain(lambda t, center, *_: np.column_stack([np.interp(time, t, x) for x in center.T])),
            outline=by_chain(lambda *motion: motion[3]),
            speed=by_chain(lambda *motion: motion[2][0]),
        )

    def film(self, chain: int, experiment: int, repetition: int) -> Film:
        """A walk as a film without errors."""
        at, (links, frequency) = (chain, experiment, repetition), self.experiments[experiment]
        return Film(
            time=self.time,
            center=self.center[at],
            links=int(links),
            frequency=float(frequency),
            outline=self.outline[at],
            speed=float(self.speed[at]),
        )

    def posterior(self, films: Sequence[Film], camera: Camera | None = None, draws: int = 4) -> "Posterior":
        """The parameters of the chain in some films, and how well they would be known of chains of the bank.

        Args:
            films: one or more, of any experiments of the bank, at most as many of each as the bank has repetitions.
            camera: of all films.
            draws: number of times each chain of the bank is filmed, with other errors.

        Raises:
            InputError: a film is of no experiment of the bank, or not as the camera says, or lies outside of the bank.
        """
        camera, groups = camera or Camera(), dict[int, list[Film]]()
        for film in films:
            film.check(camera)
            at = np.flatnonzero((self.experiments == [film.links, film.frequency]).all(axis=1))
            most = self.speed.shape[2]
            if not len(at) or len(groups.setdefault(int(at[0]), [])) == most:
                known = ", ".join(f"{n:g} links at {f:g} Hz" for n, f in self.experiments)
                wrong = f"{film.links} links at {film.frequency:g} Hz"
                raise InputError(f"films: {wrong}, but the bank has {most} of each of {known}; give these, or a bank")
            groups[int(at[0])].append(film)
        if not groups or len(self.values) < 4 * FOLDS:
            wrong = f"{len(films)} films, a bank of {len(self.values)} chains"
            raise InputError(f"films: {wrong}; give at least one film, and {4 * FOLDS} chains")
        design = tuple(
            (at, len(group), all(film.outline is not None for film in group), all(film.speed for film in group))
            for at, group in groups.items()
        )
        fitted, residuals, sizes, furthest = _regression(self, design, camera, draws)
        mean, distance = fitted(_features(design, lambda at, number: groups[at][number])[None])
        middle, prior = self.values.mean(axis=0), self.values.std(axis=0)
        found = np.tile(self.values, (draws, 1)) - residuals
        sigma, common = _widths(residuals, found / prior, mean / prior)[0], np.sqrt((residuals**2).mean(axis=0))
        edge = np.abs(mean[0] - middle) > np.where(sigma < IDENTIFIED * prior, EDGE * prior, np.inf)
        if distance[0] > furthest or edge.any():
            far = f"{distance[0] / furthest:.2g} times as far from its middle as its furthest chain"
            thin = " and ".join(
                f"{name} {value:.3g}" for name, value in zip(self.names[edge], mean[0, edge], strict=True)
            )
            where = f"{thin} is at the edge" if edge.any() else far
            raise InputError(
                f"films: outside of the bank, {where}; check unit, floor, release, or give a bank about it"
            )
        return Posterior(
            names=tuple(self.names),
            mean=mean[0],
            covariance=residuals.T @ residuals / len(residuals) * np.outer(sigma / common, sigma / common),
            prior_sigma=prior,
            coverage=np.array([(sizes < 1).mean(axis=0), (sizes < 1.96).mean(axis=0)]),
            films=len(films),
            chains=len(self.values),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Posterior:
    """Parameters of a chain: a Gaussian, with the errors that held-out chains of the bank have, above all those alike.

    Attributes:
        names: of the parameters.
        mean: of each, in SI units.
        covariance: (p, p).
        prior_sigma: standard deviation of the bank.
        coverage: share of held-out chains within 1 and 1.96 standard deviations, (2, p).
        films: number of films.
        chains: number of chains of the bank.
    """

    names: tuple[str, ...]
    mean: Array
    covariance: Array
    prior_sigma: Array
    coverage: Array
    films: int
    chains: int

    @property
    def sigma(self) -> Array:
        """Standard deviations."""
        return np.sqrt(np.diag(self.covariance))

    def given(self, **measured: tuple[float, float]) -> Self:
        """The posterior after other measurements, name=(value, standard error); `coverage` stays that of the films."""
        mean, covariance = self.mean, self.covariance
        for name, (value, error) in measured.items():
            if name not in self.names:
                raise InputError(f"{name}: not in the posterior; give one of {', '.join(self.names)}")
            k = self.names.index(name)
            gain = covariance[k] / (covariance[k, k] + error**2)
            mean, covariance = mean + gain * (value - mean[k]), covariance - np.outer(gain, covariance[k])
        return replace(self, mean=mean, covariance=covariance)

    def __str__(self) -> str:
        """A line for each parameter, and the share of held-out chains of the bank inside of their intervals."""
        count = "1 film" if self.films == 1 else f"{self.films} films"
        lines = [f"{count}, a bank of {self.chains} chains; last: of held-out chains, inside of 68 and 95 % intervals"]
        for k, name in enumerate(self.names):
            unit = "" if (unit := Parameters.quantities()[name].unit) == "1" else f" {unit}"
            value = f"{self.mean[k]:.4g} ± {self.sigma[k]:.2g}{unit}"
            share = f"{100 * self.sigma[k] / self.mean[k]:.1f} %"
            covers = " and ".join(f"{100 * inside:.0f} %" for inside in self.coverage[:, k])
            known = ", as before the film" if self.sigma[k] > IDENTIFIED * self.prior_sigma[k] else ""
            lines.append(f"{name:18} {value:30} {share:>7}; {covers}{known}")
        return "\n".join(lines)


_Design = tuple[tuple[int, int, bool, bool], ...]
"""Of each experiment that was filmed its number in the bank, how many films there are, and what all of them have."""
_Fitted = Callable[[Array], tuple[Array, Array]]
"""Features of some sets of films → values, and squared distances from the middle of the bank."""


def _features(design: _Design, film_at: Callable[[int, int], Film]) -> Array:
    """What a set of films says: of each experiment the mean of the summaries."""
    means = [np.mean([summary(film_at(at, k), *has) for k in range(count)], axis=0) for at, count, *has in design]
    return np.concatenate(means)


@lru_cache(16)
def _regression(bank: Bank, design: _Design, camera: Camera, draws: int) -> tuple[_Fitted, Array, Array, float]:
    """Ridge regression of the parameters on the films of a chain.

    Returns:
        What was fitted; residuals of each chain in each draw, fitted without that chain; their sizes relative to the
        errors that the other chains would have given; and the greatest distance.
    """
    random, repetitions = np.random.default_rng(0), bank.speed.shape[2]

    def row(draw: int, chain: int) -> Array:
        errors = camera.errors(random)
        return _features(
            design, lambda at, k: bank.film(chain, at, (draw + k) % repetitions).seen(camera, errors, random)
        )

    rows = np.array([row(draw, chain) for draw in range(draws) for chain in range(len(bank.values))])
    chains = np.tile(np.arange(len(bank.values)), draws)
    values = bank.values[chains]

    def fit(train: NDArray[np.bool_]) -> Callable[[Array, Array], tuple[Array, Array]]:
        """What gives values and distances of features, given a penalty for each parameter."""
        middle, spread, level = rows[train].mean(axis=0), rows[train].std(axis=0), values[train].mean(axis=0)
        scaled = (rows[train] - middle) / spread
        power, axes = np.linalg.eigh(scaled.T @ scaled / len(scaled))
        slopes = axes.T @ (scaled.T @ (values[train] - level)) / len(scaled)

        def fitted(to: Array, penalties: Array) -> tuple[Array, Array]:
            turned, sizes = (to - middle) / spread @ axes, np.maximum(power, 0)[:, None] + penalties
            return level + turned @ (slopes / sizes), (turned**2 / sizes.min(axis=1)).sum(axis=-1)

        return fitted

    folds = [(chains % FOLDS == fold, fit(chains % FOLDS != fold)) for fold in range(FOLDS)]

    def held_out(penalties: Array) -> tuple[Array, Array]:
        """Residuals and distances."""
        found, distances = np.empty_like(values), np.empty(len(rows))
        for out, fitted in folds:
            found[out], distances[out] = fitted(rows[out], penalties)
        return values - found, distances

    width, whole = np.ones(values.shape[1]), fit(np.ones(len(rows), bool))
    squares = [(held_out(penalty * width)[0] ** 2).mean(axis=0) for penalty in PENALTIES]
    best = PENALTIES[np.argmin(squares, axis=0)]
    residuals, distances = held_out(best)
    found, same = (values - residuals) / values.std(axis=0), chains[:, None] == chains
    sizes = np.abs(residuals) / _widths(residuals, found, found, same)
    return lambda features: whole(features, best), residuals, sizes, float(distances.max())


def _widths(residuals: Array, found: Array, at: Array, but: NDArray[np.bool_] | None = None) -> Array:
    """Errors at some places, (m, p): those of chains nearby, and at least those of all.

    Args:
        residuals: of all chains, (k, p).
        found: where these were found, in standard deviations of the bank, (k, p).
        at: the places, likewise, (m, p).
        but: chains that do not count, (m, k).
    """
    squares = (at**2).sum(axis=1)[:, None] + (found**2).sum(axis=1) - 2 * at @ found.T
    weights = np.exp(-squares / (2 * NEAR**2)) * (1.0 if but is None else ~but)
    common = (residuals**2).mean(axis=0)
    nearby = (weights @ residuals**2 + FEW * common) / (weights.sum(axis=1, keepdims=True) + FEW)
    return np.asarray(np.sqrt(np.maximum(nearby, common)))
