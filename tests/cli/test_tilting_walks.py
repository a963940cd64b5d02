"""A chain whose plane tilts, from the command line to files: walks, sweeps, and what is refused."""

from pathlib import Path

import h5py
import numpy as np
import pytest

import warpchain
from tests.support.command_line import Command
from warpchain.status import Status

SHORT = ["--links", "20", "--preset", "soft", "--start", "ellipse", "--frequency", "8", "--method", "explicit"]
TAPPED = ["--set", "plane=tilting", "--set", "tilt=0.3"]


def test_a_walk_that_falls_over_tells_and_draws_it(tmp_path: Path, command: Command) -> None:
    """Table and folder have what became of the plane; the file gives every number back."""
    answer = command("walk", *SHORT, *TAPPED, "-o", str(tmp_path))
    assert answer.status == 0 and "fell over" in answer.out and "lateral drift" in answer.out
    assert {path.name for path in tmp_path.iterdir()} == {"walk.h5", "film_strip.png"}
    walk = warpchain.load_walk(tmp_path / "walk.h5")
    assert walk.status == Status.AT_REST and walk.fell_over == 1 and walk.tilt[0] == pytest.approx(0.3)
    assert abs(walk.final_tilt) == pytest.approx(np.pi / 2, abs=0.1)
    assert walk.lateral_drift == pytest.approx(walk.center_z[-1]) and abs(walk.energy_error) < 1e-3
    room = walk.joints_lab
    assert room is not None and room.shape == (*walk.frame_joints.shape[:2], 3)
    radius, width = walk.setup.parameters.circle_radius, walk.setup.parameters.half_width
    assert -2e-4 < room[..., 1].min() - min(radius, width) < 2e-3  # joints stay above the floor by a rim at least
    np.testing.assert_allclose(np.linalg.norm(walk.frame_axes, axis=2), 1.0, rtol=1e-12)


def test_a_sweep_keeps_planes(tmp_path: Path, command: Command) -> None:
    """Columns, series and frames of its walks; the same bits when it is cut and goes on, and in a merged file."""
    result = warpchain.sweep(
        preset="soft",
        scene={"start": "ellipse", "plane": "tilting", "links": 20, "frequency": 8},
        grid={"tilt": [0.0, 0.2]},
        samples=2,
        record={"series": {"samples": [0]}, "frames": {"samples": [0], "interval": 0.02}},
        out=tmp_path / "sweep",
        progress=False,
    )
    assert result.fell_over[1].tolist() == [1, 1] and np.isfinite(result.lateral_drift).all()
    assert (result.greatest_tilt[0] == 0).all() and result.lateral_drift[0].tolist() == [0.0, 0.0]
    walk = result.series(tilt=0.2)
    assert walk.tilt[0] == pytest.approx(0.2) and len(walk.yaw) == len(walk.time) == len(walk.center_z)
    room = walk.joints_lab
    assert room is not None and np.ptp(room[-1, :, 2]) > 0.05  # it lies
    np.testing.assert_allclose(
        room[0, :, :2], walk.frame_joints[0] @ walk.frame_axes[0][:, :2] + walk.frame_origin[0, :2]
    )
    merged = tmp_path / "merged.h5"
    assert command("merge", str(tmp_path / "sweep"), str(merged)).status == 0
    with h5py.File(merged) as file:
        names: list[str] = []
        file.visit(names.append)
        assert {"tilt", "yaw", "center_z"} <= {name.rpartition("/")[2].removeprefix("series_") for name in names}
