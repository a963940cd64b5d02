"""Every method of the step loop by the name that a user writes, and what the loop must know of it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from warpchain.kernels import layout
from warpchain.kernels.cpu.explicit import explicit_method
from warpchain.kernels.cpu.implicit.joint_switch import joint_switch
from warpchain.kernels.cpu.implicit.rigid_flight import flight_method, flight_rows
from warpchain.kernels.cpu.implicit.rosenbrock import rosenbrock_method, rosenbrock_rows
from warpchain.kernels.gpu.explicit import explicit_attempt
from warpchain.kernels.gpu.flight import flight_attempt
from warpchain.kernels.gpu.rigid import FlightLayout, block_rigid_joints
from warpchain.kernels.gpu.rosenbrock import factor_layout, rosenbrock_attempt
from warpchain.kernels.methods.controller import implicit_controller, step_controller
from warpchain.kernels.methods.explicit_tableaus import TABLEAUS
from warpchain.kernels.methods.rosenbrock_tableaus import ROSENBROCK_TABLES
from warpchain.kernels.methods.w_tableaus import ROS34PW2


@dataclass(frozen=True)
class Method:
    """One method.

    Attributes:
        name: What a user writes for ``method``.
        order: Order of the solution that is propagated.
        error_order: Order of the embedded solution; both set the controller's exponents.
        controller: Warp functions (factor after acceptance, factor after rejection) for errors of this type.
        stages: Number of stages.
        reuses_last: Whether a step leaves the first stage of the next.
        scratch_rows: Rows of a chain's scratch block of so many columns.
        functions: Warp functions (first stage, attempt, commit) for scratch blocks of so many columns.
        needs_first_power: Whether an attempt in the block form asks what the joints lose at its start.
        block_memory: Doubles that a block of so many threads keeps for the method.
        block_attempt: Warp function ``attempt(ends, forces, maxima, S, K, place, h, tolerance)`` → Trial for blocks of
            so many threads and with what :mod:`gpu.contacts.proximity` finds, from the state and first stage on the
            board, S the address of that memory.
        flight: Another method, for flight on rigid joints, if this one has one; see :class:`Flight`.
    """

    name: str
    order: int
    error_order: int
    controller: Callable[[type], Any]
    stages: int
    reuses_last: bool
    scratch_rows: Callable[[int], int]
    functions: Callable[[int], Any]
    needs_first_power: bool
    block_memory: Callable[[int], int]
    block_attempt: Callable[[int, Any, Any], Any]
    flight: "Flight | None" = None


@dataclass(frozen=True)
class Flight:
    """How a method carries a chain from one impulse to the next on rigid joints.

    Attributes:
        order: As that of a method.
        error_order: As that of a method.
        functions: Warp functions (attempt, commit, close joints, open joints) for scratch blocks of so many columns.
        block_functions: Warp functions (attempt, project, open joints) for blocks of so many threads, with the
            arguments of :mod:`gpu.flight` and :mod:`gpu.rigid`; ``block_memory`` of the method is for them.
    """

    order: int
    error_order: int
    functions: Callable[[int], Any]
    block_functions: Callable[[int], Any]


def _block_flight(threads: int) -> Any:
    rigid = block_rigid_joints(threads)
    return flight_attempt(threads), rigid.project, rigid.open_joints


def _explicit(name: str) -> Method:
    tableau = TABLEAUS[name]
    return Method(
        name=name,
        order=tableau.order,
        error_order=tableau.error_order,
        controller=lambda real: step_controller(tableau.order, tableau.error_order, real),
        stages=tableau.stages,
        reuses_last=tableau.first_same_as_last,
        scratch_rows=lambda columns: layout.scratch_rows(tableau.stages),
        functions=lambda columns: explicit_method(name),
        needs_first_power=tableau.velocity_weights[0] != 0.0,
        block_memory=lambda threads: 0,
        block_attempt=lambda threads, survey, surveyed: explicit_attempt(name, threads, survey, surveyed),
    )


def _rosenbrock(name: str) -> Method:
    table = ROSENBROCK_TABLES[name]
    return Method(
        name=name,
        order=table.order,
        error_order=table.error_order,
        controller=lambda real: implicit_controller(table.error_order, real),
        stages=table.stages,
        reuses_last=False,
        scratch_rows=lambda columns: rosenbrock_rows(name, columns),
        functions=lambda columns: rosenbrock_method(name, columns),
        needs_first_power=True,
        block_memory=lambda threads: factor_layout(threads).size,
        block_attempt=lambda threads, _survey, _surveyed: rosenbrock_attempt(name, threads),
    )


def _hybrid(name: str, burst: str) -> Method:
    """Springs by the explicit method ``burst``."""
    method = _explicit(burst)
    first_row = method.scratch_rows(0)
    flight = Flight(
        order=ROS34PW2.order,
        error_order=ROS34PW2.error_order,
        functions=lambda columns: (*flight_method(columns, first_row), *joint_switch(columns, first_row)),
        block_functions=_block_flight,
    )
    return replace(
        method,
        name=name,
        scratch_rows=lambda columns: first_row + flight_rows(columns),
        block_memory=lambda threads: FlightLayout(threads).size,
        flight=flight,
    )


METHODS = {
    **{name: _explicit(name) for name in TABLEAUS},
    **{name: _rosenbrock(name) for name in ROSENBROCK_TABLES},
    "hybrid": _hybrid("hybrid", "os32"),
}
