"""Posteriors: intervals cover, shared errors do not average out, chains unlike the training set are refused."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warpchain
from tests.support.made_videos import made_training_set, motion, videos_of
from warpchain import InputError, video

CAMERA = video.Camera()


@pytest.mark.parametrize("count", [1, pytest.param(4, marks=pytest.mark.thorough)])
def test_intervals_hold_of_chains_that_the_training_set_does_not_have(count: int) -> None:
    """Of 150 hidden chains 68 and 95 % lie inside, within three standard deviations of such a count, or more.

    Of two parameters that videos show, 9 % of the chains lie more than 2 σ off, at the edge of the training set.
    """
    training, hidden = made_training_set(160, seed=1), made_training_set(150, seed=2)
    inside = np.zeros((2, 3))
    refused = 0
    for chain, truth in enumerate(hidden.values):
        try:
            answer = training.posterior(videos_of(hidden, chain, count, CAMERA, chain), CAMERA)
        except InputError:
            refused += 1
            continue
        inside += np.abs(answer.mean - truth) < np.outer([1, 1.96], answer.sigma)
    assert refused < 25
    share = inside / (150 - refused)
    assert (share[0] > 0.56).all() and (share[0] < 0.85).all()
    assert (share[1] > 0.89).all()
    assert ((answer.coverage[1] > 0.9) & (answer.coverage[0] > 0.6)).all()


def test_what_video_do_not_show_is_as_before() -> None:
    """Restitution leaves no trace, so its error is that of the prior; without outline and speed errors are larger."""
    training = made_training_set(160, seed=1)
    seen = videos_of(training, 3, 2, CAMERA, 0)
    answer = training.posterior(seen)
    assert answer.sigma[2] == pytest.approx(training.values[:, 2].std(), rel=0.15)
    lines = str(answer).splitlines()
    assert lines[0].startswith("2 videos, a training set of 160 chains")
    assert ["no better than the prior" in line for line in lines[1:]] == [False, False, True]
    bare = [dataclasses.replace(clip, outline=None, speed=None) for clip in seen]
    assert training.posterior(bare).sigma[1] > 2 * answer.sigma[1]


def test_errors_that_video_share_do_not_average_out() -> None:
    """With an error of the scale alone eight times the videos are no better; with noise alone they are."""
    training = made_training_set(160, seed=1, repetitions=8)
    still = video.Camera(
        noise=1e-6, release=1e-6, speed=1e-3, scale=1e-9, floor=1e-9, origin=1e-9, roll=1e-9, outline=1e-9
    )
    shared = dataclasses.replace(still, outline=2e-3, speed=0.1)
    noisy = dataclasses.replace(still, noise=3e-3)

    def sigma(camera: video.Camera, count: int, parameter: int) -> float:
        return float(training.posterior(videos_of(training, 0, count, camera, 0), camera).sigma[parameter])

    assert sigma(shared, 8, 1) > 0.85 * sigma(shared, 1, 1)
    assert sigma(noisy, 8, 0) < 0.6 * sigma(noisy, 1, 0)


def test_other_measurements_condition_the_gaussian() -> None:
    """`given` is Bayes' rule, here against precisions that are added."""
    names, covariance = ("circle_radius", "sprocket_radius"), np.array([[0.09, -0.05], [-0.05, 0.04]])
    known = {"prior_sigma": np.ones(2), "coverage": np.zeros((2, 2)), "videos": 1, "chains": 1}
    answer = video.Posterior(names=names, mean=np.array([4.0, 56.0]), covariance=covariance, **known)
    after = answer.given(circle_radius=(4.2, 0.05))
    precision = np.linalg.inv(covariance)
    expected = np.linalg.inv(precision + np.diag([400.0, 0]))
    assert after.covariance == pytest.approx(expected)
    assert after.mean == pytest.approx(expected @ (precision @ answer.mean + [400 * 4.2, 0]))
    with pytest.raises(InputError, match="mass: not in the posterior; use one of circle_radius"):
        answer.given(mass=(1.0, 0.1))
    wrong: Any
    for wrong in (0.27, (np.nan, 0.1), (4.2, 0.05, 0.05), ("4.2", "0.05")):
        with pytest.raises(InputError, match=r"^circle_radius=\(value, error\): "):
            answer.given(circle_radius=wrong)


@pytest.mark.parametrize(
    ("friction", "higher", "wrong"),
    [
        (0.38, 0.0, r"floor_friction: expected 0\.27 ± 0\.05, got 0\.3\d*"),
        (0.27, 0.03, r"(\w+: expected \S+ ± \S+, got \S+\s?){3}"),
    ],
)
def test_an_answer_outside_of_the_training_set_is_refused(friction: float, higher: float, wrong: str) -> None:
    """Friction 2.2 standard deviations off the middle, where few chains are; an outline that no chain has."""
    exact = motion(friction)
    exact = dataclasses.replace(exact, outline=exact.outline + np.array([0, 0, 0, higher]))
    clip = exact.seen(CAMERA, np.zeros(9), np.random.default_rng(0))
    with pytest.raises(InputError, match=f"; check direction, .* or widen the training set\n{wrong}$"):
        made_training_set(160, seed=1).posterior([clip])


@pytest.mark.parametrize("wrong", ["speed", "origin", "floor", [0, 2, 1, 3], [1, 0, 2, 3], [0, 1, 3, 2]])
def test_a_video_that_contradicts_itself_is_refused(wrong: Any) -> None:
    """A speed that is not the loop's, another origin or floor, edges of the outline in another order."""
    training = made_training_set(160, seed=1)
    (clip,) = videos_of(training, 3, 1, CAMERA, 0)
    assert clip.outline is not None and clip.speed is not None
    changes: dict[str, Any] = {
        "speed": {"speed": 0.9 * clip.speed},
        "origin": {"center": np.add(clip.center, [0.3, 0]), "outline": np.add(clip.outline, [0.3, 0.3, 0, 0])},
        "floor": {"center": np.add(clip.center, [0, 0.05])},
    }
    given = changes[wrong] if isinstance(wrong, str) else {"outline": clip.outline[wrong]}
    with pytest.raises(InputError, match=r"^videos: unlike the training set; check direction, origin, outline, speed"):
        training.posterior([dataclasses.replace(clip, **given)])


def test_video_that_are_not_the_training_set_s_are_refused() -> None:
    """Another experiment, more videos than repetitions, none, no list, no edges, and a training set too small."""
    training = made_training_set(160, seed=1)
    (clip,) = videos_of(training, 0, 1, CAMERA, 0)
    for wrong in ([dataclasses.replace(clip, frequency=20.5)], [clip] * 5, []):
        with pytest.raises(
            InputError,
            match=r"videos: they do not match .*; use 1 to 4 of each of 60 links at 20 Hz, and a training set",
        ):
            training.posterior(wrong)
    unlisted: Any
    for unlisted in (clip, [clip, "video.csv"], None):
        with pytest.raises(InputError, match=r"^videos(\[1\])?: expected a"):
            training.posterior(unlisted)
    with pytest.raises(InputError, match=r"^videos: unlike the training set; check .* outline"):
        training.posterior([dataclasses.replace(clip, outline=np.full(4, np.nan))])
    with pytest.raises(InputError, match="a training set of at least 32 chains"):
        made_training_set(20, seed=1).posterior([clip])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep of chains, run with two samples and then with a third."""
    path = tmp_path_factory.mktemp("training set") / "sweep"
    for samples in (2, 3):
        warpchain.sweep(
            grid={"links": [40, 60], "frequency": [15, 20], "phase": [0.1, 0.6]},
            samples=samples,
            preset="soft",
            scene={"start": "spinning", "stop_time": 0.4},
            record={"series": {"interval": 0.004}, "frames": {"interval": 0.4}},
            same_samples_along=["links", "frequency", "phase"],
            independent=["clearance"],
            out=path,
            progress=False,
        )
    return path


def test_a_training_set_has_the_walks_of_its_sweep(folder: Path) -> None:
    """Each motion is that of the walk of this chain, experiment and repetition."""
    result = warpchain.load(folder)
    training = video.TrainingSet.of(result)
    assert (len(training.videos), training.experiments) == (3, [(40, 15.0), (40, 20.0), (60, 15.0), (60, 20.0)])
    for chain, experiment, repetition in np.ndindex(3, 4, 2):
        links, frequency = training.experiments[experiment]
        phase = result.axes["phase"][repetition]
        walk = result.series(links=links, frequency=frequency, phase=phase, sample=chain)
        clip = training.videos[chain][experiment][repetition]
        count = len(clip.time)
        assert (clip.time == walk.time[:count]).all() and clip.center == pytest.approx(walk.center[:count], abs=1e-7)
        assert clip.outline == pytest.approx(video.video_of(walk, None).outline, abs=1e-6)
        assert clip.speed == pytest.approx(walk.rms_speed[0], rel=6e-3) == video.video_of(walk, None).speed
        place = list(training.names).index("floor_friction")
        assert training.values[chain, place] == walk.setup.parameters.floor_friction


def test_a_sweep_that_is_no_training_set_is_refused(tmp_path: Path) -> None:
    """Chains must be the same in all experiments, and the axes links and frequency."""

    def training(folder: str, grid: dict[str, Any], **more: Any) -> video.TrainingSet:
        scene, record = {"start": "spinning", "walk_limit": 0.01}, {"series": True, "frames": True}
        settings = {"samples": 2, "preset": "soft", "scene": scene, "record": record, "progress": False, **more}
        return video.TrainingSet.of(warpchain.sweep(grid=grid, out=tmp_path / folder, **settings))

    with pytest.raises(InputError, match=r"same_samples_along: \[links, frequency\]"):
        training("a", {"links": [40], "frequency": [15, 20]})
    along, phases = ["links", "frequency", "phase"], {"links": [40], "frequency": [15], "phase": [0.1, 0.2]}
    with pytest.raises(InputError, match=r"same_samples_along: \[links, frequency, phase\]"):
        training("b", phases, same_samples_along=along[:2])
    with pytest.raises(InputError, match="and list no parameter as independent"):
        training("c", phases, same_samples_along=along, independent=["clearance", "inner_mass"])
    with pytest.raises(InputError, match="grid: expected links, frequency and then repetitions, got frequency"):
        training("d", {"frequency": [15]})
    with pytest.raises(InputError, match="training_set: no motion was recorded"):
        training("e", {"links": [40], "frequency": [15]})  # too short


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
def test_a_training_set_whose_releases_are_alike_is_refused(
    grid: dict[str, Any], more: dict[str, Any], wrong: str, tmp_path: Path
) -> None:
    """Clearance and phase must differ between two videos of a chain; for a single video they may be fixed."""
    settings: dict[str, Any] = {"samples": 1, "preset": "soft", **more}
    settings["scene"] = {"start": "spinning", "stop_time": 0.4, **more.get("scene", {})}
    settings["record"] = {"series": {"interval": 0.004}, "frames": {"interval": 0.4}}
    axes = {"links": [40], "frequency": [15, 20], **grid}
    result = warpchain.sweep(grid=axes, same_samples_along=list(axes), out=tmp_path / "a", progress=False, **settings)
    training = video.TrainingSet.of(result)
    seen = [row[0].seen(CAMERA, np.zeros(9), np.random.default_rng(0)) for row in training.videos[0]]
    with pytest.raises(
        InputError, match=rf"^training_set: {wrong} is the same in all videos of .* independent: \[{wrong}\]"
    ):
        training.posterior(seen)
    with pytest.raises(InputError, match=r"^videos: they do not .* a training set of at least 32 chains"):
        training.posterior(seen[:1])


def test_video_of_a_chain_come_from_heights_of_their_own() -> None:
    """With three heights on an axis, two videos of a held-out chain may have any two of them; intervals cover."""
    speeds, heights = ((60, 5.0), (60, 20.0)), (0.006, 0.010, 0.014)
    training, hidden = (made_training_set(chains, seed, 3, speeds, heights) for chains, seed in ((96, 1), (60, 2)))
    errors, refused = [], 0
    for chain, truth in enumerate(hidden.values):
        random = np.random.default_rng(chain)
        shared = CAMERA.errors(random)
        seen = [row[random.integers(3)].seen(CAMERA, shared, random) for row in hidden.videos[chain]]
        try:
            answer = training.posterior(seen)
        except InputError:
            refused += 1
            continue
        errors.append((answer.mean - truth) / answer.sigma)
    assert refused < 12 and (np.mean(np.abs(errors) < 1.96, axis=0) > 0.85).all()
