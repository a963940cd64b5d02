"""A sweep by keywords is that of a file; everything that is wrong is told at once; a bar where somebody looks."""

import inspect
import io
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import warpchain
from warpchain.inputs.validation import InputError
from warpchain.run.sweep_run import sweep_of_keywords
from warpchain.sweeps.plan import load_sweep

SHORT = {"start": "ellipse", "walk_limit": 0.02}

FILE = """
version: 1
name: speeds
seed: 0
preset: paper
samples: 4
sampler: latin_hypercube
scene: {start: ellipse, walk_limit: 0.02}
options: {tolerance: 1.0e-3}
parameters: {gravity: 9.8}
distributions: {all: fixed, floor_friction: {uniform: [0.1, 0.4]}}
record: {series: true}
grid: {links: [30, 40], frequency: {from: 5, to: 15, step: 5}}
same_samples_along: [links]
"""

KEYWORDS = {
    "grid": {"links": np.array([30, 40]), "frequency": np.linspace(5, 15, 3)},
    "samples": 4,
    "sampler": "latin_hypercube",
    "scene": SHORT,
    "options": {"tolerance": 1e-3},
    "parameters": {"gravity": 9.8},
    "distributions": {"all": "fixed", "floor_friction": {"uniform": (0.1, 0.4)}},
    "record": {"series": True},
    "same_samples_along": ("links",),
}


Terminal = type("Terminal", (io.StringIO,), {"isatty": lambda screen: True})
"""A text that is a terminal to those who ask."""


def refused(**keywords):
    """The lines with which a sweep is refused."""
    with pytest.raises(InputError) as caught:
        warpchain.sweep(**keywords)
    return str(caught.value).splitlines()


def test_keywords_say_what_a_file_says(tmp_path):
    """Name from the folder, seed 0, the preset of a walk: content and digest are those of the file."""
    path = tmp_path / "speeds.yaml"
    path.write_text(FILE, encoding="utf-8")
    of_file, of_keywords = load_sweep(path), sweep_of_keywords(KEYWORDS, tmp_path / "speeds")
    assert of_keywords.canonical() == of_file.canonical() and of_keywords.digest() == of_file.digest()
    named = sweep_of_keywords({**KEYWORDS, "name": "other", "seed": np.int64(3), "preset": "soft"}, "speeds")
    assert (named.name, named.seed, named.blocks[0].preset) == ("other", 3, "soft")


def test_settings_of_a_walk_are_those_of_a_sweep(tmp_path):
    """A list, an array, a range or a column of a table is an axis; other values hold for all walks."""
    words = {"n": pandas.Series([30, 40]), "frequency": {"from": 5, "to": 15, "step": 5}}
    others = {key: KEYWORDS[key] for key in ("samples", "sampler", "distributions", "record", "same_samples_along")}
    settings = {**words, **SHORT, "tolerance": np.float64(1e-3), "g": 9.8}
    assert sweep_of_keywords(others | settings, "speeds").digest() == sweep_of_keywords(KEYWORDS, "speeds").digest()
    presets = sweep_of_keywords({"samples": 1, "preset": ["soft", "paper"]}, "presets")
    assert presets.blocks[0].axes == {"preset": ("soft", "paper")}
    assert refused(samples=1, links=[60], grid={"links": [60]}, out=tmp_path) == [
        "links: given twice, also in grid; remove one"
    ]
    unsaid = dict.fromkeys(("frequency", "method", "tolerance", "name"))
    assert warpchain.sweep(links=30, samples=1, **SHORT, **unsaid, out=tmp_path / "unsaid").walk_count == 1
    assert refused(samples=1, linsk=60, out=tmp_path) == ["'linsk': unknown name; did you mean scene.links?"]


def test_notebooks_complete_the_names():
    """The signatures of walk, sweep and simulate name every field that they take."""
    for function, name, missing in (
        (warpchain.walk, "floor_friction", "soften"),
        (warpchain.sweep, "stop_time", "soften"),
        (warpchain.simulate, "skin", "links"),
    ):
        names = inspect.signature(function).parameters
        assert name in names and missing not in names and "settings" not in names


def test_signatures_are_readable():
    """Help shows types and defaults as a user writes them, in lines, without what checks the values."""
    text = str(inspect.signature(warpchain.walk))
    for shown in ("links: int = 60", "mu_fc: float = 0.27", "floor: Floor = 'flat'", "method: str = 'standard'"):
        assert shown in text
    assert "record_before: float | None = None" in text and "setup: Setup | None" in text
    for function in (warpchain.walk, warpchain.sweep, warpchain.simulate):
        text = str(inspect.signature(function))
        assert not re.search("FieldInfo|Annotated|Ellipsis|Undefined", text) and max(map(len, text.split("\n"))) <= 100
    names = inspect.signature(warpchain.simulate).parameters
    assert names["method"].default == "rkf78" and names["tolerance"].default == 1e-6


CALLS = """
import numpy as np

import warpchain

warpchain.walk(links=np.int64(60), mu_fc=0.3, tolerance=None, floor=[[0, 0], [1, 0.1]], start="spinning")
result = warpchain.sweep(links=[40, 60], frequency={"from": 5, "to": 10, "step": 1}, samples=3, out="folder")
print(result.dx, result.phase_drawn, result.blocks["a"].status, result.shape)
warpchain.walk(frequncy=15)
warpchain.walk(links="many")
warpchain.sweep(sampels=3, out="folder")
warpchain.simulate("paper", soften_pile=True)
print(result.dxx, result.blocks["a"].dxx, warpchain.load_walk("walk.h5").dxx)
"""
"""The lines from the ninth on have mistakes."""


@pytest.mark.slow
def test_type_checkers_know_the_keywords(tmp_path):
    """mypy refuses unknown keywords, wrong types and unknown columns, and takes what walk and sweep take."""
    pytest.importorskip("mypy")
    (tmp_path / "calls.py").write_text(CALLS, encoding="utf-8")
    root = Path(__file__).parents[2]
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--config-file",
        root / "pyproject.toml",
        tmp_path / "calls.py",
    ]
    found = subprocess.run(command, cwd=root, capture_output=True, text=True)
    errors = re.findall(r"calls\.py:(\d+): error: .*\[([\w-]+)\]", found.stdout)
    expected = [
        ("9", "call-arg"),
        ("10", "arg-type"),
        ("11", "call-arg"),
        ("12", "call-arg"),
        *[("13", "attr-defined")] * 3,
    ]
    assert errors == expected, found.stdout + found.stderr


def test_parameter_sets(tmp_path):
    """A table of sets is one axis beside the grid; its columns go with the results, and with what was drawn."""
    table = pandas.DataFrame({"mu_fc": [0.1, 0.3, 0.2], "phase": [0.0, 0.5, 0.25]})
    result = warpchain.sweep(points=table, links=[30, 32], samples=2, preset="soft", **SHORT, out=tmp_path / "sets")
    assert result.dims == ("point", "links", "sample") and result.shape == (3, 2, 2)
    design = result.design()
    assert list(design.quantity.values)[:2] == ["floor_friction", "phase"]
    assert (design.sel(quantity="phase").values == table["phase"].values[:, None, None]).all()
    assert (design.sel(quantity="inner_mass").values == result.inner_mass_drawn).all()
    words = warpchain.sweep(
        points={"method": ["explicit", "explicit"]}, links=30, samples=1, **SHORT, out=tmp_path / "words"
    )
    with pytest.raises(InputError, match=r"method: its values are words, .*; use to_xarray"):
        words.design()
    data = result.to_xarray()
    assert data.floor_friction.dims == ("point",) and (data.floor_friction == table["mu_fc"]).all()
    for place, index in np.ndenumerate(result.index):
        setup = result.origin.walk(int(index)).setup
        assert setup.parameters.floor_friction == table["mu_fc"][place[0]]
    lines = refused(points={"mu_fc": [0.1, 0.2], "R": [0.05]}, mu_fc=0.2, samples=1, out=tmp_path)
    assert lines == ["sweep.points.floor_friction: given twice, also in parameters; remove one"]
    lines = refused(points={"mu_fc": [0.1, 0.2], "R": [0.05]}, samples=1, out=tmp_path)
    assert lines[0].startswith("sweep.points.sprocket_radius: expected 2 values, as floor_friction has, got 1")


def test_all_errors_are_told_at_once(tmp_path):
    """One line for each value, with its place in a list, in the order of the keywords."""
    lines = refused(
        grid={"links": [30, 3, 40, "x"], "frequenzy": [1.0]},
        samples=0,
        scene={"clearance": -1.0},
        distributions={"floor_friction": {"uniform": [0.4, 0.1]}},
        record={"series": 3},
        workers=0,
    )
    assert {line.partition(": ")[0] for line in lines} == {
        "out",
        "workers",
        "sweep.grid.links[1]",
        "sweep.grid.links[3]",
        "sweep.grid.frequenzy",
        "sweep.samples",
        "sweep.scene.clearance",
        "sweep.distributions.floor_friction.uniform[1]",
        "sweep.record.series",
    }


@pytest.mark.parametrize(
    ("keywords", "begin"),
    [
        ({}, "sweep.samples: missing"),
        ({"samples": 1, "grid": {"links": [28]}}, "sweep.grid.links[0]: 28 links do not reach around"),
        ({"samples": 1, "same_samples_along": ["links"]}, "sweep.same_samples_along: 'links' is not an axis"),
        ({"preset": "soft", "links": 60, "source": {"version": 1}}, "preset, links: not possible with a source"),
        ({"samples": 1, "start": ...}, "sweep.scene.start: expected"),
        ({"samples": 1, "part": "3/2"}, "part: expected k/N"),
        ({"samples": 1, "grid": {"device": ["cpu", "cuda"]}, "device": "cpu"}, "sweep.grid: method is "),
    ],
    ids=str,
)
def test_what_only_the_whole_shows_is_told(keywords, begin, tmp_path):
    """Values that contradict one another, and what is missing, are refused as in a file."""
    assert [line for line in refused(**{"out": tmp_path, **keywords}) if line.startswith(begin)]


def test_a_terminal_shows_a_bar(tmp_path, monkeypatch):
    """Done walks and statuses on standard error, unless that is turned off or the caller is told of progress."""
    keywords = {"grid": {"links": [30]}, "samples": 1, "scene": SHORT, "preset": "soft"}
    for quiet in ({"progress": False}, {"on_progress": lambda progress: None}):
        screen = Terminal()
        monkeypatch.setattr(sys, "stderr", screen)
        warpchain.sweep(**keywords, out=tmp_path / str(*quiet), **quiet)
        assert screen.getvalue() == ""
    warpchain.sweep(**keywords, out=tmp_path / "shown")
    text = re.sub(r"\x1b\[[\d?;]*\w", "", screen.getvalue())
    assert "1 of 1 walks" in text and "1 time_limit" in text


@pytest.mark.parametrize("compiled", [0, 2])
def test_compiling_is_told_once_where_output_is_piped(compiled, tmp_path, monkeypatch, capsys):
    """A walk and a sweep say that they wait for kernels if any are compiled, and nothing if all are there."""

    def load(wanted, on_compile):
        list(wanted)
        for _ in range(compiled):
            on_compile()

    monkeypatch.setattr("warpchain.walks.scheduler.load_kernels", load)
    text = "compiling kernels for this machine"
    warpchain.sweep(grid={"links": [30]}, samples=1, scene=SHORT, preset="soft", out=tmp_path / "shown")
    assert capsys.readouterr().err.count(text) == min(compiled, 1)
    warpchain.walk(links=30, preset="soft", **SHORT)
    assert capsys.readouterr().err.count(text) == min(compiled, 1)
    warpchain.walk(links=30, preset="soft", **SHORT, on_progress=lambda progress: None)
    assert capsys.readouterr().err == ""


def test_a_notebook_shows_a_line(tmp_path, monkeypatch):
    """In the output of the cell, of sweeps and of walks, which are silent in a terminal."""
    screen = type("OutStream", (io.StringIO,), {"__module__": "ipykernel.iostream"})()
    monkeypatch.setattr(sys, "stdout", screen)
    warpchain.sweep(grid={"links": [30]}, samples=1, scene=SHORT, preset="soft", out=tmp_path / "shown")
    lines = screen.getvalue().split("\r")
    assert "[##########] 1 of 1 walks" in lines[-1] and "1 time_limit" in lines[-1]
    warpchain.walk(links=30, preset="soft", **SHORT)
    assert "steps" in screen.getvalue().splitlines()[-1]
    monkeypatch.setattr(sys, "stdout", Terminal())
    monkeypatch.setattr(sys, "stderr", Terminal())
    warpchain.walk(links=30, preset="soft", **SHORT)
    assert sys.stdout.getvalue() == sys.stderr.getvalue() == ""
