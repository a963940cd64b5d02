"""Sizes of sweeps are checked as they are declared, before memory is taken."""

import time
from typing import Any

import pytest

from tests.support.sweep_content import blocks, content
from warpchain.inputs.parameters import Parameters
from warpchain.inputs.validation import InputError
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.sizes import CELL_LIMIT, WALK_LIMIT

LONG = {"from": 1e-3, "to": 1e-2, "count": 10_000}
FULL = {"frequency": {"from": 1, "to": 10_000, "step": 1}}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (content(samples=2**30), f"sweep.samples: 4294967296 walks, at most {WALK_LIMIT} are possible"),
        (content(samples=10**400), f"sweep.samples: endless walks, at most {WALK_LIMIT} are possible"),
        (content(samples=2**26, sampler="sobol"), "sweep.samples: 268435456 walks, at most"),
        (content(samples=2**21, sampler="sobol"), "sweep.samples: 2097152 designed samples of 12 numbers each are"),
        (content(samples=2**20, sampler="saltelli"), "sweep.samples: 1048576 designed samples of 24 numbers each"),
        (content(samples=2**17, sampler="saltelli", grid=FULL | {"links": [60]}), "sweep.samples: 1310720000 walks"),
        (content(samples=2**19, sampler="saltelli"), f"sweep.samples: 29360128 walks, at most {WALK_LIMIT}"),
        (
            content(grid=dict.fromkeys(list(Parameters.model_fields)[:12], LONG)),
            f"sweep.grid: 1e+48 cells, at most {CELL_LIMIT} are possible; give fewer values",
        ),
        (blocks(*[{"grid": FULL}] * 5000), f"sweep.blocks[10].grid: 110000 cells, at most {CELL_LIMIT}"),
        (content(record={"series": {"interval": 1e300}}), "sweep.record.series.interval: 1e+300 s is too long"),
        (content(record={"series": True, "frames": {"before": 1e300}}), "sweep.record.frames.before: 1e+300 s is"),
        (content(record={"series": {"interval": 5e-324}}), "sweep.record.series.interval: 5e-324 s is no whole"),
    ],
)
def test_what_is_too_large_is_refused_at_once(given: dict[str, Any], message: str) -> None:
    """Walks, cells, designs and intervals; with the number and the limit, within a second."""
    began = time.process_time()
    with pytest.raises(InputError) as caught:
        load_sweep(given)
    assert str(caught.value).startswith(message)
    assert time.process_time() - began < 1


def test_millions_of_walks_are_free() -> None:
    """The limits leave sweeps of 10⁷ walks, and designs of a million samples."""
    assert load_sweep(content(samples=2**22)).walk_count == WALK_LIMIT
    load_sweep(content(grid={"links": [60]}, samples=2**20, sampler="sobol"))


@pytest.mark.parametrize("count", ["9", None, -1, True, float("nan"), [3], 2.5])
def test_what_is_declared_wrongly_is_refused_by_its_own_check(count: object) -> None:
    """The count of sizes passes over what is no number; the value is then refused where it is read."""
    for given in (
        content(grid={"frequency": {"from": 1, "to": 2, "count": count}}),
        content(grid={"frequency": {"from": 1, "to": 2, "step": count}}),
        content(grid={"frequency": {"from": count, "to": 2, "step": 0.1}}),
        content(samples=count),
    ):
        with pytest.raises(InputError, match=r"sweep\.(grid\.frequency|samples)"):
            load_sweep(given)
