"""Videos out of text tables: forms of files, units, directions, times."""

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.made_videos import motion
from warpchain import InputError, video

TRACKER = "cm_A\nt\tx\ty\t\n{}\n"
CLIP = motion(0.3).seen(video.Camera(), np.zeros(9), np.random.default_rng(4))


def table(time: np.ndarray, center: np.ndarray, mark: str = "\t") -> str:
    """Rows as a program would write them."""
    return "\n".join(mark.join(f"{value:.9E}" for value in row) for row in np.column_stack([time, center]))


def write(folder: Path, text: str) -> Path:
    """A file with a text."""
    path = folder / "video.txt"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        TRACKER.format(table(CLIP.time, CLIP.center)),
        TRACKER.format(table(CLIP.time, CLIP.center).replace(".", ",")),
        TRACKER.format(table(CLIP.time, CLIP.center) + "\n9.0\t\t\n"),
        TRACKER.format("nan\t0\t0\n" + table(CLIP.time, CLIP.center) + "\n9.0\tnan\t0\n9.1\t-inf\t0\n9.2\t0\t1e999\n"),
        "t;x;y\n" + table(CLIP.time, CLIP.center, ";").replace(".", ","),
        "frame,t,x,y\n" + "\n".join(f"7,{line}" for line in table(CLIP.time, CLIP.center, ",").splitlines()),
        't (s)  "x (mm)" y [mm]\n' + table(CLIP.time, 1e3 * CLIP.center, " "),
        "t (s);x [cm];y [cm];v_x (m/s)\n" + table(CLIP.time, 1e2 * CLIP.center, ";"),
        "t (ms)\tx / cm\ty / cm\n" + table(1e3 * CLIP.time, 1e2 * CLIP.center),
        "t\tx_{cm} (mm)\ty_{cm} (mm)\n" + table(CLIP.time, 1e3 * CLIP.center),
        "\ufeffy,x,t\n" + table(CLIP.center[:, 1], np.column_stack([CLIP.center[:, 0], CLIP.time]), ","),
    ],
)
def test_tables_of_many_programs_are_read(text: str, tmp_path: Path) -> None:
    """Tabs, semicolons, commas, decimal commas, units in heads, further columns, another order, marks left out."""
    clip = video.read(write(tmp_path, text), links=60, frequency=20.0, release=0.0)
    assert clip.time == pytest.approx(CLIP.time, abs=1e-8) and clip.center == pytest.approx(CLIP.center, abs=1e-8)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_tables_in_unicode_of_windows_are_read(encoding: str, tmp_path: Path) -> None:
    """With a mark of the byte order; what has none, and is no UTF-8, is refused."""
    path, text = tmp_path / "video.txt", TRACKER.format(table(CLIP.time, CLIP.center))
    path.write_text(text, encoding=encoding)
    clip = video.read(path, links=60, frequency=20.0, release=0.0)
    assert clip.center == pytest.approx(CLIP.center, abs=1e-8)
    path.write_text(text, encoding="utf-16-le")
    with pytest.raises(InputError, match=r"video\.txt: neither UTF-8 nor UTF-16 .*; save it as UTF-8 text"):
        video.read(path, links=60, frequency=20.0, release=0.0)


@pytest.mark.parametrize("unit", ["km", "in", "yd", "px", "µm", "Meter", "m/s"])
@pytest.mark.parametrize("form", ["({})", "[{}]", "/ {}"])
def test_unknown_units_in_heads_are_refused(unit: str, form: str, tmp_path: Path) -> None:
    """No head is read as metres or seconds that says anything else, whatever `unit` is."""
    rows = table(CLIP.time, CLIP.center)
    for heads in (f"t\tx {form}\ty {form}", f"t {form}\tx\ty"):
        path = write(tmp_path, heads.format(unit, unit) + "\n" + rows)
        for given in (None, "mm"):
            with pytest.raises(
                InputError, match=r"video\.txt: unknown unit in the header '[txy] .*; use .*m?s?, or name"
            ):
                video.read(path, links=60, frequency=20.0, unit=given)  # type: ignore[arg-type]


def test_a_subscript_that_may_be_a_unit_is_asked_about(tmp_path: Path) -> None:
    """`x_{cm}` is the centre of mass to some programs."""
    path = write(tmp_path, "t\tx_{cm}\ty_{cm}\n" + table(CLIP.time, 1e3 * CLIP.center))
    with pytest.raises(
        InputError, match=r"^unit: the header x_\{cm\} of .* may mean a unit or the centre of mass; set"
    ):
        video.read(path, links=60, frequency=20.0, release=0.0)
    clip = video.read(path, links=60, frequency=20.0, release=0.0, unit="mm")
    assert clip.center == pytest.approx(CLIP.center, abs=1e-8)


def test_spans_and_sizes_are_bounded_before_any_work(tmp_path: Path) -> None:
    """Times in ms or over minutes, a table that never ends: a line within a second, where a fit took minutes."""
    began = time.process_time()
    last = np.append(CLIP.time, 1e9 - np.arange(9, -1, -1))
    path = write(tmp_path, TRACKER.format(table(1e3 * CLIP.time, CLIP.center)))
    with pytest.raises(InputError, match=r"^t: .* got 0\.24; if t is in ms, write t \(ms\)"):
        video.read(path, links=60, frequency=20.0)
    path = write(tmp_path, TRACKER.format(table(last, np.resize(CLIP.center, (len(last), 2)))))
    with pytest.raises(InputError, match=r"^t: expected at most 60 s, got 1e\+09 s; export only"):
        video.read(path, links=60, frequency=20.0)
    path.write_bytes(b"t,x,y\n" + b"1,2,3\n" * 2_000_000)
    with pytest.raises(
        InputError, match=r"video\.txt: more than 8 MB; export only the centre of mass around the release"
    ):
        video.read(path, links=60, frequency=20.0)
    assert time.process_time() - began < 2


def test_units_direction_origin_and_slow_motion(tmp_path: Path) -> None:
    """A video in millimetres, mirrored, from another origin, at an eighth of its speed is the same video."""
    center = 1e3 * CLIP.center * [-1, 1] + [250, -40]
    path = write(tmp_path, TRACKER.format(table(8 * (CLIP.time - CLIP.time[0]), center)))
    clip = video.read(
        path,
        links=60,
        frequency=20.0,
        unit="mm",
        direction="left",
        origin=(250, -40),
        fps=240.0,
        release=-CLIP.time[0],
        outline=[190, 320, -30, 300],
        speed=7.5,
    )
    assert clip.time == pytest.approx(CLIP.time, abs=1e-6) and clip.center == pytest.approx(CLIP.center, abs=1e-8)
    assert clip.outline == pytest.approx([-0.07, 0.06, 0.01, 0.34]) and clip.speed == 7.5


def test_the_release_is_found(tmp_path: Path) -> None:
    """Fitted to the fall, its error is within that of a camera, in 30 videos of 0.5 mm noise and one without any."""
    found = []
    for seed in range(31):
        camera = video.Camera(release=1e-9, noise=5e-4 if seed else 1e-9)
        clip = motion(0.3, 0.008).seen(camera, np.zeros(9), np.random.default_rng(seed))
        path = write(tmp_path, TRACKER.format(table(clip.time + 1.234, clip.center)))
        found.append(video.read(path, links=60, frequency=20.0).time[0] - clip.time[0])
    assert abs(np.mean(found)) < 8e-4 and np.std(found) < video.Camera().release


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("time,x,y\n1,2,3\n", "expected column headers t, x and y, got 'time, x, y'; .* or rename these"),
        ("Time (s)\tX (m)\tY (m)\n1\t2\t3\n", "expected column headers t, x and y, got 'Time"),
        ("#multi:\n\tcm A\t\tcm B\nt\tx\ty\tx\ty\n", "several columns t, x or y"),
        ("t,x,y\n0,1,0,2,0,3\n", "line 2 has too many cells; separate them by tabs or semicolons"),
        ("t,x,y\n1,2,3\n4,five,6\n", "line 3 is not numeric"),
        ("t,x,y\n1,2,3\n", "expected at least 20 frames .* got 1;"),
        ("t,x,y\n" + "1,2,3\n" * 30, "in order of time"),
    ],
)
def test_what_is_no_video_is_refused(text: str, wrong: str, tmp_path: Path) -> None:
    """One line names the file and says what to do."""
    with pytest.raises(InputError, match=wrong) as error:
        video.read(write(tmp_path, text), links=60, frequency=20.0)
    assert str(error.value).startswith(str(tmp_path)) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    "value",
    [
        *({"links": "many"}, {"frequency": 0.0}, {"fps": -30.0}, {"speed": 0.0}, {"outline": [1, 2, 3]}),
        *({"release": "a"}, {"release": np.nan}, {"path": 5}),
        *({"origin": origin} for origin in (("a", "b"), (1, 2, 3), 5, (np.nan, 0))),
    ],
)
def test_values_beside_the_file_are_checked(value: dict[str, Any], tmp_path: Path) -> None:
    """A line names what is none of a video."""
    path = write(tmp_path, TRACKER.format(table(CLIP.time, CLIP.center)))
    with pytest.raises(InputError, match=f"^{next(iter(value))}: "):
        video.read(**{"path": path, "links": 60, "frequency": 20.0, "release": 0.0} | value)


def test_an_unknown_unit_or_a_missing_file_is_refused(tmp_path: Path) -> None:
    """Units are m, cm and mm, and those of the headers; centimetres read as metres leave too short a video."""
    with pytest.raises(InputError, match=r"unit: expected m, cm or mm, .*'inch'"):
        video.read(tmp_path / "video.txt", links=60, frequency=20.0, unit="inch")  # type: ignore[arg-type]
    path = write(tmp_path, "t (s);x (cm);y (cm)\n" + table(CLIP.time, 100 * CLIP.center, ";"))
    with pytest.raises(InputError, match=r"unit: headers of .* and unit say cm and m; correct one"):
        video.read(path, links=60, frequency=20.0, unit="m")
    path.write_text(path.read_text(encoding="utf-8").replace(" (cm)", ""), encoding="utf-8")
    with pytest.raises(InputError, match=r"video: expected .* check unit, fps, or set release"):
        video.friction_line(video.read(path, links=60, frequency=20.0))
    path.unlink()
    with pytest.raises(InputError, match=r"^/dev/null: not a regular file; use the path of a text table"):
        video.read("/dev/null", links=60, frequency=20.0)
    with pytest.raises(OSError, match=r"video\.txt"):
        video.read(tmp_path / "video.txt", links=60, frequency=20.0)
