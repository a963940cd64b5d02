"""What commands write where: paths that are refused, and disks that are full."""

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.run.test_sweep_run import TINY
from tests.support.command_line import Answer, Command
from tests.support.made_sweeps import TOLERANCE, make_sweep
from tests.support.made_walks import make_walk

OUTPUTS = {
    "report swept -o {}": "page.html",
    "merge swept {}": "merged.h5",
    "animate walk.h5 -o {}": "walk.gif",
    "animate walk.h5 --slow 4 -o {}": "walk.html",
    "plot walk.h5 -o {}": "folder",
    "plot swept -o {}": "folder",
    "schema -o {}": "schema.json",
    "sweep --new {}": "new.yaml",
}
"""Command → name of what it writes."""


def prepare() -> None:
    """A walk and a sweep to make something of."""
    make_walk().save("walk.h5")
    make_sweep(Path("swept"), TOLERANCE)


def content() -> dict[str, bytes | None]:
    """All that lies in the folder."""
    return {str(path): path.read_bytes() if path.is_file() else None for path in sorted(Path().rglob("*"))}


@contextmanager
def small_files(size: int) -> Iterator[None]:
    """No file of this process can grow beyond some bytes, which fails as on a full disk."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def assert_refused(answer: Answer, status: int, *words: str) -> None:
    """One line on stderr that has the words."""
    assert answer.status == status and answer.err.startswith("error: ") and answer.err.count("\n") == 1
    for word in words:
        assert word in answer.err


@pytest.mark.parametrize("line", OUTPUTS)
def test_a_pipe_in_the_way_is_refused(command: Command, line: str) -> None:
    """No command waits for a pipe or replaces it; status 2, one line, nothing written."""
    prepare()
    name = OUTPUTS[line]
    os.mkfifo(name)
    before = content()
    answer = command(*line.format(name).split())
    assert_refused(answer, 2, name)
    assert answer.out == "" and content() == before and Path(name).is_fifo()


@pytest.mark.parametrize("line", OUTPUTS)
def test_a_full_disk_gives_one_line(command: Command, line: str) -> None:
    """Status 1, what is wrong and what to do in one line, and no part of a file."""
    prepare()
    before = content()
    with small_files(1000):
        answer = command(*line.format(OUTPUTS[line]).split())
    assert_refused(answer, 1, OUTPUTS[line], "cannot be written (File too large); free disk space")
    assert answer.out == "" and content() | {"folder": None} == before | {"folder": None}


def test_a_sweep_goes_on_after_a_full_disk(command: Command) -> None:
    """A shard that has no room: status 1, one line, no part; then the same bytes as without."""
    Path("some.yaml").write_text(str(TINY | {"samples": 2}), encoding="utf-8")
    expected = command("sweep", "some.yaml", "-o", "whole")
    assert expected.status == 1, "the time limit of the walks"
    command("sweep", "some.yaml", "-o", "results")
    whole = {path.name: path.read_bytes() for path in Path("whole/shards").iterdir()}
    for path in Path("results/shards").iterdir():
        path.unlink()
    with small_files(min(map(len, whole.values())) - 1):
        answer = command("sweep", "some.yaml", "-o", "results")
    assert_refused(answer, 1, "results/shards/", "cannot be written (File too large); free disk space")
    assert list(Path("results/shards").iterdir()) == []
    assert command("sweep", "some.yaml", "-o", "results").out == expected.out
    assert {path.name: path.read_bytes() for path in Path("results/shards").iterdir()} == whole
