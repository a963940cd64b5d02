"""Many given chains side by side: they move as each alone, and may be given other velocities between runs."""

from collections.abc import Callable

import numpy as np
import pytest

import warpchain
from tests.support.folded_chains import folded_chain
from tests.support.presets import SOFT
from warpchain.chain.start_shapes import ellipse, lay_chain

LINKS = 12


def loops(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Ellipses that run along themselves at different speeds, high above the floor."""
    both = [lay_chain(ellipse(1.3), LINKS, SOFT.link_length, 1.0 + speed) for speed in range(count)]
    position, velocity = (np.array(each) for each in zip(*both, strict=True))
    position[..., 1] += 0.3
    return position, velocity


@pytest.mark.parametrize("device", ["cpu", "fibers"])
def test_chains_move_as_each_alone(device: str) -> None:
    """In one run or in several, chains end where `simulate` takes each of them."""
    position, velocity = loops(2)
    chains = warpchain.Chains([SOFT, SOFT], position, velocity, method="dp5", tolerance=1e-8, device=device)
    chains.run(2e-4)
    chains.run(5e-4)
    places, rates = chains.motions()
    for number in range(2):
        alone = warpchain.simulate("soft", position[number], velocity[number], 5e-4, method="dp5", tolerance=1e-8)
        assert np.abs(places[number] - alone.position[-1]).max() < 1e-9
        assert np.abs(rates[number] - alone.velocity[-1]).max() < 1e-4
    assert list(chains.status) == [warpchain.Status.FINISHED] * 2


def test_a_push_moves_one_chain_and_no_other() -> None:
    """A velocity added to all links of a loop in flight carries it on at that speed."""
    position, velocity = loops(2)
    chains, same = (warpchain.Chains([SOFT, SOFT], position, velocity, floor=False, method="dp5") for _ in range(2))
    for each in (chains, same):
        each.run(1e-3)
    pushed = chains.motions([1])[1] + [0.5, 0.0, 0.0]
    chains.set_velocity([1], pushed)
    for each in (chains, same):
        each.run(3e-3)
    moved = chains.motions()[0] - same.motions()[0]
    assert np.all(moved[0] == 0)
    assert moved[1, :, 0].mean() == pytest.approx(0.5 * 2e-3, rel=1e-4)


def test_a_heap_comes_to_rest() -> None:
    """With `to_rest` a heap on the floor ends AT_REST and stays there; a loop in the air runs into the limit."""
    heap = np.array(folded_chain(LINKS, 3, SOFT.link_length, tilt=0.2))
    loop = np.array(loops(1))[:, 0]
    heap[0][:, 1] += 0.02 - heap[0][:, 1].min()
    position, velocity = np.stack([heap, loop], axis=1)
    chains = warpchain.Chains([SOFT, SOFT], position, velocity)
    chains.run(0.2, [1])
    chains.run(3.0, [0], to_rest=True)
    assert list(chains.status) == [warpchain.Status.AT_REST, warpchain.Status.FINISHED]
    before = chains.motions([0])[0]
    chains.run(4.0, [0])
    assert np.all(chains.motions([0])[0] == before)


@pytest.mark.parametrize(
    ("call", "problem"),
    [
        (lambda chains: chains.run(1e-4), "until: .* 0.0002"),
        (lambda chains: chains.run("soon"), "until: "),
        (lambda chains: chains.run(1.0, [2]), r"chains\[0\]: .* less than 2"),
        (lambda chains: chains.motions([-1]), r"chains\[0\]: "),
        (lambda chains: chains.set_velocity([0], np.zeros((2, LINKS, 3))), r"velocity: .* \(1, 12, 3\)"),
    ],
)
def test_what_chains_cannot_do_is_refused(call: Callable[[warpchain.Chains], object], problem: str) -> None:
    """A time that has passed, a chain that is not there or velocities of another shape are refused; nothing moves."""
    chains = warpchain.Chains([SOFT, SOFT], *loops(2))
    chains.run(2e-4)
    before = chains.motions()
    with pytest.raises(warpchain.InputError, match=problem):
        call(chains)
    assert chains.time == 2e-4 and np.array_equal(before, chains.motions())
