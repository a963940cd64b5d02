"""The sweeps of the studies."""

import math
from pathlib import Path

import pytest

from tests.docs.code_blocks import ROOT
from warpchain.sweeps.plan import load_sweep


def path_of(name: str) -> Path:
    """The file of a sweep, in whichever study it is."""
    (path,) = ROOT.glob(f"studies/*/sweeps/{name}.yaml")
    return path


@pytest.mark.parametrize(
    ("name", "shapes"),
    [
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
        ("slopes", {"slope": (2, 3, 13, 100), "friction": (4, 7, 50), "stairs": (2, 3, 100)}),
        ("floor_friction", {"spinning": (5, 3, 7, 100), "rest": (5, 3, 7, 100)}),
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
        *((name, {"rest": (4, 4, 400), "ellipse": (4, 4, 400)}) for name in ("defaults", "finer", "soft")),
        ("reference", {"main": (4, 200)}),
        ("reference_rest", {"main": (4, 200)}),
    ],
)
def test_sweeps_of_studies(name: str, shapes: dict[str, tuple[int, ...]]) -> None:
    """Each file loads, is named as its file and has the walks that it promises."""
    sweep = load_sweep(path_of(name))
    assert sweep.name == name
    assert {block.name: block.shape for block in sweep.blocks} == shapes
    assert sweep.walk_count == sum(math.prod(shape) for shape in shapes.values())
    stiff = {"steadiness": ["paper", "paper_undamped"], "unsoftened_hold": list(shapes)}
    stiff |= {"paper_claims": ["start"]}
    stiff |= {every: list(shapes) for every in ("paper_joints", "defaults", "finer", "reference", "reference_rest")}
    for block in sweep.blocks:
        preset = "paper" if block.name in stiff.get(name, []) else "soft"
        for index in {0, math.prod(block.shape) // 2, math.prod(block.shape) - 1}:
            assert sweep.planned(block.indices.flat[index]).setup.preset == preset


@pytest.mark.parametrize("name", ["paper_claims", "paper_joints", "paper_tolerance"])
def test_sweeps_of_the_paper_vary_one_quantity_at_a_time(name: str) -> None:
    """Each block has the paper's 30 cells; walks along its further axis share all but what stands there."""
    sweep = load_sweep(path_of(name))
    for block in sweep.blocks:
        links, frequency, *others = block.axes
        assert (links, frequency) == ("links", "frequency")
        assert block.axes["links"] == (60, 90, 120, 150, 180) and block.axes["frequency"] == (5, 10, 15, 20, 25, 30)
        for other in others:
            values = block.axes[other]
            assert other not in block.drawn and other in sweep.same_samples_along
            first = 17 * len(values)
            cells = block.indices[..., 3].ravel()[first : first + len(values)]
            setups = [sweep.planned(index).setup for index in cells]
            flat = [
                {**setup.scene.model_dump(), **setup.options.model_dump(), **setup.parameters.model_dump()}
                for setup in setups
            ]
            assert [each[other] for each in flat] == list(values)
            assert all({**each, other: values[0]} == flat[0] for each in flat)
