"""The last moments on the sprocket, kept with a walk: what they are, that they change nothing, files."""

from pathlib import Path

import numpy as np
import pytest

import warpchain
from warpchain.inputs.validation import InputError
from warpchain.loop.stationary_loop import LOOP_FIELDS, BeforeRelease
from warpchain.results.one_walk import run_walk

BRIEF = {
    "links": 40,
    "frequency": 12.0,
    "preset": "soft",
    "start": "spinning",
    "extra_hold": 0.5,  # under its own loads, and nothing else is kept of the time before the release
    "walk_limit": 0.05,
}
"""The first 50 ms of a walk, half a second after its loop has become stationary."""


def test_they_end_with_the_release() -> None:
    """Times are negative and as far apart as those of the walk, which goes on where they end, in height as well."""
    walk = warpchain.walk(**BRIEF, record_before=0.2)
    before = walk.before_release
    assert before is not None
    assert -0.2 <= before.frame_time[0] < -0.197 and -2.1e-3 < before.frame_time[-1] < 0
    assert -0.2 <= before.time[0] < -0.198 and -1.1e-3 < before.time[-1] < 0
    np.testing.assert_allclose(np.diff(before.frame_time), 2e-3, atol=6e-5)
    np.testing.assert_allclose(np.diff(before.time), 1e-3, atol=6e-5)
    assert before.frame_joints.shape == before.frame_forces.shape == (len(before.frame_time), 40, 2)
    # in the loop's run a link moves on by its length: (0.2 s) × speed
    last, first = before.frame_joints[-1], walk.frame_joints[0]
    speed = 2 * np.pi * 12.0 * 0.0598
    np.testing.assert_allclose(np.hypot(*(first - last).T), -speed * before.frame_time[-1], rtol=0.05)
    assert before.frame_joints[..., 1].min() == pytest.approx(0.01 + 0.0042, abs=1e-3)
    np.testing.assert_allclose(before.center[-1], walk.center[0], atol=1e-3)
    kept = f"{-before.frame_time[0]:.3g} s, {len(before.time)} instants, {len(before.frame_time)} frames"
    assert repr(before) == f"<BeforeRelease: {kept}>"


def test_a_sweep_keeps_them(tmp_path: Path) -> None:
    """Of the samples that the file names, those of the walk itself in single precision; their kinks are drawn."""
    content = {
        "version": 1,
        "name": "before",
        "seed": 5,
        "preset": "soft",
        "samples": 2,
        "scene": {key: BRIEF[key] for key in ("links", "start", "walk_limit", "extra_hold")},
        "grid": {"frequency": [12.0, 14.0]},
        "distributions": {"all": "fixed", "clearance": "table"},
        "record": {"series": True, "frames": {"samples": [0], "before": 0.2}},
    }
    result = warpchain.sweep(content, tmp_path / "one", workers=1)
    assert result.sweep["record"]["frames"] == {"interval": 0.002, "samples": [0], "before": 0.2}
    of_sweep = result.series(frequency=12)
    kept, expected = of_sweep.before_release, run_walk(of_sweep.setup, record_before=0.2).before_release
    assert result.series(frequency=12, sample=1).before_release is None
    assert isinstance(kept, BeforeRelease) and expected is not None
    for name in LOOP_FIELDS:
        ours, theirs = getattr(kept, name), getattr(expected, name)
        single = name.startswith("frame_") and name != "frame_time"
        np.testing.assert_array_equal(ours, theirs.astype(np.float32) if single else theirs)
    assert of_sweep.mean_loop().kink().dip < 0
    with pytest.raises(InputError, match=r"sweep\.record\.series\.before: unknown name"):
        warpchain.sweep(content | {"record": {"series": {"before": 0.1}}}, tmp_path / "three")
    with pytest.raises(InputError, match=r"sweep\.record\.frames\.before: .*, got -1"):
        warpchain.sweep(content | {"record": {"series": True, "frames": {"before": -1}}}, tmp_path / "three")
