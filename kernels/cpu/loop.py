"""The CPU loop over steps: one thread carries one chain through a bounded number of attempts.

The parts of a step and their order are those of :mod:`hooks`. The step controller (methods/controller.py) accepts or
rejects an attempt and proposes the next step.
"""

import functools

import warp as wp

from warpchain.kernels import layout
from warpchain.kernels.codes import NOT_FINITE, RUNNING, STEP_LIMIT, STEP_TOO_SMALL
from warpchain.kernels.contacts.fixed_body import BODIES
from warpchain.kernels.contacts.list_layout import list_layout
from warpchain.kernels.cpu.contacts.contact_pass import body_pass, link_pass
from warpchain.kernels.cpu.contacts.proximity import greatest_opening
from warpchain.kernels.cpu.contacts.time_to_contact import step_bound
from warpchain.kernels.cpu.implicit.flights import rigid_in_flight
from warpchain.kernels.cpu.implicit.rigid_layout import scratch_rows
from warpchain.kernels.cpu.increments import PLANE, WEIGHT
from warpchain.kernels.cpu.joints import springs
from warpchain.kernels.cpu.placing import place_ends
from warpchain.kernels.cpu.tilting import tilting_plane
from warpchain.kernels.cpu.upright import upright_plane
from warpchain.kernels.events.present_chain import has_changed, present_chain
from warpchain.kernels.events.record import lacks_last_sample, record_is_full
from warpchain.kernels.events.sample import next_mark, observation, sampling
from warpchain.kernels.events.softening import book_softening, contact_step, spring_tolerance
from warpchain.kernels.events.tallies import add_count, attempts_made, of_fixed_body, raise_extreme, store_losses
from warpchain.kernels.features import COMPILER_FLAGS, Features
from warpchain.kernels.methods.controller import LEAST_SHRINKAGE, next_step
from warpchain.kernels.methods.method import find_method
from warpchain.kernels.physics.elementary import ONE, ZERO
from warpchain.kernels.physics.scaled_loads import write_links
from warpchain.kernels.types import Chain, Integers, Rows, Worlds, read_ground


@wp.func
def load_state(K: Rows, chain: Chain, worlds: Worlds, world: int):
    """Fills the rows of the state; rows of losses start at zero, columns behind the links are links without mass."""
    for i in range((chain.link_count + wp.static(2 * layout.LANES - 1)) & wp.static(-2 * layout.LANES)):
        for row in range(wp.static(layout.SCRATCH_ROWS)):
            K[row, i] = ZERO
            if row < 6 and i < chain.link_count:
                K[row, i] = worlds.links[world, row, i]
    write_links(K, worlds.model, world, worlds.load_factor[world])


@wp.func
def state_is_finite(K: Rows, chain: Chain):
    """False if the state holds an infinity or a NaN."""
    finite = bool(True)
    for i in range(chain.link_count):
        for row in range(6):
            finite = finite and wp.isfinite(K[row, i])
    return finite


@functools.cache
def make_advance(features: Features):
    """Kernel with :data:`types.STEP_ARGUMENTS`, one thread per chain.

    Worlds whose status is not RUNNING are left alone.
    """
    columns = features.columns
    rows = scratch_rows(features.method, columns, features.is_mixed)
    list_size = list_layout(columns).size
    is_driven = features.is_driven
    face_of = BODIES[features.fixed_body].face
    fixed_loss, _, _ = of_fixed_body(features.is_driven)
    # on the sprocket the pauses between impulses are too short for a flight; in flight joints feel weight only
    can_fly = not is_driven and not features.moving_sprocket and features.load == "weight"
    has_flight = find_method(features.method).has_rigid_flight and can_fly
    load = PLANE if features.tilts else WEIGHT if features.load == "weight" else features.acceleration
    on_springs = springs(features.method, columns, features.is_mixed, load)
    joints = rigid_in_flight(on_springs, columns) if has_flight else on_springs
    plane = tilting_plane(joints) if features.tilts else upright_plane(features.fixed_body, joints)
    meet_bodies = body_pass(features, plane)
    make_list, meet_links = link_pass(features, joints)
    bound_of_step = step_bound(features, has_flight)
    sample = sampling(features)
    write_sample = observation(features)

    @wp.func
    def take_sample(K: Rows, chain: Chain, worlds: Worlds, world: int) -> Chain:
        """Takes a sample → the chain as the sample has left it."""
        softness = worlds.softness[world]
        load_factor = worlds.load_factor[world]
        worlds.status[world] = sample(K, chain, worlds, world, worlds.time[world])
        after = chain
        if has_changed(worlds, world, softness, load_factor):
            after = present_chain(worlds, world)
            book_softening(chain, after, worlds, world)
            if wp.static(is_driven):
                write_links(K, worlds.model, world, worlds.load_factor[world])
                joints.take_constants(K, after)
            worlds.has_first_stage[world] = 0
        return after

    @wp.func
    def reject(K: Rows, chain: Chain, worlds: Worlds, world: int, h: wp.float64, error: wp.float64):
        """Proposes a shorter step, or ends the run."""
        add_count(worlds, world, layout.REJECTED, wp.int64(1))
        step = h * LEAST_SHRINKAGE
        if wp.isfinite(error):
            step = h * joints.shrinkage(worlds, world, error)
        elif not (state_is_finite(K, chain) and joints.start_is_finite(K, chain, worlds, world)):
            worlds.status[world] = NOT_FINITE
        worlds.step[world] = step
        if worlds.status[world] == RUNNING and step < worlds.control.smallest_step:
            worlds.status[world] = STEP_TOO_SMALL

    @wp.kernel(
        name="advance", module="unique", enable_backward=False, module_options={"cpu_compiler_flags": COMPILER_FLAGS}
    )
    def advance(launched: Integers, worlds: Worlds):
        world = launched[wp.tid()]
        if worlds.status[world] != RUNNING:
            return
        memory = worlds.scratch[world]
        K = wp.array(ptr=memory.ptr, shape=(wp.static(rows), wp.static(columns)), dtype=wp.float64)
        list_memory = worlds.lists[world]
        L = wp.array(ptr=list_memory.ptr, shape=(wp.static(list_size),), dtype=wp.int32)
        P = worlds.plane[world]
        ground = read_ground(worlds.model, world)
        still = face_of(ground)
        chain = present_chain(worlds, world)
        # load
        if worlds.is_fresh[world] != 0:
            load_state(K, chain, worlds, world)
            joints.take_constants(K, chain)
            place_ends(K, chain)
            plane.begin_run(K, P, chain)
            worlds.gap[world] = plane.gap(K, plane.at_start(P, chain), ground, still)
            L[wp.static(list_layout(columns).count)] = 0
            make_list(K, L, chain, worlds, world, worlds.control.skin, greatest_opening(K, chain))
            worlds.has_first_stage[world] = 0
            worlds.is_fresh[world] = 0
        attempts = int(0)
        while (
            worlds.status[world] == RUNNING and attempts < worlds.control.attempts and not record_is_full(worlds, world)
        ):
            # sample
            if worlds.time[world] >= next_mark(worlds, world):
                chain = take_sample(K, chain, worlds, world)
            time = worlds.time[world]
            stop_time = worlds.stop_time[world]
            if worlds.status[world] == RUNNING and time >= stop_time:
                worlds.status[world] = worlds.stop_status[world]
            if worlds.status[world] != RUNNING:
                break
            # length
            joints.settle(K, chain, worlds, world)
            longest = contact_step(worlds, world, wp.static(is_driven))
            bound = bound_of_step(K, L, plane.at_start(P, chain), still, worlds, world, longest)
            h = wp.min(worlds.step[world], bound)
            reaches_stop = time + h >= stop_time
            if reaches_stop:
                h = stop_time - time
            # attempt
            felt = plane.begin_step(K, P, chain, worlds, world, h)
            tolerance = spring_tolerance(worlds, world, wp.static(is_driven))
            error = wp.cast(joints.attempt(K, felt, worlds, world, h, tolerance), wp.float64)
            attempts += 1
            if error <= ONE:
                # accept
                factor, joints_may_stay = joints.accept(K, felt, worlds, world, h, error)
                add_count(worlds, world, layout.ACCEPTED, wp.int64(1))
                worlds.time[world] = wp.where(reaches_stop, stop_time, time + h)
                worlds.step[world] = next_step(worlds.step[world], h, factor)
                worlds.last_error[world] = wp.max(error, wp.float64(1e-4))
                opening = greatest_opening(K, chain)
                raise_extreme(worlds, world, layout.OPENING, opening)
                plane.end_step(K, P, chain, h)
                # contacts
                impulses = meet_bodies(K, P, chain, felt, ground, still, worlds, world)
                impulses += meet_links(K, L, chain, worlds, world, opening)
                if impulses > wp.int64(0) or not joints_may_stay:
                    worlds.has_first_stage[world] = 0
                    joints.react(K, chain, worlds, world)
            else:
                reject(K, chain, worlds, world, h, error)
            if worlds.status[world] == RUNNING and attempts_made(worlds, world) >= worlds.control.step_limit:
                worlds.status[world] = STEP_LIMIT
        # store
        if lacks_last_sample(worlds, world, worlds.time[world], worlds.status[world]):
            place_ends(K, chain)
            write_sample(K, chain, worlds, world, worlds.time[world])
        for i in range(chain.link_count):
            for row in range(6):
                worlds.links[world, row, i] = K[row, i]
        store_losses(K, layout.LOST_FRICTION, worlds, world, chain.link_count, wp.static(fixed_loss))

    return advance
