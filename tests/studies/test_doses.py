"""The dose and response of the drag on waves: the release of a walk is found again, its tables are of the file."""

import numpy as np
import pytest

import warpchain
from studies.common import with_tables
from studies.waves import directions, doses, drag
from studies.waves.wave_drag import inertia_of


def test_a_release_is_that_of_its_walk() -> None:
    """From the state that is found, a chain moves as its walk does, to 0.1 mm in 20 ms."""
    position, velocity, parameters = drag.released(60, 15.0, 7)
    walk = warpchain.walk(
        links=60, frequency=15.0, preset="soft", start="spinning", seed=7, frame_interval=1e-3, walk_limit=0.02
    )
    chains = warpchain.Chains([parameters], position[None], velocity[None])
    chains.run(float(walk.frame_time[-1]))
    centers = 0.5 * (walk.frame_joints[-1] + np.roll(walk.frame_joints[-1], 1, axis=0))
    assert np.abs(chains.motions()[0][0, :, :2] - centers).max() < 1e-4


def test_a_drag_acts_when_it_should(monkeypatch: pytest.MonkeyPatch) -> None:
    """In flight and in impacts add up to always, but for chaos; none at all is dragged for no time."""
    monkeypatch.setattr(drag, "LATEST", 0.2)
    monkeypatch.setattr(drag, "END", 0.21)
    monkeypatch.setattr(drag, "VARIANTS", (("always", 0.0), *((when, 50.0) for when in drag.WHEN)))
    position, velocity, parameters = drag.released(60, 15.0, 7)
    found = drag.walked(position[None], velocity[None], [parameters], "cpu")["dragged_for"][:, 0]
    assert found[0] == 0 and found[1] == pytest.approx(0.2)
    assert 0.02 < min(found[2:]) and found[2] + found[3] == pytest.approx(0.2, abs=0.05)


def test_the_page_has_the_tables_of_the_files() -> None:
    """They are rendered from the committed rows."""
    page = (doses.FOLDER / "README.md").read_text(encoding="utf-8")
    tables = doses.tables() | {"directions": directions.summary()}
    assert with_tables(page, tables) == page, "out of date; run python -m studies.waves.doses, and directions"


@pytest.mark.parametrize(("way", "slope"), [("slow", 305.0), ("fast", -181.0)])
def test_a_wave_runs_its_way(way: str, slope: float) -> None:
    """Five waves around 60 links bend the loop alike and run against the links, or with them; momentum stays."""
    position, velocity, parameters = drag.released(60, 20.0, 7)
    times, angles = np.linspace(0, 0.03, 61), []
    states = [(position, velocity), directions.with_wave(position, velocity, parameters, way, 0.05, 0.3)]
    masses = inertia_of(60, parameters)[:, 0]
    momenta = [masses @ each[1][:, :2] for each in states]
    assert np.allclose(*momenta, rtol=0, atol=1e-9)
    for where, speed in states:
        where[:, 1] += 1.0  # high above the floor
        found = warpchain.simulate(parameters, where, speed, 0.03, times=times, method="hybrid", gravity=False)
        angles.append(found.position[:, :, 2])
    mode = np.fft.fft(angles[1] - angles[0], axis=1)[:, 5]
    assert abs(mode[0]) == pytest.approx(0.05 * 30, rel=0.05)
    assert np.polyfit(times, np.unwrap(np.angle(mode)), 1)[0] == pytest.approx(slope, rel=0.05)
