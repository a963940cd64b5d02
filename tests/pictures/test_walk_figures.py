"""Figures of walks."""

import math
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.text import Text

from tests.support.made_tilting_walks import make_tilting_walk
from tests.support.made_walks import made_setup, make_unreleased, make_walk
from warpchain.chain.sprocket_motion import sprocket_places
from warpchain.inputs.parameters import preset
from warpchain.inputs.scene import Scene
from warpchain.pictures.animation import Film
from warpchain.pictures.chain import link_outlines
from warpchain.pictures.labels import differences
from warpchain.pictures.style import on_paper, save_figure
from warpchain.pictures.walk_figures import draw, film_strip, kinds_of
from warpchain.status import Status

RADIUS = 4.2e-3


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
    assert height.get_shared_x_axes().joined(height, speed)
    assert height.get_title(loc="left") == "30 links, 15 Hz, preset soft, sampled values"
    assert "/ m" in height.get_ylabel() and "/ (m/s)" in speed.get_ylabel() and "/ s" in speed.get_xlabel()


def test_titles_name_what_differs_from_the_defaults() -> None:
    """Parameters by symbol and unit, the scene in words, many of them cut off; the defaults are not named."""
    usual = vars(Scene()) | vars(preset("paper"))
    assert differences(usual, "paper") == []
    changed = usual | {"floor_friction": 0.1, "slope": 3.0, "charm_mass": 0.002}
    assert differences(changed, "paper") == ["slope 3°", "charm mass 0.002 kg", "μ_fc = 0.1"]
    assert differences(vars(preset("soft")), "soft") == ["preset soft"]
    many = usual | {name: 0.123 for name in ("phase", "clearance", "tilt", "yaw_rate", "gravity")}
    assert len(differences(many, "paper")) == 5 and differences(many, "paper")[-1] == "…"


@pytest.mark.parametrize("kind", ["film_strip", "height_and_speed", "energy", "tilt"])
@pytest.mark.parametrize("width", [60, 85, 180])
def test_texts_of_figures_on_paper_can_be_read(kind: Any, width: float, tmp_path: Path) -> None:
    """A figure has the width asked for, texts of at least 6 pt and titles on the paper; a PDF has the same bytes."""
    with on_paper(width) as inches:
        names = ("one", "two") if width == 85 else ("one",)
        for name in names:
            figure = draw(make_tilting_walk() if kind == "tilt" else make_walk(), kind, width=inches)
            save_figure(figure, tmp_path / f"{name}.pdf")
        files = [path.read_bytes() for path in tmp_path.glob("*.pdf")]
        assert len(files) == len(names) and files[0] == files[-1]
        assert figure.get_figwidth() == pytest.approx(width / 25.4)
        figure.draw_without_rendering()
        seen = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
        assert min(text.get_fontsize() for text in seen) >= 6 - 1e-6 and len(seen) > 5
        paper = figure.bbox.padded(1.0)
        titles = [axes.title for axes in figure.axes] + [axes._left_title for axes in figure.axes]
        for text in (text for text in titles if text.get_text()):
            box = text.get_window_extent()
            assert paper.contains(*box.min) and paper.contains(*box.max), text


def test_refusals() -> None:
    """What a walk cannot show is refused with what happened to it, and unknown figures with those there are."""
    for walk, kind, problem in (
        (make_unreleased(), "height_and_speed", r"walk: it has no time series\. The chain did not circulate"),
        (make_unreleased(), "film_strip", r"no frames; it was not released\. The chain did not circulate"),
        (make_unreleased(), "loop", "ended before its release; see its status"),
        (make_walk(), "pie", "kind: unknown kind 'pie'"),
        (make_walk(), "tilt", "walk: its plane is fixed"),
    ):
        with pytest.raises(ValueError, match=problem):
            walk.plot(kind)  # type: ignore[arg-type]
    for make in (make_walk, make_tilting_walk):
        broken = make().frame_joints.copy()
        broken[-1, 3] = math.nan
        with pytest.raises(ValueError, match="not all finite numbers"):
            make(frame_joints=broken).plot("film_strip")


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


def test_film_strip_shows_the_walk() -> None:
    """The strip holds chains to scale, the path of their centre and the distance; close-ups are of what happens."""
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
    titles = [axes.get_title("left").split(",")[0] for axes in close_ups]
    assert titles == ["first touch", "collapse", "first self-contact", "rest"]
    for axes in (strip, *close_ups):
        across, up = scales(axes)
        assert across == pytest.approx(up, rel=1e-6)


def test_film_strips_of_odd_walks() -> None:
    """A walk that did not rest gets no distance, and its last close-up is the end; one frame is enough."""
    figure = film_strip(make_walk(status=Status.TIME_LIMIT, dx=math.nan, sprocket_height=math.nan))
    assert not any("Δ" in text.get_text() for text in figure.axes[0].texts)
    assert "end" in figure.axes[-1].get_title("left")
    high = make_walk().frame_joints + np.array([0.0, 1.0])
    bottom, top = film_strip(make_walk(frame_joints=high)).axes[-1].get_ylim()
    assert ((high[-1, :, 1] > bottom) & (high[-1, :, 1] < top)).any()
    for walk, make in ((make_walk(), make_walk), (make_tilting_walk(), make_tilting_walk)):
        names = ("frame_time", "frame_joints", "frame_origin", "frame_axes")
        film_strip(make(**{name: getattr(walk, name)[:1] for name in names})).draw_without_rendering()


def test_film_strip_shows_two_sides_of_a_plane_that_tilts() -> None:
    """Two views of the same instants, to one scale."""
    walk = make_tilting_walk()
    joints = walk.joints_lab
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
    np.testing.assert_allclose([scales(axes) for axes in (side, above)], scales(side)[0], rtol=1e-6)


def test_times_in_a_film_strip_do_not_touch() -> None:
    """Instants at which the chain is in the same place have their times above one another."""
    walk = make_walk()
    waits = walk.frame_joints.copy()
    waits[10:] = waits[10]
    for texts in (film_strip(walk), film_strip(make_walk(frame_joints=waits))):
        texts.draw_without_rendering()
        boxes = [text.get_window_extent() for text in texts.axes[0].texts if text.get_text().endswith(" s")]
        assert len(boxes) >= 6
        assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


# What is beside the chain


def circles(axes: Any) -> list[tuple[float, float]]:
    """Centres of the sprockets in a panel."""
    return [patch.center for patch in axes.patches if isinstance(patch, Circle)]


def test_a_sprocket_that_moves_is_drawn_where_it_is_until_it_vanishes() -> None:
    """In film strips at each instant and in animations in each frame; one that vanishes at once is in none."""
    release = ((0.2, 0.3, 0.1, 5.0), (0.5, 0.2, -0.05, 0.0))
    moved, usual = make_walk(setup=made_setup(release=release)), make_walk()
    assert not circles(film_strip(usual).axes[0]) and not circles(Film(usual).figure.axes[0])
    film = Film(moved)
    (axes,) = film.figure.axes
    assert axes.get_ylim()[1] == pytest.approx(0.2 + moved.sprocket_radius)
    places = sprocket_places(release, moved.frame_time) + moved.sprocket_center
    for frame, place in enumerate(places):
        film.draw(frame)
        assert circles(axes) == ([] if moved.frame_time[frame] >= 0.5 else [pytest.approx(place)])
    in_strip = circles(film_strip(moved).axes[0])
    assert 2 <= len(in_strip) < len(chains(film_strip(moved).axes[0]))
    assert all(np.isclose(places, place).all(axis=1).any() for place in in_strip)


def test_stretches_of_a_floor_with_coefficients_of_their_own_have_a_label() -> None:
    """In film strip, film and figure, where they are; those of the usual coefficients, or out of sight, have none."""
    ice, mat, usual = (0.018, 0.05), (0.5, 0.9), (0.018, 0.27)
    points = [(0, 0, *ice), (0.2, 0, *usual), (0.3, 0.02, *mat), (0.4, 0.02, *ice), (0.5, 0), (7, 0, 1, 1), (8, 0)]
    walk = make_walk(setup=made_setup(floor=points))
    labels = ["e = 0.018, μ = 0.05", "e = 0.5, μ = 0.9"]
    for figure in (film_strip(walk), Film(walk).figure):
        left = figure.axes[0].get_xlim()[0]
        expected = [[(left, 0), (0.2, 0)], [(0.4, 0.02), (0.5, 0)]], [[(0.3, 0.02), (0.4, 0.02)]]
        found = [child for child in figure.axes[0].collections if isinstance(child, LineCollection)]
        assert [str(lines.get_label()) for lines in found] == labels
        assert {text.get_text() for text in figure.legends[0].get_texts()} >= {*labels}
        for lines, faces in zip(found, expected, strict=True):
            np.testing.assert_allclose(lines.get_segments(), faces, atol=1e-12)
    height = walk.plot().axes[0]
    lines = {str(line.get_label()): line for line in height.lines}
    over_ice = np.isfinite(np.asarray(lines[labels[0]].get_ydata(), float))
    x = walk.center[:, 0]
    np.testing.assert_array_equal(over_ice, (x < 0.2) | ((x >= 0.4) & (x < 0.5)))
