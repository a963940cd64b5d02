"""Which chain is in the films? Simulated chains that were filmed likewise say it, and how far to trust the answer.

A bank is a sweep of chains whose parameters are drawn from a prior; each chain walks every experiment a few times.
A camera with errors films them, as many walks of each experiment as there are films of the chain that is asked for.
One ridge regression gives the parameters from all films of a chain together, and its residuals on chains that it was
not fitted to are the errors. So what films have in common, errors of the camera and of the regression among them,
counts as common: more films do not make it smaller.

What films of a chain do not have in common must not be common in the bank either: every release has a clearance and a
phase of its own. A bank whose films of a chain share them would take what they have in common for known, and be wrong.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations, product
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import InstanceOf

from warpchain.films.film import CAREFUL, CLOCK, Camera, Film, edges, summary
from warpchain.inputs.arrays import Array, checked_array
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError, checked
from warpchain.results.block_result import BlockResult
from warpchain.results.sweep_result import SweepResult
from warpchain.walks.rows import MISSING

FOUND: Final = (
    *("floor_friction", "viscous_friction", "coulomb_friction"),
    *("sprocket_radius", "circle_radius", "floor_restitution"),
)
"""Parameters that a posterior has, as far as its bank draws them."""
OF_RELEASES: Final = ("clearance", "phase")
"""What every film of a chain has of its own; all other drawn parameters are the chain's."""
DRAWS: Final = 4
"""Times that each chain of a bank is filmed, with other errors."""
PENALTIES: Final = 10.0 ** np.arange(-6, 1.5, 0.5)
"""Of the ridge regression; the one with the smallest residuals on held-out chains is taken, for each parameter."""
FOLDS: Final = 8
"""Parts of a bank; each is held out once."""
NEAR: Final = 0.5
"""Chains count as alike within so many standard deviations of the bank."""
FEW: Final = 16.0
"""With so many alike (chains times draws) errors are half theirs, half those of all."""
EDGE: Final = 2.0
"""An answer so many standard deviations off the middle of the bank, where few chains are, is refused, …"""
IDENTIFIED: Final = 0.8
"""… of a parameter whose error is larger than so many of them one that is another standard deviation off."""


@dataclass(frozen=True, eq=False, repr=False)
class Bank:
    """Chains whose parameters are known, and films of their walks without errors.

    Attributes:
        names: of the parameters.
        values: of each chain, (c, p).
        films: `films[c][e]` are those of chain c in experiment e, one for each repetition.
        tied: what two films of a chain have in common although releases differ in it, of clearance and phase.
    """

    names: tuple[str, ...]
    values: Array
    films: Sequence[Sequence[Sequence[Film]]]
    tied: tuple[str, ...] = ()

    @property
    def experiments(self) -> list[tuple[int, float]]:
        """Links and frequency [Hz] of each."""
        return [(films[0].links, films[0].frequency) for films in self.films[0]]

    def __repr__(self) -> str:
        """One line."""
        return f"<Bank of {len(self.values)} chains, {len(self.experiments)} experiments each: {', '.join(self.names)}>"

    @classmethod
    def of(cls, result: SweepResult | BlockResult) -> Self:
        """The bank of a sweep, or a block, over links, frequency and repetitions, such as `phase`.

        Its samples are the chains; those of which a walk failed, or lasted for less than 0.4 s, are left out. The sweep
        has the same samples along all axes, but of clearance and phase, which differ between the films of a chain: each
        is an axis, or drawn and `independent`.

        Raises:
            InputError: walks or motions are missing, axes are others, or the chains differ along them.
        """
        axes, shape = list(result.axes), result.shape
        names = tuple(name for name in FOUND if name in result.drawn)
        if axes[:2] != ["links", "frequency"]:
            raise InputError(f"grid: its axes are {', '.join(axes)}; give links, frequency and then repetitions")
        if not names or np.any(result.columns["status"] == MISSING):
            raise InputError("bank: walks are missing, or their chains are all the same; run the sweep to its end")
        columns = {name: result.columns[f"{name}_drawn"].reshape(-1, shape[-1]) for name in result.drawn}
        if any(np.any(columns[name] != columns[name][0]) for name in columns if name in Parameters.model_fields):
            remedy = f"give same_samples_along: [{', '.join(axes)}], and no parameter as independent"
            raise InputError(f"bank: its chains differ along the axes; {remedy}")
        alike = {name for name in columns if any(np.array_equal(*two) for two in combinations(columns[name], 2))}
        tied = tuple(name for name in OF_RELEASES if name not in axes and (name in alike or name not in columns))
        drawn = np.stack([columns[name] for name in names], axis=-1)
        walks, end = {}, CLOCK[-1] + 0.03
        for place, group in result.kept_motions(np.flatnonzero(result.kept)):  # in the order of the files
            if "frames/joints" in group and (time := group["series/time"][()])[-1] >= end:  # else it failed early
                links, frequency, *_ = at = tuple(map(int, np.unravel_index(place, shape)))
                setup = result.setup_at(at)
                walks[place] = Film(
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
            raise InputError("bank: no motion was recorded; give record: {series: true, frames: true}")
        films = [[[walks[place] for place in row] for row in chain] for chain in places[chains].tolist()]
        return cls(names, drawn[0, chains], films, tied)

    def posterior(self, films: Sequence[Film], camera: Camera = CAREFUL) -> "Posterior":
        """The parameters of the chain in some films, and how well they would be known of chains of the bank.

        Args:
            films: of the bank's experiments, of each at most its repetitions; outline and speed count if all have them.
            camera: of all films.

        Raises:
            InputError: a film is of no experiment of the bank, or not as the camera says, or lies outside of the bank;
                or the bank takes for common to several films what each release has of its own.
        """
        films = checked(films, "films", list[InstanceOf[Film]])
        if self.tied and len(films) > 1:
            names = " and ".join(self.tied)
            remedy = f"draw it, and give the sweep independent: [{', '.join(self.tied)}]"
            raise InputError(
                f"bank: {names} is the same in all films of a chain, but each release has its own; {remedy}"
            )
        groups: dict[tuple[int, float], list[Film]] = {}
        for film in films:
            film.check(camera)
            groups.setdefault((film.links, film.frequency), []).append(film)
        counts, most = [len(group) for group in groups.values()], len(self.films[0][0])
        if not counts or max(counts) > most or set(groups) - set(self.experiments) or len(self.values) < 4 * FOLDS:
            known = ", ".join(f"{n} links at {f:g} Hz" for n, f in self.experiments)
            enough = f"1 to {most} of each of {known}, and a bank of {4 * FOLDS} chains or more"
            raise InputError(f"films: they are not those of the bank; give {enough}")
        design = tuple((self.experiments.index(one), len(group)) for one, group in groups.items())
        has = all(film.outline is not None for film in films), all(film.speed is not None for film in films)
        trained = _trained(self, design, has, camera)
        found, distances = _regression(trained.rows, trained.values, _features(groups.values(), *has)[None])
        found, distance = _chosen(found, trained.penalties), distances[trained.penalties.min(), 0] / trained.furthest
        sigma, prior, residuals = _widths(trained, found)[0], self.values.std(axis=0), trained.residuals
        mean = (middle := self.values.mean(axis=0)) + prior * found[0]
        scale = prior * sigma / np.sqrt(np.mean(residuals**2, axis=0))
        edge = np.abs(found[0]) > np.where(sigma < IDENTIFIED, EDGE, EDGE + 1)
        if not distance <= 1 or edge.any():  # NaN, too
            numbers = zip(self.names, mean, middle, prior, edge | ~edge.any(), strict=True)
            off = [f"{name}: {x:.3g}, in the bank {m:.2g} ± {s:.2g}" for name, x, m, s, shown in numbers if shown]
            suspects = "direction, origin, outline, speed (m/s), frequency, unit and release"
            raise InputError(f"films: unlike the bank; check {suspects}; if right, give one about these values", *off)
        return Posterior(
            names=self.names,
            mean=mean,
            covariance=residuals.T @ residuals / len(residuals) * np.outer(scale, scale),
            prior_sigma=prior,
            coverage=trained.coverage,
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
        for name, given in measured.items():
            if name not in self.names:
                raise InputError(f"{name}: not in the posterior; give one of {', '.join(self.names)}")
            value, error = checked_array(given, f"{name}=(value, error)", 2)
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


class _Trained(NamedTuple):
    """A bank that was filmed: features (k, m), parameters in standard deviations of the bank (k, p), best penalties.

    Residuals are those of each set of films, fitted without its chain; `furthest` from the middle is the last one.
    """

    rows: Array
    values: Array
    penalties: NDArray[np.intp]
    residuals: Array
    furthest: float
    coverage: Array


def _features(groups: Iterable[Iterable[Film]], outline: bool, speed: bool) -> Array:
    """What a set of films says: of each experiment the mean of the summaries."""
    return np.concatenate([np.mean([summary(film, outline, speed) for film in films], axis=0) for films in groups])


def _regression(rows: Array, values: Array, to: Array) -> tuple[Array, Array]:
    """Ridge regressions, one for each penalty: values at other features, and their distances from the middle."""
    middle, spread, level = rows.mean(axis=0), rows.std(axis=0), values.mean(axis=0)
    scaled, to = (rows - middle) / spread, (to - middle) / spread
    power, axes = np.linalg.eigh(scaled.T @ scaled / len(scaled))
    turned, sizes = to @ axes, (np.maximum(power, 0) + PENALTIES[:, None])[:, None]
    slopes = axes.T @ (scaled.T @ (values - level)) / len(scaled)
    return level + turned / sizes @ slopes, np.sqrt((turned**2 / sizes).sum(axis=-1))


def _chosen(found: Array, penalties: NDArray[np.intp]) -> Array:
    """Of each parameter what the regression with its penalty found, (penalties, k, p) → (k, p)."""
    return found[penalties, :, np.arange(len(penalties))].T


@lru_cache(16)
def _trained(bank: Bank, design: tuple[tuple[int, int], ...], has: tuple[bool, bool], camera: Camera) -> _Trained:
    """Film all chains of a bank, so many films of each experiment, and learn each from the others."""
    random, rows = np.random.default_rng(0), []
    for _, films in product(range(DRAWS), bank.films):
        errors = camera.errors(random)
        walks = [[films[at][k] for k in random.permutation(len(films[at]))[:count]] for at, count in design]
        rows.append(_features([[walk.seen(camera, errors, random) for walk in group] for group in walks], *has))
    features, chains = np.array(rows), np.tile(np.arange(len(bank.values)), DRAWS)
    values = ((bank.values - bank.values.mean(axis=0)) / bank.values.std(axis=0))[chains]
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
    """Errors at some places, (m, p): those of chains found nearby, and at least those of all; `but`: not of these."""
    found, squares = trained.values - trained.residuals, trained.residuals**2
    away = (at**2).sum(axis=1)[:, None] + (found**2).sum(axis=1) - 2 * at @ found.T
    weights, common = np.exp(-away / (2 * NEAR**2)) * np.logical_not(but), squares.mean(axis=0)
    nearby = (weights @ squares + FEW * common) / (weights.sum(axis=1, keepdims=True) + FEW)
    return np.asarray(np.sqrt(np.maximum(nearby, common)))
