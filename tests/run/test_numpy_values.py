"""NumPy's numbers, arrays, ranges and tuples mean what Python's numbers and lists mean, to the bit."""

import numpy as np

from tests.support.setups import setup_walk
from warpchain.inputs.fields import SECTION_OF
from warpchain.inputs.scene import OF_LINKS


def of_numpy(value):
    """A value of a setting in NumPy's type."""
    return {bool: np.bool_, int: np.int32, float: np.float64, str: np.str_, tuple: np.array}[type(value)](value)


def test_every_setting_takes_a_numpy_value():
    """Each field of parameters, scene and options has the same value, and the same type, either way."""
    each = (
        {name: [1e-3] * 60 for name in OF_LINKS}
        | {"unusual_values": True}
        | {"release": [[0.2, 0.0, 0.1, 0.0]], "distance_limit": 5.0}
    )
    drive = {"load_factor": 2.0, "steady_time": 0.5, "settle_time": 0.2, "stop_time": 1.0, "charm_radius": 2e-3}
    setup = setup_walk("soft", drive | each, 5)
    given = {**setup.parameters.model_dump(), **setup.scene.model_dump(), **setup.options.model_dump()}
    assert given.keys() == SECTION_OF.keys() and None not in given.values()
    again = setup_walk("soft", {name: of_numpy(value) for name, value in given.items()})
    assert again == setup
    for model in (again.parameters, again.scene, again.options):
        for name, value in model:
            assert type(value) is type(given[name]), name
