"""What a plane that tilts adds to the cost of a step, measured beside a fixed one."""

import itertools
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from warpchain.bench.chain_timer import ChainTimer
from warpchain.bench.starts import flying, piled
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset

SECONDS = 0.2
"""Approximate length of a measurement."""


@dataclass(frozen=True)
class TiltingCost:
    """Cost of an attempted step of chains whose plane is fixed, and of the same chains in a plane that may tilt.

    Attributes:
        scene: ``"flight"`` or ``"pile"``, as of :class:`warpchain.bench.gpu_steps.GpuCost`.
        method: An explicit method.
        links: n.
        chains: Chains that are carried on together.
        fixed_microseconds: Median wall time of one attempt of all of them [µs].
        tilting_microseconds: The same in a plane that may tilt [µs].
        ratio: Median of the ratios of measurements that were made one after the other.
    """

    scene: str
    method: str
    links: int
    chains: int
    fixed_microseconds: float
    tilting_microseconds: float
    ratio: float


def tilting_costs(
    device: str,
    *,
    methods: Sequence[str],
    links: Sequence[int],
    chains: Sequence[int],
    rounds: int,
    report: Callable[[str], None],
) -> list[TiltingCost]:
    """Costs at Table 1's parameters and each method's tolerance.

    Args:
        device: ``"cpu"``, ``"cuda"`` or ``"cuda:N"``.
        methods: Explicit methods.
        links: Chain lengths.
        chains: Numbers of chains.
        rounds: Measurements of each; fixed and tilting planes take turns.
        report: Called with a line of progress.

    Raises:
        InputError: A value is refused, or this machine has no such GPU.
    """
    parameters = preset("paper")
    costs = []
    for n, scene in itertools.product(links, ("flight", "pile")):
        start = flying(n, parameters) if scene == "flight" else piled(n, device)
        for method, count in itertools.product(methods, chains):
            report(f"{scene}, {n} links, {method}, {count} chains")
            options = Options.model_validate({"method": method, "device": device})
            fixed, tilting = (
                ChainTimer(parameters, options, start, count, watch="rest", settling_runs=2, tilts=tilts)
                for tilts in (False, True)
            )
            attempts = max(1, round(SECONDS / fixed.settled.seconds))
            pairs = [
                (1e6 * fixed.measure(attempts).seconds, 1e6 * tilting.measure(attempts).seconds) for _ in range(rounds)
            ]
            costs.append(
                TiltingCost(
                    scene=scene,
                    method=method,
                    links=n,
                    chains=count,
                    fixed_microseconds=statistics.median(one for one, _ in pairs),
                    tilting_microseconds=statistics.median(other for _, other in pairs),
                    ratio=statistics.median(other / one for one, other in pairs),
                )
            )
    return costs
