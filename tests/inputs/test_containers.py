"""What stands for a list of numbers: arrays that keep their mask, and containers with an order."""

import math
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import warpchain
from warpchain.inputs.scene import Scene
from warpchain.inputs.validation import InputError, InputWarning, validated
from warpchain.inputs.yaml_files import parse_yaml
from warpchain.results.walk_result import WalkResult
from warpchain.sweeps.plan import load_sweep

N = 12
LENGTH = warpchain.preset("paper").link_length
ANGLES = math.pi / 2 + 2 * math.pi * np.arange(N) / N
RING = LENGTH / (2 * math.sin(math.pi / N)) * np.column_stack([np.cos(ANGLES), 1.2 + np.sin(ANGLES)])


def link_masses(values: Any) -> Any:
    """The masses of a scene's links."""
    scene = {"links": 4, "frequency": 5.0, "start": "ellipse", "link_masses": values}
    return validated(Scene, scene, "scene").link_masses


def axis(values: Any) -> Any:
    """The values of a sweep's axis."""
    scene = {"links": 20, "start": "ellipse"}
    content = {"version": 1, "name": "a", "seed": 1, "preset": "soft", "samples": 1, "scene": scene}
    return load_sweep({**content, "grid": {"frequency": values}}).blocks[0].axes["frequency"]


NUMBERS = [1e-3, 2e-3, 3e-3, 4e-3]
UNORDERED: list[Callable[[list[float]], Any]] = [
    set,
    frozenset,
    iter,
    lambda values: (value for value in values),
    lambda values: map(float, values),
    lambda values: dict.fromkeys(values).keys(),
    lambda values: dict(enumerate(values)).values(),
    lambda values: memoryview(np.array(values)),
]


@pytest.mark.parametrize("make", UNORDERED)
@pytest.mark.parametrize("field", [link_masses, axis])
def test_sets_iterators_and_views_are_no_lists(make: Callable[[list[float]], Any], field: Callable[[Any], Any]) -> None:
    """Their order or content is not fixed: one line that names the field."""
    with pytest.raises(InputError, match=r"\.(link_masses|frequency): expected a list, got a .*; use a list$"):
        field(make(NUMBERS))


def test_ordered_containers_are_lists() -> None:
    """Lists, tuples, arrays and queues keep their order."""
    for make in (list, tuple, np.array, deque):
        assert link_masses(make(NUMBERS)) == tuple(NUMBERS)


def test_a_set_in_yaml_is_refused() -> None:
    """Python would run it in the order of its hashes, which changes from process to process."""
    with pytest.raises(InputError, match=r"^sweep\.frequency: expected a list, got a set, "):
        parse_yaml("frequency: !!set {5.0, 7.0}", "sweep")


def masked(values: Any, *places: int) -> Any:
    """The values as an array of NumPy with a mask."""
    array = np.ma.array(values)
    for place in places:
        array[place] = np.ma.masked
    return array


@pytest.mark.parametrize("wrap", [lambda array: array, list])
def test_masked_numbers_are_refused(wrap: Callable[[Any], Any]) -> None:
    """What lies under a mask is no number that anyone gave; an array whose mask masks nothing is taken."""
    state = warpchain.State.of_joints(RING)
    calls: list[tuple[Callable[[Any], Any], Any]] = [
        (warpchain.State.of_joints, RING),
        (lambda values: warpchain.State.of_joints(RING, values), np.zeros_like(RING)),
        (lambda values: warpchain.State.of_links(values, state.velocity), state.position),
        (lambda values: warpchain.State.of_links(state.position, values), state.velocity),
        (link_masses, NUMBERS),
        (axis, [5.0, 7.0]),
    ]
    for call, values in calls:
        with pytest.raises(InputError, match=r"expected numbers, got masked values; use an array without a mask$"):
            call(wrap(masked(values, 1)))
        call(wrap(masked(values)))


def test_a_state_is_bounded_as_floors_are() -> None:
    """A chain more than 10 km away, where floors end, is refused with its greatest coordinate."""
    state = warpchain.State.of_joints(RING)
    warpchain.State.of_links(state.position + np.array([9.9e3, 0, 0]), state.velocity)
    for move in ([1.01e4, 0, 0], [0, 1e300, 0]):
        with pytest.raises(InputError, match=r"^position: expected at most 10000 m from the origin, got "):
            warpchain.State.of_links(state.position + np.array(move), state.velocity)


def test_measured_joints_say_how_far_they_moved(recwarn: pytest.WarningsRecorder) -> None:
    """Up to 0.1 % of a link without a word, up to 2 % with a warning that says how far; more is refused."""
    noise = np.random.default_rng(3).normal(0, 1, (N, 2))
    state = warpchain.State.of_joints(RING + 1e-4 * LENGTH * noise)
    assert not recwarn.list
    measured = RING + 0.008 * LENGTH * noise
    with pytest.warns(InputWarning, match=r"^joints: .* joint \d+ moves by \d\.\d\d% of a link \(mean") as caught:
        state = warpchain.State.of_joints(measured)
    moved = np.linalg.norm(state.joints - measured, axis=1) / LENGTH
    assert f"joint {moved.argmax()} moves by {moved.max():.2%}" in str(caught[0].message)
    with pytest.raises(InputError, match=r"more than 2%; measure joints or link_length more exactly$"):
        warpchain.State.of_joints(RING + 0.05 * LENGTH * noise)


def test_walks_take_numbers_only_as_lists() -> None:
    """The same through the front door."""
    with pytest.raises(InputError, match=r"link_masses: expected a list, got a set"):
        result: WalkResult = warpchain.walk(links=4, frequency=5.0, start="ellipse", link_masses={1e-3, 2e-3})
        assert result
