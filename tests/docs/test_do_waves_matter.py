"""The experiment of waves.md: its table is that of the committed numbers, and its walks differ in what they should."""

import sys
from collections.abc import Iterator
from types import ModuleType

import pytest

from tests.docs.code_blocks import ROOT
from warpchain.status import Status


@pytest.fixture(scope="module")
def experiment() -> Iterator[ModuleType]:
    """The script."""
    sys.path.insert(0, str(ROOT / "docs"))
    import do_waves_matter

    yield do_waves_matter
    sys.path.remove(str(ROOT / "docs"))


def test_the_page_has_the_table_of_the_committed_numbers(experiment: ModuleType) -> None:
    """Both come from one command."""
    page = experiment.PAGE.read_text(encoding="utf-8")
    table = experiment.text(experiment.read(experiment.RESULTS))
    assert experiment.with_tables(page, {"matter": table}) == page


def test_walks_of_a_sample_share_their_release_and_the_drag_takes_their_waves(experiment: ModuleType) -> None:
    """One sample of a short slow chain, all variants, to rest."""
    cells = ((40, 10.0),)
    walkers = experiment.walk_all(cells, 1, "cpu")
    outcomes = [walker.run.outcome() for walker in walkers]
    assert [outcome["status"] for outcome in outcomes] == [Status.AT_REST] * len(experiment.VARIANTS)
    assert len({outcome["hold_time"] for outcome in outcomes}) == 1
    assert len({walker.energies[0] for walker in walkers}) == 1
    rows = {row["variant"]: row for row in experiment.table(cells, 1, walkers)}
    shares = {name: float(str(row["wave_energy_percent"])) for name, row in rows.items()}
    assert shares["drag 50/s"] < shares["drag 50/s on waves of up to 12 links"] < shares["plain"]
    assert rows["plain"]["change_percent"] == 0.0
    assert rows["drag 50/s"]["change_percent"] != 0.0
