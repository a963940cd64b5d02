"""Results of walks: what they hold, the file that keeps them, figures and moving pictures."""

import dataclasses
import itertools
import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from PIL import Image, ImageSequence

from warpchain import animation, results
from warpchain.animation import animate
from warpchain.options import resolve
from warpchain.parameters import Parameters
from warpchain.plots import figure5, film_strip, link_outlines
from warpchain.results import CONTACTS, ENERGIES, STORED, WalkResult, load_walk
from warpchain.status import Status


def make_walk(links: int = 30, **changes: Any) -> WalkResult:
    """A chain that rolls to the right as an ellipse, touches the floor and sinks flat: 0.8 s, 41 frames."""
    time, frame_time = np.linspace(0.0, 0.8, 801), np.linspace(0.0, 0.8, 41)

    def height(moment: np.ndarray) -> np.ndarray:
        return np.where(moment < 0.5, 0.0642 + 0.01 * np.cos(12 * moment), 0.06 * np.exp(8 * (0.5 - moment)))

    center = np.stack([time**2, height(time)], axis=1)
    angle = -40 * frame_time[:, None] + 2 * np.pi * np.arange(links) / links
    half_height = height(frame_time) - 0.0042 - 0.005 * np.maximum(0.0, np.cos(12 * frame_time))
    offset = np.stack([0.04 * np.cos(angle), half_height[:, None] * np.sin(angle)], axis=2)
    middle = np.stack([frame_time**2, height(frame_time)], axis=1)
    rng = np.random.default_rng(5)
    values: dict[str, Any] = {
        "status": Status.AT_REST,
        "dx": 0.64 + 1e-17,
        "walk_time": 0.8,
        "simulated_time": 3.3,
        "softened_at": 0.4,
        "wall_time": 1.23456789012345678,
        "bounces": 3,
        "steps_accepted": 123_456_789_012,
        "steps_rejected": 17,
        "impulses": dict(zip(CONTACTS, (5, 7, 11), strict=True)),
        "greatest_opening": 1.1e-5,
        "greatest_penetration": dict(zip(CONTACTS, (1e-5, 0.0, 2e-5), strict=True)),
        "energy": {key: 0.1 * number for number, key in enumerate(ENERGIES)},
        "sprocket_center": np.array([0.0, 0.1]),
        "sprocket_radius": 0.0556,
        "setup": resolve("soft", scene={"links": links}, options={"method": "dp5"}, parameters={"floor_friction": 0.3}),
        "seed": 2**100 + 1,
        "versions": {"warpchain": "0.1.0", "warp-lang": "1.19.0"},
        "time": time,
        "center": center,
        "center_velocity": np.gradient(center, time, axis=0),
        "kinetic_energy": rng.random(801),
        "gravitational_energy": rng.random(801),
        "spring_energy": rng.random(801),
        "lowest": rng.random(801),
        "rms_speed": rng.random(801),
        "frame_time": frame_time,
        "frame_joints": offset + middle[:, None],
    }
    return WalkResult(**(values | changes))


def make_unreleased() -> WalkResult:
    """A walk that ended on the sprocket: no series, no frames, no distance."""
    names = [name for name, stored in STORED.items() if stored.path.startswith("series/")]
    empty: dict[str, Any] = {name: np.empty(0) for name in names}
    empty |= {"center": np.empty((0, 2)), "center_velocity": np.empty((0, 2)), "frame_time": np.empty(0)}
    energy = dict.fromkeys(ENERGIES, math.nan)
    return make_walk(
        status=Status.NOT_STEADY,
        dx=math.nan,
        energy=energy,
        sprocket_center=None,
        seed=None,
        frame_joints=np.empty((0, 30, 2)),
        **empty,
    )


def assert_same(first: WalkResult, second: WalkResult) -> None:
    """Every field is equal, numbers to the bit and in type."""
    for item in dataclasses.fields(WalkResult):
        one, other = getattr(first, item.name), getattr(second, item.name)
        assert type(one) is type(other), item.name
        if isinstance(one, np.ndarray):
            assert one.dtype == other.dtype and one.shape == other.shape, item.name
            assert one.tobytes() == other.tobytes(), item.name
        elif isinstance(one, float):
            assert one.hex() == other.hex(), item.name
        elif item.name == "energy":
            assert {key: number.hex() for key, number in one.items()} == {
                key: number.hex() for key, number in other.items()
            }
        else:
            assert one == other, item.name


# Status


def test_status_codes_are_fixed() -> None:
    """Codes keep their numbers, because kernels hold them."""
    assert {status.label: int(status) for status in Status} == {
        "running": 0,
        "at_rest": 1,
        "finished": 2,
        "time_limit": 3,
        "step_limit": 4,
        "step_too_small": 5,
        "not_finite": 6,
        "not_steady": 7,
        "list_overflow": 8,
    }


def test_status_says_what_to_try() -> None:
    """Only rest and a finished simulation are good ends; every failure names a remedy, in one line."""
    assert [status for status in Status if status.ok] == [Status.AT_REST, Status.FINISHED]
    for status in Status:
        assert re.fullmatch(r"[A-Z][^\n]*\.", status.sentence), status
        assert ("; " in status.sentence) == (not status.ok), status


def test_statuses_name_fields_that_exist() -> None:
    """The remedies speak of fields that scene and options have."""
    setup = make_walk().setup
    named = re.findall(r"(scene|options)\.(\w+)", " ".join(status.sentence for status in Status))
    assert len(named) >= 6
    assert all(hasattr(getattr(setup, model), field) for model, field in named)


# The record itself


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("lowest", np.zeros(800)),
        ("center", np.zeros((801, 3))),
        ("frame_joints", np.zeros((41, 32, 2))),
        ("sprocket_center", np.zeros(3)),
        ("impulses", {"floor": 1}),
        ("energy", dict.fromkeys([*ENERGIES, "heat"], 0.0)),
    ],
)
def test_misshapen_fields_are_refused(field: str, value: Any) -> None:
    """A walk whose arrays or dictionaries don't fit together can't be made, and the error names the field."""
    with pytest.raises(ValueError, match=rf"^{field}: .*; give|^{field}: .*give") as caught:
        make_walk(**{field: value})
    assert "\n" not in str(caught.value)


def test_to_dict_is_json() -> None:
    """The dictionary is strict JSON, with None for what is not finite, and comes back equal."""
    walk = make_walk(dx=math.nan, greatest_opening=math.inf)
    described = walk.to_dict()
    assert json.loads(json.dumps(described, allow_nan=False)) == described
    assert described["dx"] is None and described["greatest_opening"] is None
    assert described["status"] == "at_rest" and described["status_sentence"] == Status.AT_REST.sentence
    assert described["seed"] == 2**100 + 1 and described["preset"] == "soft"
    assert described["parameters"]["floor_friction"] == 0.3 and described["options"]["method"] == "dp5"
    assert described["scene"]["links"] == 30 and described["impulses"]["self"] == 11
    assert {"walk_time", "simulated_time", "wall_time", "bounces", "steps_accepted", "steps_rejected"} < set(described)
    assert not {"time", "center", "frame_joints"} & set(described)


def test_to_dict_takes_numpy_numbers() -> None:
    """NumPy's numbers, which engines hand over, become plain ones."""
    described = make_walk(bounces=np.int64(4), dx=np.float64(0.5), seed=np.int64(3)).to_dict()
    assert (described["bounces"], described["dx"], described["seed"]) == (4, 0.5, 3)
    json.dumps(described, allow_nan=False)


def test_repr_is_short() -> None:
    """A walk prints as one short line, not as its arrays."""
    assert repr(make_walk()) == ("<WalkResult at_rest: dx 0.64 m in 0.8 s, 3 bounces, 30 links at 15 Hz, soft>")


def test_light_import() -> None:
    """Results can be imported without h5py, matplotlib and Pillow."""
    code = "import sys, warpchain.results; print([m for m in ('h5py', 'matplotlib', 'PIL') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# The file


@pytest.mark.parametrize("make", [make_walk, make_unreleased])
def test_round_trip(make: Callable[[], WalkResult], tmp_path: Path) -> None:
    """A walk read back equals the one saved to the bit, NaN and absent parts included."""
    walk = make()
    walk.save(tmp_path / "walk.h5")
    assert_same(load_walk(tmp_path / "walk.h5"), walk)
    assert [path.name for path in tmp_path.iterdir()] == ["walk.h5"]


def test_extreme_numbers_survive(tmp_path: Path) -> None:
    """Signed zeros, infinities and denormal numbers come back to the bit, also from strided arrays."""
    odd = np.resize([-0.0, math.inf, -math.inf, 5e-324, math.nan, 0.1], 801)
    table = np.random.default_rng(1).random((801, 4))
    walk = make_walk(spring_energy=odd, lowest=table[:, 2], center=table[:, 1:3])
    walk.save(tmp_path / "walk.h5")
    assert_same(load_walk(tmp_path / "walk.h5"), walk)


def test_units_everywhere(tmp_path: Path) -> None:
    """Each dataset carries a unit and a description; parameters carry Table 1's unit and symbol."""
    walk = make_walk()
    walk.save(tmp_path / "walk.h5")
    found: dict[str, tuple[str, str]] = {}

    def note(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset):
            found[name] = node.attrs["unit"], node.attrs["description"]

    with h5py.File(tmp_path / "walk.h5") as file:
        file.visititems(note)
        assert file["parameters/joint_stiffness"][()] == 1e7
        for name, quantity in Parameters.quantities().items():
            assert found[f"parameters/{name}"] == (quantity.unit, quantity.meaning)
            assert file[f"parameters/{name}"].attrs["symbol"] == quantity.symbol
    assert all(unit and meaning for unit, meaning in found.values())
    assert found["series/center_velocity"][0] == "m/s" and found["frames/joints"][0] == "m"
    assert found["summary/energy/floor"][0] == "J" and found["summary/impulses/floor"][0] == "1"
    expected = sum(max(1, len(stored.keys)) for stored in STORED.values()) + len(Parameters.quantities())
    assert len(found) == expected


def test_provenance(tmp_path: Path) -> None:
    """The file says in JSON how to make the walk again."""
    walk = make_walk()
    walk.save(tmp_path / "walk.h5")
    with h5py.File(tmp_path / "walk.h5") as file:
        assert file.attrs["format"] == "warpchain walk" and file.attrs["format_version"] == 2
        assert file.attrs["status"] == "at_rest"
        setup = json.loads(file.attrs["setup"])
        assert json.loads(file.attrs["seed"]) == walk.seed
        assert json.loads(file.attrs["versions"]) == walk.versions
    sections = {name: setup[name] for name in ("scene", "options", "parameters")}
    assert resolve(setup["preset"], **sections) == walk.setup


def _fail_half_way(walk: WalkResult, file: h5py.File) -> None:
    file["half"] = np.zeros(1000)
    file.flush()
    raise KeyboardInterrupt


@pytest.mark.parametrize("culprit", ["write", "fsync", "replace"])
def test_interrupted_save_keeps_old_file(culprit: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever fails while a walk is saved, the older file stays whole and nothing else is left."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    before = path.read_bytes()

    def disk_full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    if culprit == "write":
        monkeypatch.setattr(results, "_write", _fail_half_way)
    else:
        monkeypatch.setattr(os, culprit, disk_full)
    with pytest.raises((KeyboardInterrupt, OSError)) as caught:
        make_walk(dx=0.1).save(path)
    monkeypatch.undo()
    if culprit != "write":
        assert str(caught.value).startswith(f"{path}: cannot be written (No space left on device); ")
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["walk.h5"]


def test_killed_save_keeps_old_file(tmp_path: Path) -> None:
    """A process that dies in the middle of saving leaves the older file whole."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    before = path.read_bytes()
    code = (
        "import os, sys; from warpchain import results\n"
        "def die(walk, file): file['half'] = [1.0]; file.flush(); os._exit(9)\n"
        "results._write = die; results.load_walk(sys.argv[1]).save(sys.argv[1])"
    )
    assert subprocess.run([sys.executable, "-c", code, str(path)], check=False).returncode == 9
    assert path.read_bytes() == before


@pytest.mark.parametrize("place", ["missing/walk.h5", "file/walk.h5", "folder"])
def test_unwritable_place(place: str, tmp_path: Path) -> None:
    """A place that can't take the file is refused in one line that names it."""
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    with pytest.raises(OSError) as caught:
        make_walk().save(tmp_path / place)
    assert str(caught.value).startswith(f"{tmp_path / place}: cannot be written (")
    assert "; give" in str(caught.value) and "\n" not in str(caught.value)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "folder"]


def _refused(path: Path) -> str:
    with pytest.raises(ValueError) as caught:
        load_walk(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ") and "; " in text and "\n" not in text
    return text


def test_foreign_files_are_refused(tmp_path: Path) -> None:
    """Text, an empty file, other HDF5, and walks of another format version are told apart."""
    path = tmp_path / "walk.h5"
    path.write_text("dx = 0.6\n")
    assert "not an HDF5 file" in _refused(path)
    path.write_bytes(b"")
    assert "not an HDF5 file" in _refused(path)
    with h5py.File(path, "w") as file:
        file["x"] = 1.0
    assert "HDF5, but not a walk" in _refused(path)
    make_walk().save(path)
    with h5py.File(path, "a") as file:
        file.attrs["format_version"] = 3
    assert "format version 3" in _refused(path)


def test_setup_of_another_version_is_refused(tmp_path: Path) -> None:
    """A setup with a field that this version doesn't know is refused by name."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    with h5py.File(path, "a") as file:
        setup = json.loads(file.attrs["setup"])
        setup["options"]["warp_factor"] = 9
        file.attrs["setup"] = json.dumps(setup)
    assert "(warp_factor)" in _refused(path)


@pytest.mark.parametrize("name", ["series/time", "summary/dx", "parameters", "frames/joints"])
def test_missing_part_is_refused(name: str, tmp_path: Path) -> None:
    """A file that lacks a dataset is damaged, unless the dataset only repeats the setup."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    with h5py.File(path, "a") as file:
        del file[name]
    if name == "parameters":
        assert_same(load_walk(path), make_walk())
    else:
        assert "damaged or cut short" in _refused(path)


@pytest.mark.parametrize("kept", [0.999, 0.7, 0.3, 0.02])
def test_truncated_file_is_refused(kept: float, tmp_path: Path) -> None:
    """A file that was cut short is never read as a walk."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    assert "damaged or cut short" in _refused(path)


def test_flipped_bit_is_noticed(tmp_path: Path) -> None:
    """Checksums reveal a single wrong bit in an array."""
    path = tmp_path / "walk.h5"
    make_walk().save(path)
    with h5py.File(path) as file:
        offset = file["frames/joints"].id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[offset + 100] ^= 1
    path.write_bytes(content)
    assert "damaged or cut short" in _refused(path)


def test_absent_file_is_named(tmp_path: Path) -> None:
    """A file that isn't there is an OSError with its path and a remedy."""
    with pytest.raises(OSError, match=r"none\.h5: No such file or directory; give") as caught:
        load_walk(tmp_path / "none.h5")
    assert "\n" not in str(caught.value)


# Figures


def test_figure5_draws_the_series() -> None:
    """The lines of Figure 5 are the walks' series themselves, over a shared time axis."""
    walks = [make_walk(), make_walk(links=34, center=2 * make_walk().center)]
    figure = figure5(walks)
    height, speed = figure.axes
    for walk, upper, lower in zip(walks, height.lines, speed.lines, strict=True):
        np.testing.assert_array_equal(upper.get_xydata(), np.stack([walk.time, walk.center[:, 1]], axis=1))
        np.testing.assert_array_equal(lower.get_xdata(), walk.time)
        np.testing.assert_array_equal(lower.get_ydata(), walk.center_velocity[:, 0])
        assert upper.get_color() == lower.get_color()
    assert height.get_shared_x_axes().joined(height, speed)
    legend = height.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["n = 30, ν = 15 Hz", "n = 34, ν = 15 Hz"]
    assert "/ m" in height.get_ylabel() and "/ (m/s)" in speed.get_ylabel() and "/ s" in speed.get_xlabel()


def test_figure5_legend_names_each_label_once() -> None:
    """Walks of one label share a colour and a legend entry."""
    figure = figure5([make_walk()] * 3, labels=["a", "b", "a"])
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["a", "b"]
    first, second, third = (line.get_color() for line in figure.axes[0].lines)
    assert first == third != second


def test_figure5_refusals() -> None:
    """No walk, a walk without release and a wrong number of labels are refused."""
    with pytest.raises(ValueError, match="walks: empty"):
        figure5([])
    with pytest.raises(ValueError, match=r"walks\[1\]: it has no time series\. The chain did not circulate"):
        figure5([make_walk(), make_unreleased()])
    with pytest.raises(ValueError, match="labels: 2 for 1 walks"):
        figure5([make_walk()], labels=["a", "b"])


def test_film_strip_shows_the_walk(tmp_path: Path) -> None:
    """The strip holds the chosen number of chains to scale, the path of their centre and the distance."""
    walk = make_walk()
    figure = film_strip(walk, count=7)
    strip, *close_ups = figure.axes
    assert len([child for child in strip.collections if isinstance(child, PolyCollection)]) == 3 * 7
    assert any(np.array_equal(line.get_xydata(), walk.center) for line in strip.lines)
    assert "$\\Delta x$ = 0.640 m" in [text.get_text() for text in strip.texts]
    halo, inner, outer = strip.collections[:3]
    drawn = np.stack([np.asarray(path.vertices)[:-1] for path in halo.get_paths()])
    outlines = link_outlines(walk.frame_joints[0], 4.2e-3)
    np.testing.assert_allclose(drawn, outlines, atol=1e-12)
    for links, layer in ((outlines[0::2], inner), (outlines[1::2], outer)):
        first = np.asarray(layer.get_paths()[0].vertices)[:-1]
        np.testing.assert_allclose(first, links[0], atol=1e-12)
    pale, dark = (np.array(layer.get_facecolor()) for layer in (inner, outer))
    assert np.all(pale[0, :3] > dark[0, :3])
    assert [axes.get_title("left").split("  ")[1] for axes in close_ups] == [
        "first touch, 0.140 s",
        "collapse, 0.540 s",
        "first self-contact, 0.660 s",
        "rest, 0.800 s",
    ]
    figure.savefig(tmp_path / "strip.png", dpi=50)
    for axes in figure.axes:
        box = axes.get_window_extent()
        shown = axes.viewLim
        assert box.width / shown.width == pytest.approx(box.height / shown.height, rel=1e-6)


def test_film_strip_labels_fit(tmp_path: Path) -> None:
    """Nothing that a film strip writes is cut off at the edge of the paper, or runs into another panel."""
    figure = film_strip(make_walk())
    figure.savefig(tmp_path / "strip.png", dpi=50)
    paper = figure.bbox
    boxes = [box for axes in figure.axes if (box := axes.get_tightbbox()) is not None]
    assert len(boxes) == 5
    for box in boxes:
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= paper.x1 and box.y1 <= paper.y1
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


def test_film_strip_of_a_failed_walk() -> None:
    """A walk that did not rest gets no distance, and its last close-up is the end, not rest."""
    figure = film_strip(make_walk(status=Status.TIME_LIMIT, dx=math.nan, sprocket_center=None))
    assert not any("Delta" in text.get_text() for text in figure.axes[0].texts)
    assert "end" in figure.axes[-1].get_title("left")


def test_film_strip_of_one_frame() -> None:
    """One frame is enough for a strip."""
    walk = make_walk()
    film_strip(make_walk(frame_time=walk.frame_time[:1], frame_joints=walk.frame_joints[:1])).draw_without_rendering()


@pytest.mark.parametrize("draw", [film_strip, lambda walk: animate(walk, "walk.gif")])
def test_pictures_need_whole_frames(draw: Callable[[WalkResult], Any]) -> None:
    """A walk without frames, or with broken ones, is refused with what happened to it."""
    with pytest.raises(ValueError, match=r"no frames \(not_steady\); run it again with a frame_interval"):
        draw(make_unreleased())
    broken = make_walk().frame_joints.copy()
    broken[-1, 3] = math.nan
    with pytest.raises(ValueError, match="not all finite numbers"):
        draw(make_walk(status=Status.NOT_FINITE, frame_joints=broken))


def test_plot_chooses_the_figure() -> None:
    """`plot` makes either figure, into a figure of the caller's if given, and refuses other kinds."""
    from matplotlib.figure import Figure

    walk, own = make_walk(), Figure()
    assert walk.plot(figure=own) is own and len(own.axes) == 2
    assert len(walk.plot("film_strip").axes) == 5
    with pytest.raises(ValueError, match="kind: 'pie' is unknown"):
        walk.plot("pie")  # type: ignore[arg-type]


def test_link_outlines_are_two_circles() -> None:
    """Outlines lie within `radius` of their link's axis and reach exactly that far beyond its joints."""
    joints, radius = make_walk().frame_joints[0], 4.2e-3
    outlines = link_outlines(joints, radius)
    for corners, right, left in zip(outlines, joints, np.roll(joints, 1, axis=0), strict=True):
        along = (right - left) / np.hypot(*(right - left))
        across = np.array([-along[1], along[0]])
        assert np.max((corners - right) @ along) == pytest.approx(radius)
        assert np.min((corners - left) @ along) == pytest.approx(-radius)
        assert np.max(np.abs((corners - left) @ across)) == pytest.approx(radius)
        near = np.minimum(*(np.hypot(*(corners - joint).T) for joint in (left, right)))
        assert np.sum(np.isclose(near, radius)) >= 18


# Moving pictures


@pytest.mark.parametrize(
    ("fps", "slow", "count"),
    [
        (10, 5, 41),  # one picture per frame
        (30, 4, 41),  # more pictures than frames: each frame once
        (10, 2, 17),  # fewer
    ],
)
def test_gif_frames_and_times(fps: float, slow: float, count: int, tmp_path: Path) -> None:
    """A GIF has the right number of pictures, and lasts `slow` times as long as the walk, then rests."""
    animate(make_walk(), tmp_path / "walk.gif", fps=fps, slow=slow)
    with Image.open(tmp_path / "walk.gif") as gif:
        durations = [picture.info["duration"] for picture in ImageSequence.Iterator(gif)]
    assert len(durations) == count
    assert durations[-1] == 1500
    assert sum(durations[:-1]) == pytest.approx(800 * slow, abs=1000 / fps)
    assert [entry.name for entry in tmp_path.iterdir()] == ["walk.gif"]


def test_gif_draws_the_chain(tmp_path: Path) -> None:
    """The first picture shows outer links darker than inner ones, and paper inside their loop."""
    walk = make_walk()
    animate(walk, tmp_path / "walk.gif", fps=10, slow=5)
    stage = animation._Stage(walk)
    with Image.open(tmp_path / "walk.gif") as gif:
        assert gif.size == stage.size
        pixels = np.asarray(gif.convert("RGB")).astype(int)
    joints = walk.frame_joints[0]

    def brightness(place: np.ndarray) -> int:
        x, y = stage._pixels(place) / 3
        return int(pixels[int(y), int(x)].sum())

    middles = [brightness(middle) for middle in (joints + np.roll(joints, 1, axis=0)) / 2]
    assert np.median(middles[0::2]) > 450 > 400 > max(middles[1::2])
    assert brightness(joints.mean(axis=0) + 0.015) > 700


def test_gif_size_limit(tmp_path: Path) -> None:
    """A GIF too long to hold in memory is refused before the first picture is drawn."""
    walk = make_walk()
    time = np.linspace(0.0, 20.0, 2001)
    long = make_walk(frame_time=time, frame_joints=np.resize(walk.frame_joints, (2001, 30, 2)))
    with pytest.raises(ValueError, match="pictures are too many for a GIF; lower fps or slow"):
        animate(long, tmp_path / "walk.gif", fps=50, slow=8)
    assert not list(tmp_path.iterdir())


def test_html_is_complete_in_itself(tmp_path: Path) -> None:
    """The page loads nothing, and holds the joints to a tenth of a millimetre, the times to a microsecond."""
    walk = make_walk()
    animate(walk, tmp_path / "walk.html", slow=3)
    page = (tmp_path / "walk.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|//cdn|\bsrc\s*=|\bhref\s*=|@import|\burl\(|\bfetch\(|\bimport\b|{{", page)
    found = re.search(r"const walk = (\{.*\});\n", page)
    assert found is not None
    data = json.loads(found.group(1))
    joints = np.array(data["joints"]).reshape(walk.frame_joints.shape) * 1e-4
    assert np.max(np.abs(joints - walk.frame_joints)) <= 0.5e-4 * (1 + 1e-9)
    np.testing.assert_allclose(np.array(data["time"]) * 1e-6, walk.frame_time, atol=5e-7)
    assert data["slow"] == 3 and data["sprocket"] == [0, 1000, 556]
    assert "<title>30 links, 15 Hz: \u0394x = 0.640 m</title>" in page


def test_html_thins_long_recordings(tmp_path: Path) -> None:
    """A page holds at most 2,000 frames, evenly chosen, the first and the last among them."""
    joints = np.resize(make_walk().frame_joints, (5001, 30, 2))
    walk = make_walk(frame_time=np.linspace(0.0, 0.8, 5001), frame_joints=joints)
    animate(walk, tmp_path / "walk.html")
    found = re.search(r'"time":(\[[^]]*\])', (tmp_path / "walk.html").read_text(encoding="utf-8"))
    assert found is not None
    times = json.loads(found.group(1))
    assert len(times) == 2000 and times[0] == 0 and times[-1] == 800_000
    assert set(np.diff(np.rint(np.array(times) / 160))) <= {2, 3}


def test_mp4_without_encoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the video extra an MP4 is refused in one line that says what to install."""
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ImportError, match=r"pip install 'warpchain\[video\]'") as caught:
        animate(make_walk(), tmp_path / "walk.mp4")
    assert "\n" not in str(caught.value) and not list(tmp_path.iterdir())


def test_mp4_frames(tmp_path: Path) -> None:
    """With the video extra an MP4 has a picture per tick of its clock, and its last one for 1.5 s."""
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    animate(make_walk(), tmp_path / "walk.mp4", fps=20, slow=2)
    assert ffmpeg.count_frames_and_secs(str(tmp_path / "walk.mp4"))[0] == 33 + 30


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        (
            "walk.avi",
            {},
            r"walk\.avi: unknown kind of picture; give a name that ends in \.gif, \.mp4 or \.html",
        ),
        ("walk.gif", {"fps": 0}, "fps: 0 is not a positive number"),
        ("walk.html", {"slow": math.nan}, "slow: nan is not a positive number"),
        ("walk.gif", {"fps": 60}, "fps: 60 is too fast for a GIF"),
    ],
)
def test_animation_refusals(name: str, settings: dict[str, float], message: str, tmp_path: Path) -> None:
    """Unknown suffixes and impossible speeds are refused before anything is written."""
    with pytest.raises(ValueError, match=message):
        animate(make_walk(), tmp_path / name, **settings)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["walk.gif", "walk.html"])
def test_interrupted_animation_keeps_old_file(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Moving pictures, too, are written whole or not at all."""
    path = tmp_path / name
    path.write_text("old")

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="cannot be written"):
        animate(make_walk(), path)
    assert path.read_text() == "old" and [entry.name for entry in tmp_path.iterdir()] == [name]
