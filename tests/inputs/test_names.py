"""Names of values, the paper's symbols in their place, and what an unknown name is taken for."""

import warnings
from collections.abc import Mapping
from pathlib import Path

import pytest

import warpchain
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.scene import Scene
from warpchain.inputs.sections import NAME_OF_SYMBOL, SECTION_OF, SYMBOL_OF, suggested_name
from warpchain.inputs.setup import read_setup
from warpchain.inputs.validation import InputError, InputWarning
from warpchain.run.single_walk import setup_walk

SYMBOLS = {
    "links": "n",
    "frequency": "nu",
    "link_length": "ell",
    "sprocket_radius": "R",
    "inner_mass": "m_inner",
    "outer_mass": "m_outer",
    "inner_inertia": "I_inner",
    "outer_inertia": "I_outer",
    "viscous_friction": "beta",
    "coulomb_friction": "tau_c",
    "floor_restitution": "e_fc",
    "floor_friction": "mu_fc",
    "gravity": "g",
    "chain_restitution": "e_cc",
    "chain_friction": "mu_cc",
    "sprocket_restitution": "e_sc",
    "sprocket_friction": "mu_sc",
    "joint_stiffness": "k",
    "joint_damping": "b",
    "friction_smoothing": "omega_c",
    "tangential_restitution": "e_t",
    "circle_radius": "r",
    "half_width": "h",
}
QUICK = {"start": "ellipse", "preset": "soft", "links": 32, "method": "dp5", "walk_limit": 1e-6}


def test_every_parameter_has_one_symbol() -> None:
    """Symbols are typed here from the paper; none is a name, and all is ASCII."""
    assert SYMBOL_OF == SYMBOLS
    assert NAME_OF_SYMBOL == {symbol: name for name, symbol in SYMBOLS.items()}
    assert not NAME_OF_SYMBOL.keys() & SECTION_OF.keys()
    assert all(symbol.isascii() and symbol.isidentifier() for symbol in NAME_OF_SYMBOL)


@pytest.mark.parametrize("name", Parameters.model_fields)
def test_symbols_stand_for_names(tmp_path: Path, name: str) -> None:
    """A value by its symbol, in ASCII or as printed, is the value by its name: in a call, in a file, in a change."""
    value = 1.1 * Parameters.quantities()[name].value if name != "sprocket_friction" else 0.5
    expected = setup_walk("soft", {name: value}, None)
    assert expected.parameters != preset("soft") or value == 0
    for symbol in (SYMBOLS[name], Parameters.quantities()[name].symbol):
        assert setup_walk("soft", {symbol: value}, None) == expected
        assert preset("soft").with_values({symbol: value}) == expected.parameters
        path = tmp_path / "walk.yaml"
        path.write_text(f"preset: soft\nparameters: {{{symbol}: {value!r}}}", encoding="utf-8")
        assert read_setup(path) == ("soft", {"scene": {}, "options": {}, "parameters": {name: value}})


def test_a_value_is_given_once(tmp_path: Path) -> None:
    """A value by name and by symbol is refused with both places."""
    path = tmp_path / "walk.yaml"
    path.write_text("preset: soft\nparameters: {mu_fc: 0.3, floor_friction: 0.3}", encoding="utf-8")
    with pytest.raises(
        InputError, match=r"^parameters\.floor_friction: also given as parameters\.mu_fc; leave one out$"
    ):
        read_setup(path)
    both = {"gravity": 9.0, "g": 9.0}
    with pytest.raises(InputError, match=r"^'g': also given as 'gravity'; leave one out$"):
        warpchain.walk(**both)
    with pytest.raises(InputError, match=r"^parameters\.g: also given as parameters\.gravity; leave one out$"):
        preset("soft").with_values(both)
    with pytest.raises(InputError, match=r"^n: an argument of its own has this value; give links=…$"):
        warpchain.walk(n=80)


@pytest.mark.parametrize(
    ("written", "known", "remedy"),
    [
        ("floor_frictoin", Scene.model_fields, "did you mean parameters.floor_friction?"),
        ("floor_frictoin", SECTION_OF, "did you mean floor_friction?"),
        ("tolerance", Scene.model_fields, "did you mean options.tolerance?"),
        ("frequncy", Scene.model_fields, "did you mean frequency?"),
        ("mu_fd", SECTION_OF, "did you mean mu_fc?"),
        ("μ", SECTION_OF, "did you mean mu_fc, mu_cc or mu_sc?"),
        ("m", Parameters.model_fields, "did you mean m_inner or m_outer?"),
        ("omega", Scene.model_fields, "did you mean parameters.omega_c?"),
        ("limit", Scene.model_fields, "did you mean hold_limit or walk_limit?"),
        ("inertia", SECTION_OF, "did you mean inner_inertia or outer_inertia?"),
        ("K", Parameters.model_fields, f"give one of {', '.join(Parameters.model_fields)}"),
        ("K", SECTION_OF, "give one of those that `warpchain parameters` lists"),
    ],
)
def test_an_unknown_name_is_looked_for_everywhere(written: str, known: Mapping[str, object], remedy: str) -> None:
    """The remedy names what an unknown name may be: here, in another section, or the several that it may be."""
    assert suggested_name(written, known) == remedy


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ({"ell": 12.68, "r": 5e-3}, "link_length: 12.68 m is 1000 times Table 1's 0.01268 m; did you mean 1.268e-2?"),
        ({"m_outer": 3.147}, "outer_mass: 3.147 kg is 1000 times Table 1's 0.003147 kg; did you mean 3.147e-3?"),
        ({"r": 4.2e-6}, "circle_radius: 4.2e-6 m is 1/1000 of the preset's 0.0042 m; did you mean 4.2e-3?"),
        ({"k": 1e12}, "joint_stiffness: 1e12 N/m is 1000 times Table 1's 1e9 N/m; did you mean 1e9?"),
    ],
)
def test_a_value_in_another_unit_draws_a_warning(values: Mapping[str, float], line: str) -> None:
    """A value far from Table 1's is taken, with one warning that names its unit and points at the caller."""
    with pytest.warns(InputWarning) as caught:
        warpchain.walk(**QUICK, **values)
    assert [(str(each.message), each.filename) for each in caught] == [(f"parameters.{line}", __file__)]


@pytest.mark.parametrize(
    "values",
    [
        {"joint_stiffness": 1e7, "joint_damping": 30.0},  # near those of a preset
        {"link_length": 29 * 1.268e-2},
        {"gravity": 0.0, "viscous_friction": 0.0},
        {"sprocket_restitution": 0.9, "floor_restitution": 1e-6},  # pure numbers
        {"contact_step": 1e-3, "clearance": 10.0},  # nothing that Table 1 has
        {"seed": 3},
    ],
)
def test_other_values_draw_none(values: Mapping[str, float]) -> None:
    """Values near those of a preset, zeros, pure numbers, options, scenes and samples draw no warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warpchain.walk(**QUICK, **values)


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"parameters": {"ell": 12.68}}, "parameters.link_length"),
        ({"grid": {"link_length": [0.013, 12.68, 13.0]}}, "grid.link_length[1]"),
        ({"distributions": {"link_length": {"uniform": [11, 12.68]}}}, "distributions.link_length.uniform[1]"),
        (
            {"distributions": {"link_length": {"gaussian": {"mean": 12.68, "sigma": 0.1}}}},
            "distributions.link_length.gaussian.mean",
        ),
    ],
)
def test_a_sweep_warns_once(tmp_path: Path, change: Mapping[str, object], where: str) -> None:
    """Of many walks with a value in another unit one warning comes, with the path of the first such value."""
    content = {"version": 1, "name": "far", "seed": 1, "preset": "soft", "samples": 2}
    content |= {"scene": {"links": 32, "start": "ellipse", "walk_limit": 1e-6}, "options": {"method": "dp5"}}
    with pytest.warns(InputWarning) as caught:
        result = warpchain.sweep(content | change, tmp_path / "far", workers=1)
    assert result.walk_count >= 2
    text = "12.68 m is 1000 times Table 1's 0.01268 m; did you mean 1.268e-2?"
    assert [(str(each.message), each.filename) for each in caught] == [(f"sweep.{where}: {text}", __file__)]
