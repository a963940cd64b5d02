"""The sweeps that come with the project."""

import math
from pathlib import Path

import pytest

from tests.sweep_content import TABLE_1
from warpchain.parameters import Parameters, preset
from warpchain.planning import load_sweep
from warpchain.sampling import Uniform

SWEEPS = Path(__file__).parents[1] / "sweeps"


@pytest.mark.parametrize(
    ("name", "shapes"),
    [
        ("quickstart", {"main": (2, 3, 4)}),
        ("figure6", {"rest": (5, 6, 12), "ellipse": (2, 6, 12)}),
        ("tolerance", {"main": (2, 2, 2, 12)}),
        ("montecarlo", {"main": (7, 8, 1800)}),
        ("kink", {"main": (5, 6, 1)}),
        ("steadiness", {"default": (2, 2, 16), "held": (2, 2, 16)}),
        (
            "sensitivity",
            {"ranges": (64 * 17,), "measured": (32 * 14,)} | {name: (3, 8) for name in Parameters.model_fields},
        ),
    ],
)
def test_shipped_sweeps(name: str, shapes: dict[str, tuple[int, ...]]) -> None:
    """Each shipped file loads, is named as its file and has the walks that it promises."""
    sweep = load_sweep(SWEEPS / f"{name}.yaml")
    assert sweep.name == name
    assert {block.name: block.shape for block in sweep.blocks} == shapes
    walks = sum(math.prod(shape) for shape in shapes.values())
    assert sweep.walk_count == walks
    for index in {0, walks // 2, walks - 1}:
        assert sweep.planned(index).setup.preset == ("paper" if name == "figure6" else "soft")


def test_every_shipped_sweep_is_tested() -> None:
    """No other file is in the folder."""
    names = {path.stem for path in SWEEPS.iterdir()}
    assert names == {"quickstart", "figure6", "tolerance", "montecarlo", "sensitivity", "steadiness", "kink"}


def test_figure6_follows_the_paper() -> None:
    """Figure 6: n = 60 … 180, ν = 5 … 30 Hz, 12 samples; rest everywhere, ellipses for n = 150 and 180."""
    rest, ellipse = load_sweep(SWEEPS / "figure6.yaml").blocks
    assert rest.axes == {"links": (60, 90, 120, 150, 180), "frequency": (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)}
    assert ellipse.axes == {"links": (150, 180), "frequency": rest.axes["frequency"]}
    for block, start in ((rest, "rest"), (ellipse, "ellipse")):
        assert load_sweep(SWEEPS / "figure6.yaml").planned(block.first).setup.scene.start == start
        assert block.drawn == (*TABLE_1, "phase", "clearance")


def test_tolerance_repeats_the_same_samples() -> None:
    """In `tolerance` walks that differ in the tolerance alone share everything else."""
    sweep = load_sweep(SWEEPS / "tolerance.yaml")
    for cell in range(4):
        for sample in (0, 11):
            loose, tight = (sweep.planned(24 * cell + 12 * place + sample).setup for place in (0, 1))
            assert (loose.options.tolerance, tight.options.tolerance) == (1e-6, 1e-9)
            assert (loose.scene, loose.parameters) == (tight.scene, tight.parameters)


def test_sensitivity_varies_every_quantity() -> None:
    """In `sensitivity` each parameter has a block around its Table-1 value with the same releases at every value."""
    sweep = load_sweep(SWEEPS / "sensitivity.yaml")
    by_name = {block.name: block for block in sweep.blocks}
    assert by_name["measured"].drawn == (*TABLE_1, "phase", "clearance")
    assert set(by_name["ranges"].drawn) == {
        name for name, q in Parameters.quantities().items() if q.source in ("measured", "looked up")
    } | {"phase", "clearance"}
    for name, quantity in Parameters.quantities().items():
        block = by_name[name]
        assert block.axes.keys() == {name} and block.drawn == ("phase", "clearance")
        assert getattr(preset("soft"), name) in block.axes[name]
        walks = [sweep.planned(block.first + 8 * place) for place in range(3)]
        assert len({walk.setup.scene for walk in walks}) == 1
        assert [getattr(walk.setup.parameters, name) for walk in walks] == list(block.axes[name])
        if name in by_name["ranges"].drawn:
            ends = by_name["ranges"].plan.distributions[name]
            assert isinstance(ends, Uniform)
            assert (ends.lower, ends.upper) == pytest.approx((0.8 * quantity.value, 1.2 * quantity.value))
