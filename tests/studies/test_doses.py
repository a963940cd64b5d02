"""The dose and response of the drag on waves: the release of a walk is found again, its tables are of the file."""

import numpy as np
import pytest

import warpchain
from studies.common import with_tables
from studies.waves import doses, drag


def test_a_release_is_that_of_its_walk() -> None:
    """From the state that is found, a chain moves as its walk does, to 0.1 mm in 20 ms."""
    position, velocity, numbers = drag.released(60, 15.0, 7)
    walk = warpchain.walk(
        links=60, frequency=15.0, preset="soft", start="spinning", seed=7, frame_interval=1e-3, walk_limit=0.02
    )
    parameters = warpchain.Parameters(**dict(zip(drag.PARAMETERS, map(float, numbers), strict=True)))
    chains = warpchain.Chains([parameters], position[None], velocity[None])
    chains.run(float(walk.frame_time[-1]))
    centers = 0.5 * (walk.frame_joints[-1] + np.roll(walk.frame_joints[-1], 1, axis=0))
    assert np.abs(chains.motions()[0][0, :, :2] - centers).max() < 1e-4


def test_a_drag_acts_when_it_should(monkeypatch: pytest.MonkeyPatch) -> None:
    """In flight and in impacts add up to always, but for chaos; none at all is dragged for no time."""
    monkeypatch.setattr(drag, "LATEST", 0.2)
    monkeypatch.setattr(drag, "END", 0.21)
    whole, flight, impacts = (drag.Variant(50.0, *when) for when in ((True, True), (True, False), (False, True)))
    monkeypatch.setattr(drag, "VARIANTS", (drag.Variant(0.0), whole, flight, impacts))
    state = [each[None] for each in drag.released(60, 15.0, 7)]
    found = drag.Loops(*state, "cpu").walk()["dragged_for"][:, 0]
    assert found[0] == 0 and found[1] == pytest.approx(0.2)
    assert 0.02 < min(found[2:]) and found[2] + found[3] == pytest.approx(0.2, abs=0.05)


def test_the_page_has_the_tables_of_the_file() -> None:
    """They are rendered from the committed rows."""
    page = (doses.FOLDER / "README.md").read_text(encoding="utf-8")
    assert with_tables(page, doses.tables(doses.read())) == page, "out of date; run python -m studies.waves.doses"
