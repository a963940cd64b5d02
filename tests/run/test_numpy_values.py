"""NumPy's numbers, arrays, ranges and tuples mean what Python's numbers and lists mean, to the bit."""

import numpy as np

import warpchain
from tests.oracle_model.circular_loop import circular_loop
from tests.support.setups import setup_walk
from warpchain.inputs.scene import OF_LINKS
from warpchain.inputs.sections import SECTION_OF


def of_numpy(value):
    """A value of a setting in NumPy's type."""
    return {bool: np.bool_, int: np.int32, float: np.float64, str: np.str_, tuple: np.array}[type(value)](value)


def test_every_setting_takes_a_numpy_value():
    """Each field of parameters, scene and options has the same value, and the same type, either way."""
    each = {name: [1e-3] * 60 for name in OF_LINKS} | {"release": [[0.2, 0.0, 0.1, 0.0]], "distance_limit": 5.0}
    drive = {"load_factor": 2.0, "steady_time": 0.5, "settle_time": 0.2, "walk_until": 1.0}
    setup = setup_walk("soft", drive | each, 5)
    given = {**setup.parameters.model_dump(), **setup.scene.model_dump(), **setup.options.model_dump()}
    assert given.keys() == SECTION_OF.keys() and None not in given.values()
    again = setup_walk("soft", {name: of_numpy(value) for name, value in given.items()}, None)
    assert again == setup
    for model in (again.parameters, again.scene, again.options):
        for name, value in model:
            assert type(value) is type(given[name]), name


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
    position, velocity = circular_loop(8, warpchain.preset("soft"), 1.0)
    position[:, 1] += 0.1
    chain = position, velocity
    runs = [
        warpchain.simulate("soft", *chain, real(0.01), times=times, floor=truth(True), gravity=truth(False))
        for real, truth, times in ((float, bool, [0.0, 0.01]), (np.float64, np.bool_, (np.float64(0.0), 0.01)))
    ]
    assert np.array_equal(runs[0].position, runs[1].position)
