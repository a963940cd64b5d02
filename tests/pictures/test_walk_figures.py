"""Figures of walks."""

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from tests.support.made_tilting_walks import make_tilting_walk
from tests.support.made_walks import make_unreleased, make_walk
from warpchain.pictures.chain import link_outlines
from warpchain.pictures.film_strip import film_strip
from warpchain.pictures.walk_shape import kinds_of
from warpchain.status import Status

RADIUS = 4.2e-3


def assert_nothing_overlaps(figure: Figure, path: Path) -> None:
    """Nothing is cut off at the edge of the paper, or runs into another panel or the legend."""
    figure.savefig(path, dpi=50)
    boxes = [box for axes in figure.axes if (box := axes.get_tightbbox()) is not None]
    boxes += [legend.get_window_extent() for legend in figure.legends]
    for box in boxes:
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def scales(axes: Any) -> list[float]:
    """Pixels a metre across and up."""
    box, shown = axes.get_window_extent(), axes.viewLim
    return [box.width / abs(shown.width), box.height / abs(shown.height)]


def chains(axes: Any) -> list[PolyCollection]:
    """The chains of a panel, without their halos."""
    return [child for child in axes.collections if isinstance(child, PolyCollection)][1::2]


def test_height_and_speed_are_the_series() -> None:
    """The lines are the walk's series themselves, over a shared time axis."""
    walk = make_walk()
    height, speed = walk.plot().axes
    np.testing.assert_array_equal(height.lines[0].get_xydata(), np.stack([walk.time, walk.center[:, 1]], axis=1))
    np.testing.assert_array_equal(speed.lines[0].get_xydata(), np.stack([walk.time, walk.center_velocity[:, 0]], 1))
    assert height.get_shared_x_axes().joined(height, speed) and height.get_title(loc="left") == "30 links, 15 Hz"
    assert "/ m" in height.get_ylabel() and "/ (m/s)" in speed.get_ylabel() and "/ s" in speed.get_xlabel()


def test_refusals() -> None:
    """What a walk cannot show is refused with what happened to it, and unknown figures with those there are."""
    with pytest.raises(ValueError, match=r"walk: it has no time series\. The chain did not circulate"):
        make_unreleased().plot()
    with pytest.raises(ValueError, match="kind: 'pie' is unknown"):
        make_walk().plot("pie")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="ax: film_strip has several axes"):
        make_walk().plot("film_strip", ax=Figure().subplots())
    with pytest.raises(ValueError, match="walk: its plane is fixed"):
        make_walk().plot("tilt")
    with pytest.raises(ValueError, match=r"no frames \(not_steady\); run it again with a frame_interval"):
        film_strip(make_unreleased())
    for walk in (make_walk(), make_tilting_walk()):
        broken = walk.frame_joints.copy()
        broken[-1, 3] = math.nan
        with pytest.raises(ValueError, match="not all finite numbers"):
            (make_walk if walk.joints_in_room is None else make_tilting_walk)(frame_joints=broken).plot("film_strip")


def test_figures_of_a_walk() -> None:
    """Only a plane that tilts has a tilt; a figure of the caller's is drawn into."""
    own = Figure()
    assert make_walk().plot(figure=own) is own and len(own.axes) == 2
    assert set(kinds_of(make_tilting_walk())) - set(kinds_of(make_walk())) == {"tilt"}


def test_the_energies_lost_end_at_the_sum_of_the_ledger() -> None:
    """Lost is what is gone since the release; the dot is what the ledger accounts for."""
    walk = make_walk()
    lines = {str(line.get_label()): line for line in walk.plot("energy").axes[0].lines}
    released = walk.energy["kinetic_at_release"] + walk.energy["potential_at_release"]
    whole = walk.kinetic_energy + walk.gravitational_energy + walk.spring_energy
    np.testing.assert_allclose(np.asarray(lines["lost since the release"].get_ydata(), float), released - whole)
    left = walk.energy["kinetic_at_end"] + walk.energy["potential_at_end"] + walk.energy["residual"]
    np.testing.assert_allclose(np.asarray(lines["sum of all losses"].get_ydata(), float), [released - left])


def test_tilt_figure_draws_the_series_in_degrees() -> None:
    """Tilt and yaw in degrees, drift in metres, and the moments that the walk gives."""
    walk = make_tilting_walk(collapsed_at=0.9)
    angles, drift = walk.plot("tilt").axes
    lines = {str(line.get_label()): line for line in angles.lines}
    np.testing.assert_allclose(np.asarray(lines["tilt, to the left"].get_ydata(), float), np.degrees(walk.tilt))
    np.testing.assert_allclose(np.asarray(lines["yaw, to the left"].get_ydata(), float), np.degrees(walk.yaw))
    assert any(np.array_equal(line.get_ydata(), walk.center_z) for line in drift.lines)
    assert lines[f"fell over (45°), {walk.fell_at:.3f} s"].get_xdata()[0] == walk.fell_at  # type: ignore[index]
    assert lines["loop collapsed, 0.900 s"].get_xdata()[0] == 0.9  # type: ignore[index]
    assert "degrees" in angles.get_ylabel() and "/ m" in drift.get_ylabel()
    labels = [str(line.get_label()) for line in make_tilting_walk(fell_at=math.nan).plot("tilt").axes[0].lines]
    assert not any("fell" in label or "collapsed" in label for label in labels)


# Film strips


def test_film_strip_shows_the_walk(tmp_path: Path) -> None:
    """The strip holds chains to scale, the path of their centre, the distance and close-ups, whose boxes lie apart."""
    walk = make_walk(collapsed_at=0.55, self_contact_at=0.66)
    figure = film_strip(walk)
    strip, *close_ups = figure.axes
    times = [text.get_text() for text in strip.texts if text.get_text().endswith(" s")]
    assert 6 <= len(chains(strip)) == len(times) <= 12
    assert times == sorted(times) and (times[0], times[-1]) == ("0.00 s", "0.80 s")
    assert any(np.array_equal(line.get_xydata(), walk.center) for line in strip.lines)
    assert "Δx = 0.640 m" in [text.get_text() for text in strip.texts]
    outlines = [np.asarray(path.vertices)[:-1] for path in chains(strip)[0].get_paths()]
    expected = link_outlines(walk.frame_joints[0], RADIUS)
    np.testing.assert_allclose(outlines, [*expected[0::2], *expected[1::2]], atol=1e-12)
    boxes = [patch.get_extents() for patch in strip.patches if not patch.get_fill()]
    assert len(boxes) == 4 and not any(
        one.padded(-1).overlaps(other) for one, other in itertools.combinations(boxes, 2)
    )
    titles = [axes.get_title("left").split(",")[0] for axes in close_ups]
    assert titles == ["first touch", "collapse", "first self-contact", "rest"]
    assert_nothing_overlaps(figure, tmp_path / "strip.png")
    for axes in (strip, *close_ups):
        across, up = scales(axes)
        assert across == pytest.approx(up, rel=1e-6)


def test_film_strips_of_odd_walks() -> None:
    """A walk that did not rest gets no distance, and its last close-up is the end; one frame is enough."""
    figure = film_strip(make_walk(status=Status.TIME_LIMIT, dx=math.nan, sprocket_height=math.nan))
    assert not any("Δ" in text.get_text() for text in figure.axes[0].texts)
    assert "end" in figure.axes[-1].get_title("left")
    for walk, make in ((make_walk(), make_walk), (make_tilting_walk(), make_tilting_walk)):
        names = ("frame_time", "frame_joints", "frame_origin", "frame_axes")
        film_strip(make(**{name: getattr(walk, name)[:1] for name in names})).draw_without_rendering()


def test_film_strip_shows_two_sides_of_a_plane_that_tilts(tmp_path: Path) -> None:
    """Two views of the same instants, to one scale."""
    walk = make_tilting_walk()
    joints = walk.joints_in_room
    assert joints is not None
    figure = film_strip(walk)
    side, above = figure.axes
    for axes, names, columns in ((side, "xy", (0, 1)), (above, "xz", (0, 2))):
        assert (axes.get_xlabel(), axes.get_ylabel()) == tuple(f"{name} / m" for name in names)
        assert len(chains(axes)) == len(chains(side)) > 5
        for chain, frame in ((chains(axes)[0], 0), (chains(axes)[-1], -1)):
            corners = np.concatenate([np.asarray(path.vertices) for path in chain.get_paths()])
            drawn = joints[frame][:, list(columns)]
            np.testing.assert_allclose(corners.min(axis=0), drawn.min(axis=0) - RADIUS, atol=0.1 * RADIUS)
            np.testing.assert_allclose(corners.max(axis=0), drawn.max(axis=0) + RADIUS, atol=0.1 * RADIUS)
    assert above.yaxis_inverted() and not side.xaxis_inverted()
    assert_nothing_overlaps(figure, tmp_path / "strip.png")
    np.testing.assert_allclose([scales(axes) for axes in (side, above)], scales(side)[0], rtol=1e-6)


@pytest.mark.parametrize("stretch", [0.05, 8.0])
def test_film_strips_of_short_and_long_walks_fit(stretch: float, tmp_path: Path) -> None:
    """Labels do not run into another view, however far the chain walked."""
    walk = make_tilting_walk()
    far = stretch * 0.6 * np.sin(walk.frame_time)[:, None] * np.array([1.0, 0.0, 0.0])
    center = walk.center + stretch * 0.6 * np.sin(walk.time)[:, None] * np.array([1.0, 0.0])
    figure = film_strip(make_tilting_walk(frame_origin=walk.frame_origin + far, center=center))
    assert_nothing_overlaps(figure, tmp_path / "strip.png")


# A chain in the room


def test_link_outlines_are_two_circles() -> None:
    """Outlines lie within `radius` of their link's axis and reach exactly that far beyond its joints."""
    joints = make_walk().frame_joints[0]
    outlines = link_outlines(joints, RADIUS)
    for corners, right, left in zip(outlines, joints, np.roll(joints, 1, axis=0), strict=True):
        along = (right - left) / np.hypot(*(right - left))
        across = np.array([-along[1], along[0]])
        assert np.max((corners - right) @ along) == pytest.approx(RADIUS)
        assert np.min((corners - left) @ along) == pytest.approx(-RADIUS)
        assert np.max(np.abs((corners - left) @ across)) == pytest.approx(RADIUS)
        near = np.minimum(*(np.hypot(*(corners - joint).T) for joint in (left, right)))
        assert np.sum(np.isclose(near, RADIUS)) >= 18
    (point,) = link_outlines(np.zeros((1, 2)), RADIUS)  # a link that points to the viewer
    assert np.hypot(*point.T).max() == pytest.approx(RADIUS)
