"""Walks and simulations that cannot be: each is refused at the door, before anything is compiled."""

import numpy as np
import pytest
import warp as wp

import warpchain
from warpchain import InputError


@pytest.fixture
def no_kernels(monkeypatch):
    """Any compilation or launch of a kernel fails the test."""

    def forbidden(*args, **kwargs):
        raise AssertionError("a kernel was used")

    for name in ("launch", "load_module", "force_load"):
        monkeypatch.setattr(wp, name, forbidden)


@pytest.mark.usefixtures("no_kernels")
@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"links": 61}, "scene.links"),
        ({"links": 2}, "scene.links"),
        ({"links": 0}, "scene.links"),
        ({"links": 60.0}, "scene.links"),
        ({"links": 20}, "scene.links"),  # too short for the sprocket
        ({"links": 10**8}, "scene.links"),
        ({"links": 99999999999999999998}, "scene.links"),
        ({"links": 1026, "device": "cuda"}, "scene.links"),
        ({"sprocket_radius": 0.5}, "scene.links"),
        ({"sprocket_radius": 1e300}, "parameters.sprocket_radius"),
        ({"sprocket_radius": 1e-9, "circle_radius": 1e-9}, "parameters.sprocket_radius"),
        ({"sprocket_radius": 4e-3, "sprocket_radius_is": "pitch"}, "parameters.sprocket_radius"),
        ({"circle_radius": 6.34e-3}, "parameters.circle_radius"),
        ({"link_length": 8.4e-3}, "parameters.circle_radius"),
        ({"link_length": 1e300}, "parameters.link_length"),
        ({"link_length": 1e-300, "circle_radius": 1e-301}, "parameters.link_length"),
        ({"inner_mass": 1e300}, "parameters.inner_mass"),
        ({"inner_mass": -1e-3}, "parameters.inner_mass"),
        ({"outer_inertia": 0.0}, "parameters.outer_inertia"),
        ({"gravity": float("nan")}, "parameters.gravity"),
        ({"joint_stiffness": float("inf")}, "parameters.joint_stiffness"),
        ({"joint_stiffness": 0.0}, "parameters.joint_stiffness"),
        ({"friction_smoothing": 0.0}, "parameters.friction_smoothing"),
        ({"floor_restitution": 1.1}, "parameters.floor_restitution"),
        ({"floor_friction": -0.1}, "parameters.floor_friction"),
        ({"frequency": -5.0}, "scene.frequency"),
        ({"frequency": float("nan")}, "scene.frequency"),
        ({"frequency": 1e200}, "scene.frequency"),
        ({"frequency": 1e308}, "scene.frequency"),
        ({"walk_limit": 1e300}, "scene.walk_limit"),
        ({"clearance": -1e-3}, "scene.clearance"),
        ({"clearance": 1e300}, "scene.clearance"),
        ({"phase": 1.0}, "scene.phase"),
        ({"start": "flying"}, "scene.start"),
        ({"start": "spinning", "clearance_of": "hanging"}, "scene.clearance_of"),
        ({"method": "euler"}, "options.method"),
        ({"tolerance": 0.0}, "options.tolerance"),
        ({"device": "gpu"}, "options.device"),
        ({"smallest_step": 1e-4}, "options.smallest_step"),
        ({"seed": -1}, "seed"),
        ({"frame_interval": 0.0}, "frame_interval"),
        ({"preset": "hard"}, "preset"),
        ({"mass": 1.0}, "'mass'"),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_impossible_walks_are_refused(values, field):
    """What cannot be is refused before any kernel is used, in one line that names the field and says what to do."""
    with pytest.raises(InputError) as caught:
        warpchain.walk(**values)
    message = str(caught.value)
    assert message.startswith(f"{field}: ")
    assert ";" in message
    assert "\n" not in message


@pytest.mark.usefixtures("no_kernels")
@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"position": np.zeros((7, 3))}, "velocity"),
        ({"position": np.zeros((7, 3)), "velocity": np.zeros((7, 3))}, "position"),
        ({"position": np.zeros((2, 3)), "velocity": np.zeros((2, 3))}, "position"),
        ({"position": np.zeros((8, 2))}, "position"),
        ({"position": np.zeros((1026, 3)), "velocity": np.zeros((1026, 3)), "device": "cuda"}, "position"),
        ({"position": np.full((8, 3), np.nan)}, "position"),
        ({"velocity": np.full((8, 3), np.inf)}, "velocity"),
        ({"velocity": "fast"}, "velocity"),
        ({"duration": -1.0}, "duration"),
        ({"duration": float("nan")}, "duration"),
        ({"duration": "1 s"}, "duration"),
        ({"times": [0.0, 2.0]}, "times"),
        ({"times": [0.5, 0.5]}, "times"),
        ({"times": []}, "times"),
        ({"times": [float("nan")]}, "times"),
        ({"tolerance": 1.0}, "options.tolerance"),
        ({"method": "rk4"}, "options.method"),
        ({"stepsize": 1.0}, "options.stepsize"),
        ({"parameters": "hard"}, "preset"),
    ],
    ids=lambda value: str(value)[:40] if isinstance(value, dict) else "",
)
def test_impossible_simulations_are_refused(values, field):
    """States, times and options that cannot be are refused before any kernel is used, naming what is wrong."""
    given = {"parameters": "soft", "position": np.zeros((8, 3)), "velocity": np.zeros((8, 3)), "duration": 1.0}
    with pytest.raises(InputError) as caught:
        warpchain.simulate(**(given | values))
    message = str(caught.value)
    assert message.startswith(f"{field}: ")
    assert "\n" not in message
