"""The sweeps that come with the project."""

import math
import re
from pathlib import Path

import pytest
import yaml

from tests.support.sweep_content import TABLE_1
from warpchain.inputs.distributions import Uniform
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.validation import InputError
from warpchain.inputs.yaml_files import Loader, read_yaml
from warpchain.sweeps.plan import load_sweep
from warpchain.sweeps.shipped import shipped_sweeps, write_new_sweep
from warpchain.sweeps.sweep_file import _TOP_KEYS

SWEEPS = Path(__file__).parents[2] / "sweeps"


PLANAR = [name for name in Parameters.model_fields if name != "half_width"]
"""Parameters that matter to a chain whose plane is fixed."""


@pytest.mark.parametrize(
    ("name", "shapes"),
    [
        ("quickstart", {"main": (2, 3, 4)}),
        ("figure6", {"rest": (5, 6, 12), "ellipse": (2, 6, 12)}),
        ("tolerance", {"main": (2, 2, 2, 12)}),
        ("montecarlo", {"main": (7, 8, 1800)}),
        ("phase_diagram", {"main": (22, 20, 100)}),
        (
            "scaling",
            {"sprocket_radius": (4, 4, 3, 16), "gravity": (4, 4, 3, 16)}
            | dict.fromkeys(("links_of_9_mm", "links_of_18_mm", "links_of_25_mm"), (4, 3, 16)),
        ),
        ("kink", {"main": (5, 6, 1)}),
        (
            "steadiness",
            dict.fromkeys(("spinning", "rest", "undamped"), (5, 3, 400))
            | {"held_on": (3, 3, 6, 200), "paper": (2, 1, 400), "paper_undamped": (2, 1, 400)},
        ),
        ("unsoftened_hold", {"softened": (400,), "own_joints": (400,)}),
        ("softened_drive", {"main": (4, 3, 2, 200)}),
        ("floor_friction", {"spinning": (5, 3, 7, 100), "rest": (5, 3, 7, 100)}),
        ("tilt", {"fixed": (5, 5, 200), "tilted": (5, 5, 4, 200)}),
        (
            "paper_claims",
            {"start": (5, 6, 3, 24)}
            | dict.fromkeys(("release_only", "parameters_only"), (5, 6, 24))
            | {"link_length": (5, 6, 4, 24), "floor_restitution": (5, 6, 4, 24), "gravity": (5, 6, 3, 24)}
            | {"floor_friction": (5, 6, 6, 24), "sprocket_friction": (5, 6, 2, 16), "phase": (5, 6, 4, 16)}
            | dict.fromkeys(("sprocket_radius", "inner_mass", "outer_mass", "inner_inertia"), (5, 6, 3, 16))
            | dict.fromkeys(("outer_inertia", "viscous_friction", "coulomb_friction", "clearance"), (5, 6, 3, 16))
            | dict.fromkeys(("chain_restitution", "chain_friction", "sprocket_restitution"), (5, 6, 3, 16))
            | {"tangential_restitution": (5, 6, 3, 16)},
        ),
        ("paper_joints", dict.fromkeys(("joint_stiffness", "joint_damping", "friction_smoothing"), (5, 6, 3, 8))),
        ("paper_tolerance", {"main": (5, 6, 2, 12)}),
        ("paper_shapes", {"main": (5, 6, 4)}),
        (
            "sensitivity",
            {"ranges": (64 * 17,), "measured": (32 * 14,)} | {name: (3, 8) for name in PLANAR},
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
    stiff = {"figure6": list(shapes), "steadiness": ["paper", "paper_undamped"], "unsoftened_hold": list(shapes)}
    stiff |= {"quickstart": list(shapes), "tilt": list(shapes), "paper_claims": ["start"], "paper_joints": list(shapes)}
    for block in sweep.blocks:
        preset = "paper" if block.name in stiff.get(name, []) else "soft"
        walks = math.prod(block.shape)
        for index in {0, walks // 2, walks - 1}:
            assert sweep.planned(block.first + index).setup.preset == preset


def test_every_shipped_sweep_is_tested() -> None:
    """No other file is in the folder."""
    names = {path.stem for path in SWEEPS.iterdir()}
    assert names == {
        *("quickstart", "figure6", "tolerance", "montecarlo", "sensitivity", "kink", "tilt"),
        *("steadiness", "unsoftened_hold", "softened_drive", "floor_friction", "phase_diagram", "scaling"),
        *("paper_claims", "paper_joints", "paper_tolerance", "paper_shapes"),
    }


def test_shipped_sweeps_have_bare_names() -> None:
    """The package finds every one of them by its name, whatever the folder; what has a suffix is a path."""
    assert shipped_sweeps() == sorted(path.stem for path in SWEEPS.iterdir())
    for name in shipped_sweeps():
        assert load_sweep(name).digest() == load_sweep(SWEEPS / f"{name}.yaml").digest()
    for missing in ("figure", "figure6.yaml", "sweeps/figure"):
        with pytest.raises(InputError, match=f"^{missing}: "):
            load_sweep(missing)


def test_the_examples_of_a_new_sweep_are_possible(tmp_path: Path) -> None:
    """Each example that a new sweep has as a comment can be taken into the file; together they name every key."""
    path = tmp_path / "new.yaml"
    write_new_sweep(path)
    text = path.read_text(encoding="utf-8")
    examples = re.findall(r"(?:^#(?=\w).*\n(?:^#  .*\n)*)", text, re.MULTILINE)
    keys = set(read_yaml(path))
    for example in examples:
        (key, value), *_ = yaml.load(re.sub("^#", "", example, flags=re.MULTILINE), Loader).items()
        changed = read_yaml(path) | {key: value}
        if key == "blocks":
            del changed["grid"]
        assert load_sweep(changed).digest() != load_sweep(path).digest(), key
        keys.add(key)
    assert keys == set(_TOP_KEYS)


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
    for name in PLANAR:
        quantity = Parameters.quantities()[name]
        block = by_name[name]
        assert block.axes.keys() == {name} and block.drawn == ("phase", "clearance")
        assert getattr(preset("soft"), name) in block.axes[name]
        walks = [sweep.planned(block.first + 8 * place) for place in range(3)]
        assert len({walk.setup.scene for walk in walks}) == 1
        assert [getattr(walk.setup.parameters, name) for walk in walks] == list(block.axes[name])
        if name in by_name["ranges"].drawn:
            ends = by_name["ranges"].distributions[name]
            assert isinstance(ends, Uniform)
            assert (ends.lower, ends.upper) == pytest.approx((0.8 * quantity.value, 1.2 * quantity.value))


def test_steadiness_holds_loops_under_their_own_loads_for_comparison() -> None:
    """Its undamped blocks, and that of `unsoftened_hold`, neither multiply loads nor look at the shape before 30 s."""
    steadiness, unsoftened = (load_sweep(SWEEPS / f"{name}.yaml") for name in ("steadiness", "unsoftened_hold"))
    undamped = {"undamped", "paper_undamped", "own_joints"}
    for sweep in (steadiness, unsoftened):
        for block in sweep.blocks:
            setup = sweep.planned(block.first).setup
            scene = setup.scene
            if block.name in undamped:
                held = (scene.load_factor, scene.steady_time, scene.steady_tolerance, scene.further_hold)
                assert held == (1.0, 0.0, 1.0, 30.0)
                assert scene.hold_limit >= 30
            else:
                assert scene.load_factor is None and scene.steady_time is None
            assert setup.options.soften_drive == (block.name != "own_joints")
    held_on = next(block for block in steadiness.blocks if block.name == "held_on")
    assert held_on.axes["further_hold"] == (0.0, 1.0, 2.0, 5.0, 10.0, 20.0)


def test_floor_friction_is_that_of_the_grid() -> None:
    """Walks have the frictions of the floor that the grid says; restitution and all else are drawn."""
    sweep = load_sweep(SWEEPS / "floor_friction.yaml")
    frictions = (0.05, 0.1, 0.15, 0.2, 0.27, 0.4, 0.6)
    for block in sweep.blocks:
        for sample in (0, 7):
            setups = [sweep.planned(block.first + 100 * place + sample).setup for place in range(7)]
            assert tuple(setup.parameters.floor_friction for setup in setups) == frictions
        assert setups[0].scene.start == block.name
        assert "floor_friction" not in block.drawn and "floor_restitution" in block.drawn


def test_softened_drive_repeats_the_same_samples() -> None:
    """In `softened_drive` walks that differ in whether the drive is softened share everything else."""
    sweep = load_sweep(SWEEPS / "softened_drive.yaml")
    for cell in range(12):
        for sample in (0, 199):
            soft, stiff = (sweep.planned(400 * cell + 200 * place + sample).setup for place in (0, 1))
            assert (soft.options.soften_drive, stiff.options.soften_drive) == (True, False)
            assert (soft.scene, soft.parameters) == (stiff.scene, stiff.parameters)


@pytest.mark.parametrize("name", ["paper_claims", "paper_joints", "paper_tolerance"])
def test_sweeps_of_the_paper_vary_one_quantity_at_a_time(name: str) -> None:
    """Each block has the paper's 30 cells; walks along its further axis share all but what stands there."""
    sweep = load_sweep(SWEEPS / f"{name}.yaml")
    for block in sweep.blocks:
        links, frequency, *others = block.axes
        assert (links, frequency) == ("links", "frequency")
        assert block.axes["links"] == (60, 90, 120, 150, 180) and block.axes["frequency"] == (5, 10, 15, 20, 25, 30)
        for other in others:
            values, samples = block.axes[other], block.samples
            assert other not in block.drawn and other in sweep.same_samples_along
            first = block.first + 17 * len(values) * samples + 3
            setups = [sweep.planned(first + place * samples).setup for place in range(len(values))]
            flat = [
                {**setup.scene.model_dump(), **setup.options.model_dump(), **setup.parameters.model_dump()}
                for setup in setups
            ]
            assert [each[other] for each in flat] == list(values)
            assert all({**each, other: values[0]} == flat[0] for each in flat)
