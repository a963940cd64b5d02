"""Resolves a user's values to the `Setup` of a walk; scene, options and parameters are checked together.

Keyword arguments, the command line and YAML files all go through `resolve`, which raises only `InputError`.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from warpchain.chain.setup import Setup, State
from warpchain.inputs.distributions import TABLE, Seed, draw, random_generator
from warpchain.inputs.options import Options
from warpchain.inputs.parameters import preset as parameter_preset
from warpchain.inputs.scene import OF_LINKS, Scene
from warpchain.inputs.unit_slips import check_units
from warpchain.inputs.validation import InputError, checked, validated

Values = Mapping[str, object]
MAY_BE_NONE: Final = ("links", "frequency", "start", "method", "tolerance")
"""Keywords of a walk whose None is the default."""
OF_THE_WALK: Final = (
    *("walk_limit", "stop_time", "distance_limit", "floor", "slope"),
    *("charm_mass", "charm_inertia", "charm_radius", "charm_link", "stiff_joint", "joint_friction_factor"),
    *("mass_gradient", *OF_LINKS),
)
"""Fields of the scene that matter after the release, and may change there."""


def resolve(
    preset: str, *, scene: Values, options: Values, parameters: Values, seed: int | None = None, loads: bool = False
) -> Setup:
    """Check a user's values, complete them, and draw the sample of a seed, if there is one.

    Given are the fields that differ from defaults and preset, and whether joint forces of the walk will be recorded.
    From the seed's generator come first the parameters, then phase and clearance, of what is not given, as in the first
    walk of a sweep. An `InputError` has one line with the field's path and the remedy.
    """
    whole = validated(Scene, scene, "scene")
    changed = parameter_preset(preset).with_values(parameters)
    chosen = Options.chosen(options, tilts=whole.plane == "tilting", loads=loads)
    setup = Setup(preset, changed, whole, chosen).checked()
    if seed is None:
        return setup
    drawn = {name: distribution for name, distribution in TABLE.items() if name not in {*scene, *parameters}}
    return setup.with_drawn(draw(setup.placed(drawn), random_generator(checked(seed, "seed", Seed))))


def continued(state: State, sections: Mapping[str, Values]) -> Setup:
    """The setup of a walk from a state, with other values of what comes behind the release; else an `InputError`."""
    if early := [name for name in sections["scene"] if name not in OF_THE_WALK]:
        raise InputError(f"{', '.join(early)}: not possible with a state, whose chain is already released; remove it")
    before, given = state.setup, sections["options"]
    options = validated(Options, {**before.options.beside(given), **given}, "options")
    scene = validated(Scene, {**vars(before.scene), **sections["scene"]}, "scene")
    parameters = before.parameters.with_values(sections["parameters"]) if sections["parameters"] else before.parameters
    setup = Setup(before.preset, parameters, scene, options, state).checked("start")
    for name in OF_THE_WALK[:2]:
        if (end := getattr(scene, name)) is not None and end < state.time:
            raise InputError(f"{name}: {end:g} s is before the state at {state.time:g} s; use a later time")
    if not options.unusual_values:
        check_units({name: getattr(parameters, name) for name in sections["parameters"]}, "parameters")
        check_units(sections["scene"], "scene")
    if scene.plane == "fixed" and not state.is_placed_as_in(setup):  # a moving sprocket may have left it in the floor
        setup.floor.check_above(state.position, state.parameters.link_length, "start")
    return replace(setup, start=replace(state, setup=replace(setup, start=None)))
