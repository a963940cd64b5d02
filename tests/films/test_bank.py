"""What a bank says of a chain: intervals hold, what films share does not average out, strangers are refused."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.made_films import films_of, made_bank, motion
from warpchain import InputError, films

CAMERA = films.Camera()


@pytest.mark.parametrize("count", [1, 4])
def test_intervals_hold_of_chains_that_the_bank_does_not_have(count: int) -> None:
    """Of 150 hidden chains 68 and 95 % lie inside, within three standard deviations of such a count, or more.

    Of two parameters that films show, 9 % of the chains lie more than 2 σ off, at the edge of the bank.
    """
    bank, hidden = made_bank(160, seed=1), made_bank(150, seed=2)
    inside = np.zeros((2, 3))
    refused = 0
    for chain, truth in enumerate(hidden.values):
        try:
            answer = bank.posterior(films_of(hidden, chain, count, CAMERA, chain), CAMERA)
        except InputError:
            refused += 1
            continue
        inside += np.abs(answer.mean - truth) < np.outer([1, 1.96], answer.sigma)
    assert refused < 25
    share = inside / (150 - refused)
    assert (share[0] > 0.56).all() and (share[0] < 0.85).all()
    assert (share[1] > 0.89).all()
    assert ((answer.coverage[1] > 0.9) & (answer.coverage[0] > 0.6)).all()


def test_what_films_do_not_show_is_as_before() -> None:
    """Restitution leaves no trace: its error is that of the bank, and the answer says so. Bare films say less."""
    bank = made_bank(160, seed=1)
    seen = films_of(bank, 3, 2, CAMERA, 0)
    answer = bank.posterior(seen)
    assert answer.sigma[2] == pytest.approx(bank.values[:, 2].std(), rel=0.15)
    lines = str(answer).splitlines()
    assert lines[0].startswith("2 films, a bank of 160 chains")
    assert ["as before the film" in line for line in lines[1:]] == [False, False, True]
    bare = [dataclasses.replace(film, outline=None, speed=None) for film in seen]
    assert bank.posterior(bare).sigma[1] > 2 * answer.sigma[1]


def test_errors_that_films_share_do_not_average_out() -> None:
    """With an error of the scale alone eight times the films are no better; with noise alone they are."""
    bank = made_bank(160, seed=1, repetitions=8)
    still = films.Camera(
        noise=1e-6, release=1e-6, speed=1e-3, scale=1e-9, floor=1e-9, origin=1e-9, roll=1e-9, outline=1e-9
    )
    shared = dataclasses.replace(still, outline=2e-3, speed=0.1)
    noisy = dataclasses.replace(still, noise=3e-3)

    def sigma(camera: films.Camera, count: int, parameter: int) -> float:
        return float(bank.posterior(films_of(bank, 0, count, camera, 0), camera).sigma[parameter])

    assert sigma(shared, 8, 1) > 0.85 * sigma(shared, 1, 1)
    assert sigma(noisy, 8, 0) < 0.6 * sigma(noisy, 1, 0)


def test_other_measurements_condition_the_gaussian() -> None:
    """`given` is Bayes' rule, here against precisions that are added."""
    names, covariance = ("circle_radius", "sprocket_radius"), np.array([[0.09, -0.05], [-0.05, 0.04]])
    known = {"prior_sigma": np.ones(2), "coverage": np.zeros((2, 2)), "films": 1, "chains": 1}
    answer = films.Posterior(names=names, mean=np.array([4.0, 56.0]), covariance=covariance, **known)
    after = answer.given(circle_radius=(4.2, 0.05))
    precision = np.linalg.inv(covariance)
    expected = np.linalg.inv(precision + np.diag([400.0, 0]))
    assert after.covariance == pytest.approx(expected)
    assert after.mean == pytest.approx(expected @ (precision @ answer.mean + [400 * 4.2, 0]))
    with pytest.raises(InputError, match="mass: not in the posterior; give one of circle_radius"):
        answer.given(mass=(1.0, 0.1))
    wrong: Any
    for wrong in (0.27, (np.nan, 0.1), (4.2, 0.05, 0.05), ("4.2", "0.05")):
        with pytest.raises(InputError, match=r"^circle_radius=\(value, error\): "):
            answer.given(circle_radius=wrong)


@pytest.mark.parametrize(
    ("friction", "higher", "wrong"),
    [
        (0.38, 0.0, r"floor_friction: 0\.3\d*, in the bank 0\.27 ± 0\.05"),
        (0.27, 0.03, r"(\w+: \S+, in the bank \S+ ± \S+\s?){3}"),
    ],
)
def test_an_answer_outside_of_the_bank_is_refused(friction: float, higher: float, wrong: str) -> None:
    """Friction 2.2 standard deviations off the middle, where few chains are; an outline that no chain has."""
    exact = motion(friction)
    exact = dataclasses.replace(exact, outline=exact.outline + np.array([0, 0, 0, higher]))
    film = exact.seen(CAMERA, np.zeros(9), np.random.default_rng(0))
    with pytest.raises(InputError, match=f"; check direction, .*; if right, give one about these values\n{wrong}$"):
        made_bank(160, seed=1).posterior([film])


@pytest.mark.parametrize("wrong", ["speed", "origin", "floor", [0, 2, 1, 3], [1, 0, 2, 3], [0, 1, 3, 2]])
def test_a_film_that_contradicts_itself_is_refused(wrong: Any) -> None:
    """A speed that is not the loop's, another origin or floor, edges of the outline in another order."""
    bank = made_bank(160, seed=1)
    (film,) = films_of(bank, 3, 1, CAMERA, 0)
    assert film.outline is not None and film.speed is not None
    changes: dict[str, Any] = {
        "speed": {"speed": 0.9 * film.speed},
        "origin": {"center": np.add(film.center, [0.3, 0]), "outline": np.add(film.outline, [0.3, 0.3, 0, 0])},
        "floor": {"center": np.add(film.center, [0, 0.05])},
    }
    given = changes[wrong] if isinstance(wrong, str) else {"outline": film.outline[wrong]}
    with pytest.raises(InputError, match=r"^films: unlike the bank; check direction, origin, outline, speed"):
        bank.posterior([dataclasses.replace(film, **given)])


def test_films_that_are_not_the_bank_s_are_refused() -> None:
    """Another experiment, more films than repetitions, none, no list, no edges, and a bank too small."""
    bank = made_bank(160, seed=1)
    (film,) = films_of(bank, 0, 1, CAMERA, 0)
    for wrong in ([dataclasses.replace(film, frequency=20.5)], [film] * 5, []):
        with pytest.raises(
            InputError, match=r"films: they are not .*; give 1 to 4 of each of 60 links at 20 Hz, and a bank"
        ):
            bank.posterior(wrong)
    unlisted: Any
    for unlisted in (film, [film, "film.csv"], None):
        with pytest.raises(InputError, match=r"^films(\[1\])?: Input should be a"):
            bank.posterior(unlisted)
    with pytest.raises(InputError, match=r"^films: unlike the bank; check .* outline"):
        bank.posterior([dataclasses.replace(film, outline=np.full(4, np.nan))])
    with pytest.raises(InputError, match="a bank of 32 chains or more"):
        made_bank(20, seed=1).posterior([film])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of chains, run with two samples and then with a third."""
    path = tmp_path_factory.mktemp("bank") / "sweep"
    for samples in (2, 3):
        warpchain.sweep(
            grid={"links": [40, 60], "frequency": [15, 20], "phase": [0.1, 0.6]},
            samples=samples,
            preset="soft",
            scene={"start": "spinning", "walk_until": 0.4},
            record={"series": {"interval": 0.004}, "frames": {"interval": 0.4}},
            same_samples_along=["links", "frequency", "phase"],
            independent=["clearance"],
            out=path,
            progress=False,
        )
    return path


def test_a_bank_has_the_walks_of_its_sweep(folder: Path) -> None:
    """Each motion is that of the walk of this chain, experiment and repetition."""
    result = warpchain.load(folder)
    bank = films.Bank.of(result)
    assert (len(bank.films), bank.experiments) == (3, [(40, 15.0), (40, 20.0), (60, 15.0), (60, 20.0)])
    for chain, experiment, repetition in np.ndindex(3, 4, 2):
        links, frequency = bank.experiments[experiment]
        phase = result.axes["phase"][repetition]
        walk = result.series(links=links, frequency=frequency, phase=phase, sample=chain)
        film = bank.films[chain][experiment][repetition]
        count = len(film.time)
        assert (film.time == walk.time[:count]).all() and film.center == pytest.approx(walk.center[:count], abs=1e-7)
        assert film.outline == pytest.approx(films.film_of(walk, None).outline, abs=1e-6)
        assert film.speed == pytest.approx(walk.rms_speed[0], rel=6e-3) == films.film_of(walk, None).speed
        place = list(bank.names).index("floor_friction")
        assert bank.values[chain, place] == walk.setup.parameters.floor_friction


def test_a_sweep_that_is_no_bank_is_refused(tmp_path: Path) -> None:
    """Chains must be the same in all experiments, and the axes links and frequency."""

    def bank(folder: str, grid: dict[str, Any], **more: Any) -> films.Bank:
        scene, record = {"start": "spinning", "walk_limit": 0.01}, {"series": True, "frames": True}
        settings = {"samples": 2, "preset": "soft", "scene": scene, "record": record, "progress": False, **more}
        return films.Bank.of(warpchain.sweep(grid=grid, out=tmp_path / folder, **settings))

    with pytest.raises(InputError, match=r"same_samples_along: \[links, frequency\]"):
        bank("a", {"links": [40], "frequency": [15, 20]})
    along, phases = ["links", "frequency", "phase"], {"links": [40], "frequency": [15], "phase": [0.1, 0.2]}
    with pytest.raises(InputError, match=r"same_samples_along: \[links, frequency, phase\]"):
        bank("b", phases, same_samples_along=along[:2])
    with pytest.raises(InputError, match="and no parameter as independent"):
        bank("c", phases, same_samples_along=along, independent=["clearance", "inner_mass"])
    with pytest.raises(InputError, match="grid: its axes are frequency"):
        bank("d", {"frequency": [15]})
    with pytest.raises(InputError, match="bank: no motion was recorded"):
        bank("e", {"links": [40], "frequency": [15]})  # too short


@pytest.mark.parametrize(
    ("grid", "more", "wrong"),
    [
        ({"phase": [0.1, 0.2]}, {}, "clearance"),
        ({"phase": [0.1]}, {}, "clearance"),
        ({"phase": [0.1, 0.2]}, {"scene": {"clearance": 0.01}}, "clearance"),
        ({"phase": [0.1, 0.2]}, {"distributions": {"clearance": "fixed"}}, "clearance"),
        ({}, {"independent": ["clearance"]}, "phase"),
        ({"clearance": [0.01, 0.02]}, {}, "phase"),
    ],
)
def test_a_bank_whose_releases_are_alike_is_refused(
    grid: dict[str, Any], more: dict[str, Any], wrong: str, tmp_path: Path
) -> None:
    """Clearance and phase are each release's own: of two films they are neither drawn once nor fixed; one may be so."""
    settings: dict[str, Any] = {"samples": 1, "preset": "soft", **more}
    settings["scene"] = {"start": "spinning", "walk_until": 0.4, **more.get("scene", {})}
    settings["record"] = {"series": {"interval": 0.004}, "frames": {"interval": 0.4}}
    axes = {"links": [40], "frequency": [15, 20], **grid}
    result = warpchain.sweep(grid=axes, same_samples_along=list(axes), out=tmp_path / "a", progress=False, **settings)
    bank = films.Bank.of(result)
    seen = [row[0].seen(CAMERA, np.zeros(9), np.random.default_rng(0)) for row in bank.films[0]]
    with pytest.raises(InputError, match=rf"^bank: {wrong} is the same in all films of .* independent: \[{wrong}\]"):
        bank.posterior(seen)
    with pytest.raises(InputError, match=r"^films: they are not .* a bank of 32 chains or more"):
        bank.posterior(seen[:1])


def test_films_of_a_chain_come_from_heights_of_their_own() -> None:
    """Where a bank has three heights on an axis, two films of a hidden chain may be of any two; intervals hold."""
    speeds, heights = ((60, 5.0), (60, 20.0)), (0.006, 0.010, 0.014)
    bank, hidden = (made_bank(chains, seed, 3, speeds, heights) for chains, seed in ((96, 1), (60, 2)))
    errors, refused = [], 0
    for chain, truth in enumerate(hidden.values):
        random = np.random.default_rng(chain)
        shared = CAMERA.errors(random)
        seen = [row[random.integers(3)].seen(CAMERA, shared, random) for row in hidden.films[chain]]
        try:
            answer = bank.posterior(seen)
        except InputError:
            refused += 1
            continue
        errors.append((answer.mean - truth) / answer.sigma)
    assert refused < 12 and (np.mean(np.abs(errors) < 1.96, axis=0) > 0.85).all()
