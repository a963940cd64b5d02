"""Every method's Warp functions for one thread per chain."""

from dataclasses import dataclass
from typing import Any

from warpchain.kernels import layout
from warpchain.kernels.cpu.explicit import explicit_method
from warpchain.kernels.cpu.implicit.joint_switch import joint_switch
from warpchain.kernels.cpu.implicit.rigid_flight import flight_method
from warpchain.kernels.methods.controller import classical_controller, step_controller
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.methods.w_tableaus import ROS34PW2


@dataclass(frozen=True)
class CpuMethod:
    """Warp functions of a method's steps on springs.

    Attributes:
        first_stage: ``(K, chain)`` evaluates the first stage of the next step.
        attempt: ``(K, chain, h, tolerance)`` → error ratio as ordered bits.
        commit: ``(K, chain, h)`` accepts the state that the last attempt found.
        growth: Factor of the step after acceptance, see :mod:`methods.controller`.
        shrinkage: Factor of the step after rejection.
        reuses_last: Whether the last stage of a step is the first of the next.
    """

    first_stage: Any
    attempt: Any
    commit: Any
    growth: Any
    shrinkage: Any
    reuses_last: bool


@dataclass(frozen=True)
class RigidFlight:
    """Warp functions of flight on rigid joints, from one impulse to the next.

    Attributes:
        attempt: As in :class:`CpuMethod`.
        commit: ``(K, chain, h)`` → whether joints may stay rigid: springs would hold little energy.
        close_joints: ``(K, chain)`` → (whether joints are rigid now, energy lost [J]).
        open_joints: ``(K, chain)`` → energy lost [J].
        growth: As in :class:`CpuMethod`.
        shrinkage: As in :class:`CpuMethod`.
    """

    attempt: Any
    commit: Any
    close_joints: Any
    open_joints: Any
    growth: Any
    shrinkage: Any


def cpu_method(name: str, tilts: bool) -> CpuMethod:
    """A method's steps on springs, for chains whose plane tilts or does not."""
    method = find_method(name)
    controller = step_controller(method.order, method.error_order)
    return CpuMethod(*explicit_method(method.tableau, tilts), *controller, method.reuses_last)


def rigid_flight(name: str, columns: int) -> RigidFlight | None:
    """A method's flight on rigid joints, if it has one."""
    method = find_method(name)
    if not method.has_rigid_flight:
        return None
    first_row = layout.scratch_rows(method.stages)
    return RigidFlight(
        *flight_method(columns, first_row),
        *joint_switch(columns, first_row),
        *classical_controller(ROS34PW2.error_order),
    )
