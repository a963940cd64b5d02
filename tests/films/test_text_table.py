"""Films out of text tables: forms of files, units, directions, times."""

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.made_films import motion
from warpchain import InputError, films

TRACKER = "cm_A\nt\tx\ty\t\n{}\n"
FILM = motion(0.3).seen(films.Camera(), np.zeros(9), np.random.default_rng(4))


def table(time: np.ndarray, center: np.ndarray, mark: str = "\t") -> str:
    """Rows as a program would write them."""
    return "\n".join(mark.join(f"{value:.9E}" for value in row) for row in np.column_stack([time, center]))


def write(folder: Path, text: str) -> Path:
    """A file with a text."""
    path = folder / "film.txt"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        TRACKER.format(table(FILM.time, FILM.center)),
        TRACKER.format(table(FILM.time, FILM.center).replace(".", ",")),
        TRACKER.format(table(FILM.time, FILM.center) + "\n9.0\t\t\n"),
        TRACKER.format("nan\t0\t0\n" + table(FILM.time, FILM.center) + "\n9.0\tnan\t0\n9.1\t-inf\t0\n9.2\t0\t1e999\n"),
        "t;x;y\n" + table(FILM.time, FILM.center, ";").replace(".", ","),
        "frame,t,x,y\n" + "\n".join(f"7,{line}" for line in table(FILM.time, FILM.center, ",").splitlines()),
        't (s)  "x (mm)" y [mm]\n' + table(FILM.time, 1e3 * FILM.center, " "),
        "t (s);x [cm];y [cm];v_x (m/s)\n" + table(FILM.time, 1e2 * FILM.center, ";"),
        "t (ms)\tx / cm\ty / cm\n" + table(1e3 * FILM.time, 1e2 * FILM.center),
        "t\tx_{cm} (mm)\ty_{cm} (mm)\n" + table(FILM.time, 1e3 * FILM.center),
        "\ufeffy,x,t\n" + table(FILM.center[:, 1], np.column_stack([FILM.center[:, 0], FILM.time]), ","),
    ],
)
def test_tables_of_many_programs_are_read(text: str, tmp_path: Path) -> None:
    """Tabs, semicolons, commas, decimal commas, units in heads, further columns, another order, marks left out."""
    film = films.read(write(tmp_path, text), links=60, frequency=20.0, release=0.0)
    assert film.time == pytest.approx(FILM.time, abs=1e-8) and film.center == pytest.approx(FILM.center, abs=1e-8)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_tables_in_unicode_of_windows_are_read(encoding: str, tmp_path: Path) -> None:
    """With a mark of the byte order; what has none, and is no UTF-8, is refused."""
    path, text = tmp_path / "film.txt", TRACKER.format(table(FILM.time, FILM.center))
    path.write_text(text, encoding=encoding)
    film = films.read(path, links=60, frequency=20.0, release=0.0)
    assert film.center == pytest.approx(FILM.center, abs=1e-8)
    path.write_text(text, encoding="utf-16-le")
    with pytest.raises(InputError, match=r"film\.txt: neither UTF-8 nor UTF-16 .*; save it as a text in UTF-8"):
        films.read(path, links=60, frequency=20.0, release=0.0)


@pytest.mark.parametrize("unit", ["km", "in", "yd", "px", "µm", "Meter", "m/s"])
@pytest.mark.parametrize("form", ["({})", "[{}]", "/ {}"])
def test_unknown_units_in_heads_are_refused(unit: str, form: str, tmp_path: Path) -> None:
    """No head is read as metres or seconds that says anything else, whatever `unit` is."""
    rows = table(FILM.time, FILM.center)
    for heads in (f"t\tx {form}\ty {form}", f"t {form}\tx\ty"):
        path = write(tmp_path, heads.format(unit, unit) + "\n" + rows)
        for given in (None, "mm"):
            with pytest.raises(
                InputError, match=r"film\.txt: unknown unit in the head '[txy] .*; give .*m?s?, or name"
            ):
                films.read(path, links=60, frequency=20.0, unit=given)  # type: ignore[arg-type]


def test_a_subscript_that_may_be_a_unit_is_asked_about(tmp_path: Path) -> None:
    """`x_{cm}` is the centre of mass to some programs."""
    path = write(tmp_path, "t\tx_{cm}\ty_{cm}\n" + table(FILM.time, 1e3 * FILM.center))
    with pytest.raises(InputError, match=r"^unit: the head x_\{cm\} of .* may mean a unit or the centre of mass; give"):
        films.read(path, links=60, frequency=20.0, release=0.0)
    film = films.read(path, links=60, frequency=20.0, release=0.0, unit="mm")
    assert film.center == pytest.approx(FILM.center, abs=1e-8)


def test_spans_and_sizes_are_bounded_before_any_work(tmp_path: Path) -> None:
    """Times in ms or over minutes, a table that never ends: a line within a second, where a fit took minutes."""
    began = time.process_time()
    last = np.append(FILM.time, 1e9 - np.arange(9, -1, -1))
    path = write(tmp_path, TRACKER.format(table(1e3 * FILM.time, FILM.center)))
    with pytest.raises(InputError, match=r"^t: 0\.24 frames a second; if the times are in ms, write t \(ms\)"):
        films.read(path, links=60, frequency=20.0)
    path = write(tmp_path, TRACKER.format(table(last, np.resize(FILM.center, (len(last), 2)))))
    with pytest.raises(InputError, match=r"^t: the film lasts 1e\+09 s; cut it to 60 s at most about the release"):
        films.read(path, links=60, frequency=20.0)
    path.write_bytes(b"t,x,y\n" + b"1,2,3\n" * 2_000_000)
    with pytest.raises(InputError, match=r"film\.txt: more than 8 MB; export the centre of mass about the release"):
        films.read(path, links=60, frequency=20.0)
    assert time.process_time() - began < 2


def test_units_direction_origin_and_slow_motion(tmp_path: Path) -> None:
    """A film in millimetres, mirrored, from another origin, at an eighth of its speed is the same film."""
    center = 1e3 * FILM.center * [-1, 1] + [250, -40]
    path = write(tmp_path, TRACKER.format(table(8 * (FILM.time - FILM.time[0]), center)))
    film = films.read(
        path,
        links=60,
        frequency=20.0,
        unit="mm",
        direction="left",
        origin=(250, -40),
        fps=240.0,
        release=-FILM.time[0],
        outline=[190, 320, -30, 300],
        speed=7.5,
    )
    assert film.time == pytest.approx(FILM.time, abs=1e-6) and film.center == pytest.approx(FILM.center, abs=1e-8)
    assert film.outline == pytest.approx([-0.07, 0.06, 0.01, 0.34]) and film.speed == 7.5


def test_the_release_is_found(tmp_path: Path) -> None:
    """Fitted to the fall, its error is within that of a camera, in 30 films of 0.5 mm noise and one without any."""
    found = []
    for seed in range(31):
        camera = films.Camera(release=1e-9, noise=5e-4 if seed else 1e-9)
        film = motion(0.3, 0.008).seen(camera, np.zeros(9), np.random.default_rng(seed))
        path = write(tmp_path, TRACKER.format(table(film.time + 1.234, film.center)))
        found.append(films.read(path, links=60, frequency=20.0).time[0] - film.time[0])
    assert abs(np.mean(found)) < 8e-4 and np.std(found) < films.Camera().release


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("time,x,y\n1,2,3\n", "no line with the column heads t, x and y, but 'time, x, y'; .* or rename them"),
        ("Time (s)\tX (m)\tY (m)\n1\t2\t3\n", "no line with the column heads t, x and y, but 'Time"),
        ("#multi:\n\tcm A\t\tcm B\nt\tx\ty\tx\ty\n", "several columns t, x or y"),
        ("t,x,y\n0,1,0,2,0,3\n", "line 2 has too many cells; part them by tabs or semicolons"),
        ("t,x,y\n1,2,3\n4,five,6\n", "line 3 is not numbers"),
        ("t,x,y\n1,2,3\n", "1 frames; give at least 20"),
        ("t,x,y\n" + "1,2,3\n" * 30, "in order of time"),
    ],
)
def test_what_is_no_film_is_refused(text: str, wrong: str, tmp_path: Path) -> None:
    """One line names the file and says what to do."""
    with pytest.raises(InputError, match=wrong) as error:
        films.read(write(tmp_path, text), links=60, frequency=20.0)
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
    """A line names what is none of a film."""
    path = write(tmp_path, TRACKER.format(table(FILM.time, FILM.center)))
    with pytest.raises(InputError, match=f"^{next(iter(value))}: "):
        films.read(**{"path": path, "links": 60, "frequency": 20.0, "release": 0.0} | value)


def test_an_unknown_unit_or_a_missing_file_is_refused(tmp_path: Path) -> None:
    """Units are m, cm and mm, and not others than the heads'; in m, places in cm leave too short a film; no devices."""
    with pytest.raises(InputError, match="unit: 'inch'"):
        films.read(tmp_path / "film.txt", links=60, frequency=20.0, unit="inch")  # type: ignore[arg-type]
    path = write(tmp_path, "t (s);x (cm);y (cm)\n" + table(FILM.time, 100 * FILM.center, ";"))
    with pytest.raises(InputError, match=r"unit: heads of .* and unit say cm and m; correct one"):
        films.read(path, links=60, frequency=20.0, unit="m")
    path.write_text(path.read_text(encoding="utf-8").replace(" (cm)", ""), encoding="utf-8")
    with pytest.raises(InputError, match=r"film: it shows .* check unit, fps, or give release"):
        films.friction_line(films.read(path, links=60, frequency=20.0))
    path.unlink()
    with pytest.raises(InputError, match=r"^/dev/null: no regular file; give the path of a text table"):
        films.read("/dev/null", links=60, frequency=20.0)
    with pytest.raises(OSError, match=r"film\.txt"):
        films.read(tmp_path / "film.txt", links=60, frequency=20.0)
