"""NumPy's numbers, arrays, ranges and tuples mean what Python's numbers and lists mean, to the bit."""

import numpy as np
import pytest

import warpchain
from tests.oracle_model.circular_loop import circular_loop
from warpchain.inputs.sections import SECTION_OF
from warpchain.inputs.validation import InputError, plain
from warpchain.run.single_walk import setup_walk
from warpchain.sweeps.plan import load_sweep

PLAIN = {"version": 1, "name": "grid", "seed": 3, "preset": "soft", "samples": 2}


def of_numpy(value):
    """A value of a setting in NumPy's type."""
    return {bool: np.bool_, int: np.int32, float: np.float64, str: np.str_}[type(value)](value)


def test_every_setting_takes_a_numpy_value():
    """Each field of parameters, scene and options has the same value, and the same type, either way."""
    setup = setup_walk("soft", {"load_factor": 2.0, "steady_time": 0.5, "settle_time": 0.2, "distance_limit": 9.0}, 5)
    given = {**setup.parameters.model_dump(), **dict(setup.scene), **setup.options.model_dump()}
    assert given.keys() == SECTION_OF.keys() and None not in given.values()
    again = setup_walk("soft", {name: of_numpy(value) for name, value in given.items()}, None)
    assert again == setup
    for model in (again.parameters, again.scene, again.options):
        for name, value in model:
            assert type(value) is type(given[name]), name


@pytest.mark.parametrize(
    ("of_numpy", "of_python"),
    [
        (np.float32(0.1), float(np.float32(0.1))),
        (np.longdouble(0.5), 0.5),
        (np.array(3), 3),
        (range(4, 10, 2), [4, 6, 8]),
        ((1, np.uint8(2)), [1, 2]),
        (np.array([[True]]), [[True]]),
        ({"a": [np.float64(1.0)]}, {"a": [1.0]}),
        (None, None),
        ("12", "12"),
    ],
    ids=repr,
)
def test_plain_values(of_numpy, of_python):
    """A value becomes that of Python; its type, too."""
    assert repr(plain(of_numpy)) == repr(of_python)


def test_a_sweep_of_arrays_is_that_of_lists():
    """Grids, scenes, distributions and records: one digest."""
    arrays = load_sweep(
        {
            **PLAIN,
            "seed": np.int64(3),
            "samples": np.uint16(2),
            "grid": {"links": np.arange(30, 60, 10), "frequency": np.linspace(5, 30, 6), "gravity": (9.0, 9.5)},
            "scene": {"clearance": np.float64(0.02)},
            "options": {"self_contact": np.bool_(False)},
            "distributions": {"floor_friction": {"uniform": np.array([0.1, 0.2])}},
            "record": {"series": {"samples": range(2)}},
            "same_samples_along": ("links",),
        }
    )
    lists = load_sweep(
        {
            **PLAIN,
            "grid": {"links": [30, 40, 50], "frequency": [5.0, 10.0, 15.0, 20.0, 25.0, 30.0], "gravity": [9.0, 9.5]},
            "scene": {"clearance": 0.02},
            "options": {"self_contact": False},
            "distributions": {"floor_friction": {"uniform": [0.1, 0.2]}},
            "record": {"series": {"samples": [0, 1]}},
            "same_samples_along": ["links"],
        }
    )
    assert arrays.digest() == lists.digest() and arrays.canonical() == lists.canonical()


def test_a_walk_and_a_trajectory_of_numpy_numbers():
    """What is no setting is converted as well: frames, seeds, durations, switches."""
    walks = [
        warpchain.walk(
            links=whole(30),
            frequency=real(5.0),
            preset="soft",
            start="ellipse",
            seed=whole(2),
            frame_interval=real(0.02),
            record_before=real(0.0),
            record_loads=truth(True),
            walk_limit=real(0.05),
        )
        for whole, real, truth in ((int, float, bool), (np.int64, np.float64, np.bool_))
    ]
    assert type(walks[1].seed) is int
    assert walks[0].setup == walks[1].setup
    assert np.array_equal(walks[0].frame_joints, walks[1].frame_joints)
    chain = circular_loop(8, warpchain.preset("soft"), 1.0)
    runs = [
        warpchain.simulate("soft", *chain, real(0.01), times=times, floor=truth(True), gravity=truth(False))
        for real, truth, times in ((float, bool, [0.0, 0.01]), (np.float64, np.bool_, (np.float64(0.0), 0.01)))
    ]
    assert np.array_equal(runs[0].position, runs[1].position)


def test_what_is_no_number_is_still_refused():
    """An array is no number, whole numbers have no fractions, and messages show Python's numbers."""
    for settings, message in (
        ({"links": np.array([30])}, r"scene\.links: .*; given \[30\]"),
        ({"links": np.float64(30.0)}, r"scene\.links: .*; given 30.0"),
        ({"frequency": np.float64("nan")}, r"scene\.frequency: .*; given nan"),
        ({"seed": np.float64(1.0)}, r"seed: 1.0 is no whole number .*"),
        ({"frame_interval": np.bool_(True)}, r"frame_interval: True is no positive time .*"),
    ):
        with pytest.raises(InputError, match=message):
            warpchain.walk(**settings)
