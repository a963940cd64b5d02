"""Figures and moving pictures of walks whose plane tilts."""

import itertools
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from PIL import Image, ImageSequence

from tests.support.made_tilting_walks import MadeWalk, make_tilting_walk
from tests.support.made_walks import make_walk
from tests.support.real_tilting_walk import run_tilting_walk
from warpchain.pictures import animation
from warpchain.pictures.animation import animate
from warpchain.pictures.film import Film
from warpchain.pictures.room import ABOVE, FRONT, SIDE, link_outlines, link_solids, planes, view_from
from warpchain.pictures.walk_figures import film_strip
from warpchain.pictures.walk_shape import kinds_of

RADIUS, HALF_WIDTH = 4.2e-3, 4e-3


def joints_of(walk: MadeWalk) -> np.ndarray:
    """Its joints in the room."""
    assert walk.joints_in_room is not None
    return walk.joints_in_room


def data_of(page: str) -> dict[str, Any]:
    """The numbers on a page."""
    found = re.search(r"const walk = (\{.*\});\n", page)
    assert found is not None
    data: dict[str, Any] = json.loads(found.group(1))
    return data


# A plane that is fixed


def test_a_fixed_plane_changes_no_picture(tmp_path: Path) -> None:
    """A walk that says that it has no joints in the room gives the same files, to the bit, as one that says nothing."""
    plain = make_walk()
    empty = np.empty(0)
    same = {name: getattr(plain, name) for name in MadeWalk.__dataclass_fields__ if hasattr(plain, name)}
    fixed = MadeWalk(
        **(same | {"center_z": empty, "tilt": empty, "yaw": empty, "joints_in_room": None}),
        **{name: math.nan for name in ("fell_at", "collapsed_at") if name not in same},
    )
    for name in ("film_strip.png", "figure5.png", "walk.gif", "walk.html"):
        contents = []
        for number, walk in enumerate((plain, fixed)):
            path = tmp_path / f"{number}-{name}"
            if name.endswith(".png"):
                walk.plot("film_strip" if "film" in name else "figure5").savefig(path, dpi=40)
            else:
                walk.animate(path, fps=5, slow=2)
            contents.append(path.read_bytes())
        assert contents[0] == contents[1], name


def test_only_a_tilting_plane_has_a_tilt() -> None:
    """The figure of the tilt is refused for a plane that is fixed, and is not among its figures."""
    with pytest.raises(ValueError, match="walk: its plane is fixed"):
        make_walk().plot("tilt")
    assert set(kinds_of(make_tilting_walk())) - set(kinds_of(make_walk())) == {"tilt"}


# The room


def test_views_show_the_axes_of_the_room() -> None:
    """X points right from the side and from above, Z to the left from the front and down from above."""
    for view, expected in (
        (SIDE, [(1, 0), (0, 1), (0, 0)]),
        (ABOVE, [(1, 0), (0, 0), (0, -1)]),
        (FRONT, [(0, 0), (0, 1), (-1, 0)]),
    ):
        np.testing.assert_allclose(view.project(np.eye(3)), expected, atol=1e-15)
    view = view_from(0.6, 0.4)
    frame = np.stack([view.right, view.up, view.toward])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1) and min(view.toward) > 0
    assert view.project(np.array([0.0, 1.0, 0.0]))[0] == 0


def test_planes_hold_all_joints() -> None:
    """Mean and two directions give every joint back, whatever the plane."""
    joints = joints_of(make_tilting_walk())
    middle, axes = planes(joints)
    np.testing.assert_allclose(axes @ np.swapaxes(axes, 1, 2), np.broadcast_to(np.eye(2), (41, 2, 2)), atol=1e-12)
    local = (joints - middle[:, None]) @ np.swapaxes(axes, 1, 2)
    np.testing.assert_allclose(middle[:, None] + local @ axes, joints, atol=1e-12)


def test_an_upright_chain_shows_its_outlines() -> None:
    """From the side the faces of an upright chain are the outlines of its links, on the side of the viewer."""
    flat = make_walk().frame_joints[0]
    solids = link_solids(np.insert(flat, 2, 0.1, axis=1), RADIUS, HALF_WIDTH, SIDE)
    np.testing.assert_allclose(solids.faces[..., 2], 0.1 + HALF_WIDTH, atol=1e-12)
    expected = link_outlines(flat, RADIUS)
    for face, outline in zip(solids.faces[..., :2], expected, strict=True):
        distances = np.linalg.norm(face[:, None] - outline, axis=2)
        assert distances.min(axis=0).max() < 1e-12 and distances.min(axis=1).max() < 1e-12
    assert not solids.seen.any()


def test_walls_that_are_seen_face_the_viewer() -> None:
    """From above, the pieces of the wall that are seen are the upper ones; links that are higher are drawn later."""
    flat = make_walk().frame_joints[0]
    solids = link_solids(np.insert(flat, 2, 0.1, axis=1), RADIUS, HALF_WIDTH, ABOVE)
    heights = solids.walls[..., 1].mean(axis=2) - solids.walls[..., 1].mean(axis=(1, 2))[:, None]
    level = np.abs(np.diff(flat[:, 1], prepend=flat[-1, 1])) < RADIUS
    assert level.sum() >= 4
    for height, seen in zip(heights[level], solids.seen[level], strict=True):
        assert (
            height[seen].min() > height[~seen].max() - 0.4 * RADIUS and height[seen].mean() > 0 > height[~seen].mean()
        )
    places = (flat + np.roll(flat, 1, axis=0))[solids.order, 1] / 2
    for parity in (0, 1):
        assert np.all(np.diff(places[solids.order % 2 == parity]) >= -1e-12)


# Film strip


def test_film_strip_shows_three_sides(tmp_path: Path) -> None:
    """Three views of the same instants in the same colours, to one scale, and nothing cut off or overlapping."""
    walk = make_tilting_walk()
    joints = joints_of(walk)
    figure = film_strip(walk, count=7)
    side, front, above, bar = figure.axes
    colors = []
    for axes, names, columns in ((side, "xy", (0, 1)), (front, "zy", (2, 1)), (above, "xz", (0, 2))):
        assert (axes.get_xlabel(), axes.get_ylabel()) == tuple(f"${name}$ / m" for name in names)
        chains = [child for child in axes.collections if isinstance(child, PathCollection)][1::2]
        assert len(chains) == 7
        for chain, frame in ((chains[0], 0), (chains[-1], -1)):
            corners = np.concatenate([np.asarray(path.vertices) for path in chain.get_paths()])
            drawn = joints[frame][:, list(columns)]
            assert np.all(np.abs(corners.min(axis=0) - drawn.min(axis=0)) < 2 * RADIUS)
            assert np.all(np.abs(corners.max(axis=0) - drawn.max(axis=0)) < 2 * RADIUS)
        colors.append([{tuple(color) for color in np.asarray(chain.get_facecolor())} for chain in chains])
    assert all(one & other for one, other in itertools.pairwise(colors[0]) if one == other)
    assert colors[0] == colors[1] == colors[2]
    assert front.xaxis_inverted() and above.yaxis_inverted() and not side.xaxis_inverted()
    figure.savefig(tmp_path / "strip.png", dpi=50)
    scales = [size / shown for axes in (side, front, above) for size, shown in scale_of(axes)]
    np.testing.assert_allclose(scales, scales[0], rtol=1e-6)
    boxes = [box for axes in (side, front, above, bar) if (box := axes.get_tightbbox()) is not None]
    boxes.append(figure.legends[0].get_window_extent())
    for box in boxes:
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def scale_of(axes: Any) -> list[tuple[float, float]]:
    """Width and height of a panel on paper, and what they show."""
    box, shown = axes.get_window_extent(), axes.viewLim
    return [(box.width, abs(shown.width)), (box.height, abs(shown.height))]


@pytest.mark.parametrize("stretch", [0.05, 8.0])
def test_film_strips_of_short_and_long_walks_fit(stretch: float, tmp_path: Path) -> None:
    """Labels do not run into another view, however far the chain walked."""
    walk = make_tilting_walk()
    far = stretch * 0.6 * np.sin(walk.frame_time)[:, None, None] * np.array([1.0, 0.0, 0.0])
    center = walk.center + stretch * 0.6 * np.sin(walk.time)[:, None] * np.array([1.0, 0.0])
    figure = film_strip(make_tilting_walk(joints_in_room=joints_of(walk) + far, center=center))
    figure.savefig(tmp_path / "strip.png", dpi=50)
    boxes = [box for axes in figure.axes if (box := axes.get_tightbbox()) is not None]
    assert len(boxes) == 4
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
    assert all(box.x0 >= 0 and box.x1 <= figure.bbox.x1 for box in boxes)


def test_film_strip_of_one_upright_frame() -> None:
    """One frame of a chain that stands upright is enough."""
    walk = make_tilting_walk()
    one = make_tilting_walk(
        frame_time=walk.frame_time[:1],
        frame_joints=walk.frame_joints[:1],
        joints_in_room=joints_of(walk)[:1],
        sprocket_center=None,
        dx=math.nan,
    )
    film_strip(one).draw_without_rendering()


@pytest.mark.parametrize("draw", [film_strip, lambda walk: animate(walk, "walk.gif")])
def test_broken_joints_are_refused(draw: Any) -> None:
    """Joints in the room that are no numbers, or not those of the frames, are refused."""
    broken = joints_of(make_tilting_walk()).copy()
    broken[3, 2, 1] = math.nan
    with pytest.raises(ValueError, match="not all finite numbers"):
        draw(make_tilting_walk(joints_in_room=broken))
    with pytest.raises(ValueError, match=r"joints_in_room: its shape is \(40, 30, 3\)"):
        draw(make_tilting_walk(joints_in_room=broken[1:]))


# Tilt


def test_tilt_figure_draws_the_series_in_degrees() -> None:
    """Tilt and yaw in degrees, drift in metres, and the moments that the walk gives."""
    walk, own = make_tilting_walk(collapsed_at=0.9), Figure()
    assert walk.plot("tilt", figure=own) is own
    angles, drift = own.axes
    lines = {str(line.get_label()): line for line in angles.lines}
    np.testing.assert_allclose(lines["tilt, to the left"].get_ydata(), np.degrees(walk.tilt))
    np.testing.assert_allclose(lines["yaw, to the left"].get_ydata(), np.degrees(walk.yaw))
    assert any(np.array_equal(line.get_ydata(), walk.center_z) for line in drift.lines)
    assert lines[f"fell over (45°), {walk.fell_at:.3f} s"].get_xdata()[0] == walk.fell_at  # type: ignore[index]
    assert lines["loop collapsed, 0.900 s"].get_xdata()[0] == 0.9  # type: ignore[index]
    assert "degrees" in angles.get_ylabel() and "/ m" in drift.get_ylabel()
    labels = [str(line.get_label()) for line in make_tilting_walk(fell_at=math.nan).plot("tilt").axes[0].lines]
    assert not any("fell" in label or "collapsed" in label for label in labels)


# Moving pictures


def test_page_shows_the_chain_from_the_side(tmp_path: Path) -> None:
    """The page has x and y of the joints in the room, and says so."""
    walk = make_tilting_walk()
    animate(walk, tmp_path / "walk.html", slow=3)
    page = (tmp_path / "walk.html").read_text(encoding="utf-8")
    joints = np.array(data_of(page)["joints"]).reshape(41, -1, 2) * 1e-4
    np.testing.assert_allclose(joints, joints_of(walk)[..., :2], atol=0.6e-4)
    assert "from the side</title>" in page


@pytest.mark.parametrize("make", [make_walk, make_tilting_walk])
def test_titles_are_escaped(make: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a title says is text of the page, never a part of it."""
    monkeypatch.setattr(animation, "setting", lambda walk: "</title><script>&")
    animate(make(), tmp_path / "walk.html")
    page = (tmp_path / "walk.html").read_text(encoding="utf-8")
    assert page.count("&lt;/title&gt;&lt;script&gt;&amp;") == 2 and page.count("<script>") == 1


def test_gif_shows_the_chain_from_the_corner(tmp_path: Path) -> None:
    """A picture per frame; where outer links are projected there is blue, and the size suits video."""
    walk = make_tilting_walk()
    animate(walk, tmp_path / "walk.gif", fps=10, slow=4)
    film = Film(walk)
    assert all(side % 2 == 0 for side in film.size) and film.size[0] <= 960 and film.size[1] <= 560
    with Image.open(tmp_path / "walk.gif") as gif:
        pictures = [np.asarray(picture.convert("RGB")).astype(int) for picture in ImageSequence.Iterator(gif)]
    assert len(pictures) == 41 and pictures[0].shape == (*film.size[::-1], 3)
    for frame in (0, 20, 40):
        joints = joints_of(walk)[frame]
        outer = (joints + np.roll(joints, 1, axis=0))[1::2] / 2
        place = film._canvas.figure.axes[0].transData.transform(film._view.project(outer))
        x, y = (place * (1, -1) + (0, film.size[1])).astype(int).T
        red, _, blue = pictures[frame][y, x].T
        assert np.mean(blue - red > 60) > 0.9, frame


def test_mp4_frames(tmp_path: Path) -> None:
    """With the video extra an MP4 has a picture per tick of its clock, and its last one for 1.5 s."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    animate(make_tilting_walk(), tmp_path / "walk.mp4", fps=20, slow=2)
    assert ffmpeg.count_frames_and_secs(str(tmp_path / "walk.mp4"))[0] == 41 + 30


# A real motion


def test_a_simulated_fall_is_drawn_where_it_is(tmp_path: Path) -> None:
    """Links are drawn down to the lowest point that the kernels find, and no picture fails."""
    walk, lowest = run_tilting_walk(np.array([0.3, -5.0, 0.5]), links=60)
    assert walk.tilt.max() > 1.0 and 0 < walk.fell_at < 0.4 and np.ptp(walk.center_z) > 0.05
    for view in (SIDE, FRONT):
        drawn = []
        for joints in joints_of(walk):
            solids = link_solids(joints, RADIUS, HALF_WIDTH, view)
            drawn.append(solids.walls[..., 1].min())
        # The circles are polygons with corners every 22.5°.
        np.testing.assert_allclose(drawn, lowest, atol=RADIUS * (1 - math.cos(math.pi / 16)) + 1e-9)
    film_strip(walk).savefig(tmp_path / "strip.png", dpi=40)
    walk.plot("tilt").savefig(tmp_path / "tilt.png", dpi=40)
    animate(walk, tmp_path / "walk.gif", fps=10, slow=2)
    animate(walk, tmp_path / "walk.html")


def test_an_undisturbed_plane_is_that_of_the_picture() -> None:
    """A chain that nothing pushes sideways has its joints in the room where they are in its plane."""
    walk, _ = run_tilting_walk(np.zeros(3), end=0.1)
    np.testing.assert_allclose(joints_of(walk)[..., :2], walk.frame_joints, rtol=0, atol=1e-15)
    assert not joints_of(walk)[..., 2].any() and not walk.tilt.any()
