"""Files that are written whole or not at all, and what they may replace."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.made_walks import make_walk
from tests.support.synthetic_sweep import run
from warpchain.files import NotReplaceable, given_path, replacing, write_whole
from warpchain.results.sweep_result import merge


def parts(folder: Path) -> list[str]:
    """Names of hidden files."""
    return sorted(path.name for path in folder.iterdir() if path.name.startswith("."))


@pytest.mark.parametrize(
    ("kind", "reason"),
    [("folder", "a folder"), ("pipe", "no regular"), ("socket", "no regular"), ("link", "a symbolic link")],
)
def test_only_regular_files_are_replaced(tmp_path: Path, kind: str, reason: str) -> None:
    """Folder, pipe, socket and link are refused in one line and stay; what a link leads to is not touched."""
    path, other = tmp_path / "walk.h5", tmp_path / "other"
    other.write_text("mine")
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "link":
        path.symlink_to(other)
    else:
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(str(path))
    before = path.lstat()
    with pytest.raises(
        NotReplaceable, match=rf"^{path}: cannot be written \(.*{reason}.*\); use another path"
    ) as caught:
        make_walk().save(path)
    assert "\n" not in str(caught.value)
    assert path.lstat() == before and other.read_text() == "mine" and len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("path", "problem"),
    [("", "a path is empty"), ("a\0b", r"'a\\x00b': has a NUL"), ("a\ud800b", r"'a\\ud800b': has a NUL or a lone")],
)
def test_no_path_at_all_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str, problem: str) -> None:
    """Nothing, NUL and lone surrogates give one line, whoever is asked to write."""
    monkeypatch.chdir(tmp_path)
    for write in (given_path, make_walk().save, lambda name: merge(tmp_path, name), lambda name: run(name)):
        with pytest.raises(OSError, match=f"^{problem}.*; ") as caught:
            write(path)
        assert str(caught.value).isascii() and str(caught.value).isprintable()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("error", [OSError(28, "full"), ValueError("bad"), KeyboardInterrupt(), SystemExit(3)])
def test_no_part_is_left_after_any_exception(tmp_path: Path, error: BaseException) -> None:
    """The part goes and the older file stays."""
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(type(error)), replacing(path) as part:
        part.write_text("half")
        raise error
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_the_part_of_a_living_writer_stays(tmp_path: Path) -> None:
    """A second writer of the same file, in another process or this one, takes nothing away; the last one counts."""
    path = tmp_path / "file"
    with replacing(path) as part:
        part.write_text("slow")
        program = "import sys; from warpchain.files import write_whole; write_whole(sys.argv[1], 'quick')"
        subprocess.run([sys.executable, "-c", program, path], check=True)
        assert path.read_text() == "quick" and parts(tmp_path) == [part.name]
        write_whole(path, "quicker")
        assert path.read_text() == "quicker" and parts(tmp_path) == [part.name]
    assert path.read_text() == "slow" and parts(tmp_path) == []
