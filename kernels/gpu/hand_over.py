"""Between springs and rigid joints in the block form: when a chain takes off, how far it may go, when it lands.

The counterpart of :mod:`cpu.implicit.joint_switch` and :mod:`contacts.approach`. M says where in memory, see
:mod:`gpu.rigid`. All threads call these functions together and get the same results.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from warpchain.kernels.contacts.approach import FLIGHT_SKIN, LEAST_SLACK
from warpchain.kernels.cpu.implicit.joint_switch import QUIET_TIME
from warpchain.kernels.cpu.loop import Features
from warpchain.kernels.gpu.board import publish
from warpchain.kernels.gpu.contacts.proximity import block_approach
from warpchain.kernels.gpu.rigid import FlightMemory
from warpchain.kernels.gpu.stage import Place
from warpchain.kernels.gpu.threads import barrier
from warpchain.kernels.layout import (
    BOARD_NOTES,
    LOSS_JOINT_SWITCH,
    NOTE_CLOSING_TIME,
    NOTE_CONTACT_STEP,
    NOTE_OTHER_STEP,
)
from warpchain.kernels.methods.controller import classical_controller
from warpchain.kernels.methods.method import METHODS, Flight
from warpchain.kernels.physics.elementary import ONE, ZERO
from warpchain.kernels.types import Control, State

wp.set_module_options({"enable_backward": False})


def flight_of(features: Features) -> Flight | None:
    """How chains with these features fly, if they do: on the sprocket impulses never pause."""
    return None if features.fixed_body == "sprocket" else METHODS[features.method].flight


@wp.func
def take_turns(K: wp.array2d(dtype=wp.float64), lane: int, step: wp.float64):
    """Keeps the step of one model of the joints while that of the other is taken."""
    other = K[BOARD_NOTES, NOTE_OTHER_STEP]
    barrier()
    if lane == 0:
        K[BOARD_NOTES, NOTE_OTHER_STEP] = step
    return other


@dataclass(frozen=True)
class BlockHandOver:
    """Warp functions for blocks of one size.

    Attributes:
        attempt: Attempts a step of a flight, see :mod:`gpu.flight`.
        take_off: ``(M, K, state, world, place, time)``, on springs → whether joints are closed now.
        longest_step: ``(K, L, memory, place, pairs, slack)`` → bound [s] of the next step of a flight.
        follow: ``(M, K, place)``, after a step of a flight → whether that may go on, whether springs would hold little
            enough energy for it, kinetic energy [J].
        land: ``(M, K, state, world, place, is_stiff, kinetic)``, with what ``follow`` said: opens the joints.
    """

    attempt: Any
    take_off: Any
    longest_step: Any
    follow: Any
    land: Any


@functools.cache
def block_hand_over(features: Features, block_dim: int) -> BlockHandOver:
    """The functions for chains that fly."""
    attempt, project, open_joints = flight_of(features).block_functions(block_dim)
    approach = block_approach(features, block_dim)

    @wp.func
    def take_off(
        M: FlightMemory,
        K: wp.array2d(dtype=wp.float64),
        state: State,
        world: int,
        place: Place,
        time: wp.float64,
    ):
        is_closed = bool(False)
        # flights of soft joints save nothing: their springs ring longer than impulses pause
        if time >= K[BOARD_NOTES, NOTE_CLOSING_TIME] and state.softness[world] == ZERO:
            is_closed, _is_stiff, _kinetic, lost = project(M, K, place, True)
            if place.lane == 0:
                K[BOARD_NOTES, NOTE_CLOSING_TIME] = time + QUIET_TIME
                if is_closed:
                    state.losses[world, LOSS_JOINT_SWITCH] = state.losses[world, LOSS_JOINT_SWITCH] + lost
        return is_closed

    @wp.func
    def longest_step(
        K: wp.array2d(dtype=wp.float64),
        L: wp.array(dtype=wp.int32),
        memory: wp.uint64,
        place: Place,
        pairs: int,
        slack: wp.float32,
    ):
        publish(K, place)
        barrier()
        return wp.max(K[BOARD_NOTES, NOTE_CONTACT_STEP], ONE / approach(K, L, memory, place, pairs, slack))

    @wp.func
    def follow(M: FlightMemory, K: wp.array2d(dtype=wp.float64), place: Place):
        is_closed, is_stiff, kinetic, _lost = project(M, K, place, False)
        return is_closed and is_stiff, is_stiff, kinetic

    @wp.func
    def land(
        M: FlightMemory,
        K: wp.array2d(dtype=wp.float64),
        state: State,
        world: int,
        place: Place,
        is_stiff: bool,
        kinetic: wp.float64,
    ):
        # where the links lie on one line neither forces nor what opens the joints has a bound: there the springs shall
        # find their forces by themselves
        if is_stiff:
            lost = open_joints(M, K, place, kinetic)
            if place.lane == 0:
                state.losses[world, LOSS_JOINT_SWITCH] = state.losses[world, LOSS_JOINT_SWITCH] + lost

    return BlockHandOver(attempt, take_off, longest_step, follow, land)


@functools.cache
def step_factors(features: Features):
    """Warp functions (factor after acceptance, factor after rejection) for steps on springs and in flight.

    ``grow(error, last_error, proportional, is_rigid)`` and ``shrink(error, is_rigid)`` → factors.
    """
    method = METHODS[features.method]
    flight = flight_of(features)
    growth, shrinkage = method.controller(wp.float32)
    flight_growth, flight_shrinkage = classical_controller(flight.error_order) if flight else (None, None)
    has_flight = flight is not None

    @wp.func
    def grow(error: wp.float32, last_error: wp.float32, proportional: int, is_rigid: int):
        factor = wp.float64(growth(error, last_error, proportional))
        if wp.static(has_flight):
            if is_rigid != 0:
                factor = flight_growth(wp.float64(error), wp.float64(last_error), proportional)
        return factor

    @wp.func
    def shrink(error: wp.float32, is_rigid: int):
        factor = wp.float64(shrinkage(error))
        if wp.static(has_flight):
            if is_rigid != 0:
                factor = flight_shrinkage(wp.float64(error))
        return factor

    return grow, shrink


@functools.cache
def list_margins(features: Features):
    """Warp function ``margins(control, is_rigid, slack, opening, displacement)`` → skin, slack, is it stale.

    ``slack``: as it was, [m]; a flight begins with none, and thus a list of its own.
    """
    has_flight = flight_of(features) is not None

    @wp.func
    def margins(control: Control, is_rigid: int, slack: wp.float32, opening: wp.float32, displacement: wp.float32):
        skin = control.skin
        least = wp.float32(0.0)
        left = slack
        if wp.static(has_flight):
            if is_rigid != 0:
                skin = FLIGHT_SKIN * skin
                least = wp.float32(LEAST_SLACK * skin)
            if slack > wp.float32(0.0):
                left = wp.float32(0.5) * wp.float32(skin) - opening - displacement
        else:
            left = wp.float32(0.5) * wp.float32(skin) - opening - displacement
        return skin, left, not left > least

    return margins
