"""Time series on an even clock."""

import numpy as np

import warpchain
from warpchain.kernels import layout
from warpchain.walks.even_clock import between

ELLIPSE = {"links": 36, "frequency": 20.0, "start": "ellipse", "preset": "soft", "method": "dp5"}


def made_samples(times: np.ndarray, columns: int = layout.ALL_COLUMNS) -> np.ndarray:
    """Samples of a centre on cubics in time, all other columns straight lines."""
    samples = np.outer(times, np.arange(1.0, columns + 1))
    samples[:, layout.TIME], samples[:, layout.CENTER_V] = times, layout.CENTER_Y + 1.0
    for place, velocity in ((layout.CENTER_X, layout.CENTER_U), (layout.CENTER_Z, layout.CENTER_W)):
        if place < columns:
            samples[:, place] = 1 + 2 * times - 3 * times**2 + 5 * times**3
            samples[:, velocity] = 2 - 6 * times + 15 * times**2
    return samples


def test_cubics_and_straight_lines_are_exact() -> None:
    """Places on a cubic in time and quantities on a straight line come back at any time; a sample is itself."""
    rng = np.random.default_rng(1)
    times = np.sort(rng.uniform(0, 1, 30))
    wanted = np.sort(np.append(rng.uniform(times[0], times[-1], 50), times[[0, 7, -1]]))
    samples, exact = made_samples(times), made_samples(wanted)
    rows = between(samples, wanted)
    straight = [n for n in range(layout.ALL_COLUMNS) if n not in (layout.CENTER_U, layout.CENTER_W)]
    np.testing.assert_allclose(rows[:, straight], exact[:, straight], rtol=1e-12, atol=1e-13)
    assert rows[np.isin(wanted, times[[0, 7, -1]])].tobytes() == samples[[0, 7, -1]].tobytes()


def test_a_jump_of_the_velocity_shifts_a_place_by_an_eighth_of_it_at_most() -> None:
    """Between two samples with an impact the place is wrong by at most jump × time / 8, the velocity in between."""
    span, jump, impact = 1e-3, 0.4, 0.3e-3
    samples = np.zeros((2, layout.SAMPLE_COLUMNS))
    samples[:, layout.TIME] = 0.0, span
    samples[:, layout.CENTER_V] = -0.2, -0.2 + jump
    samples[:, layout.CENTER_Y] = 1.0, 1.0 - 0.2 * span + jump * (span - impact)
    times = np.linspace(0, span, 101)
    rows = between(samples, times)
    true = 1.0 - 0.2 * times + jump * np.maximum(0.0, times - impact)
    assert np.abs(rows[:, layout.CENTER_Y] - true).max() <= jump * span / 8
    assert (rows[:, layout.CENTER_V] >= -0.2).all() and (rows[:, layout.CENTER_V] <= 0.2).all()


def test_a_walk_has_its_series_at_every_millisecond() -> None:
    """Times are whole milliseconds and the end; between impacts places agree with a run sampled 50 times as often."""
    coarse = warpchain.walk(**ELLIPSE, walk_until=0.4, frame_interval=None)
    fine = warpchain.walk(**ELLIPSE, walk_until=0.4, frame_interval=None, record_interval=2e-5)
    count = len(coarse.time) - (coarse.time[-1] != 0.4)
    assert (coarse.time[:count] == np.arange(count) * 1e-3).all() and coarse.time[-1] == coarse.walk_time == 0.4
    assert coarse.steps_accepted == fine.steps_accepted
    common = np.arange(0, 20000, 50)
    np.testing.assert_allclose(fine.time[common], coarse.time[:400], rtol=1e-13)
    error = np.linalg.norm(coarse.center[:400] - fine.center[common], axis=1)
    jumps = np.abs(np.diff(coarse.center_velocity[:401], axis=0)).sum(axis=1)
    flies = np.convolve(jumps > 0.0125, np.ones(3), "same") == 0  # 9.81 mm/s per ms: gravity alone
    assert 100 < flies.sum() < 400
    assert error[flies].max() < 5e-9 and error.max() < jumps.max() * 1e-3 / 8
    off = np.abs(coarse.kinetic_energy[:400] - fine.kinetic_energy[common]) / np.ptp(fine.kinetic_energy)
    assert off[flies].max() < 1e-4 and off.max() < 0.01
