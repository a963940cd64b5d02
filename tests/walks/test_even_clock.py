"""Time series on an even clock."""

import numpy as np

import warpchain

ELLIPSE = {"links": 36, "frequency": 20.0, "start": "ellipse", "preset": "soft", "method": "dp5", "stop_time": 0.4}


def test_a_walk_has_its_series_at_every_millisecond() -> None:
    """Times are whole milliseconds and the end; between impacts places agree with a run sampled 50 times as often.

    Across an impact a place is wrong by an eighth of the jump of the velocity, times a millisecond, at most.
    """
    coarse, fine = (
        warpchain.walk(**ELLIPSE, frame_interval=None, record_interval=interval) for interval in (1e-3, 2e-5)
    )
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
