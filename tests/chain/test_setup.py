"""The setup of a walk: completed values, names and the paper's symbols in their place, YAML files."""

from pathlib import Path

import pytest

import warpchain
from tests.support.setups import setup_walk
from warpchain.inputs.fields import NAME_OF_SYMBOL, SECTION_OF, SYMBOL_OF
from warpchain.inputs.parameters import Parameters, preset
from warpchain.inputs.validation import InputError
from warpchain.sweeps.sweep_file import read_walk_file

SYMBOLS = {
    "links": "n", "frequency": "nu", "link_length": "ell", "sprocket_radius": "R", "inner_mass": "m_inner",
    "outer_mass": "m_outer", "inner_inertia": "I_inner", "outer_inertia": "I_outer", "viscous_friction": "beta",
    "coulomb_friction": "tau_c", "floor_restitution": "e_fc", "floor_friction": "mu_fc", "gravity": "g",
    "chain_restitution": "e_cc", "chain_friction": "mu_cc", "sprocket_restitution": "e_sc",
    "sprocket_friction": "mu_sc", "joint_stiffness": "k", "joint_damping": "b", "friction_smoothing": "omega_c",
    "tangential_restitution": "e_t", "circle_radius": "r", "half_width": "h",
}  # fmt: skip


def written(folder: Path, text: str) -> Path:
    """A YAML file with the text."""
    path = folder / "walk.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_parameter_has_one_symbol() -> None:
    """Symbols are typed here from the paper; none is a name, and all is ASCII."""
    assert SYMBOL_OF == SYMBOLS
    assert not NAME_OF_SYMBOL.keys() & SECTION_OF.keys()
    assert all(symbol.isascii() and symbol.isidentifier() for symbol in NAME_OF_SYMBOL)


@pytest.mark.parametrize("name", Parameters.model_fields)
def test_symbols_stand_for_names(tmp_path: Path, name: str) -> None:
    """A value by its symbol, in ASCII or as printed, is the value by its name: in a call, in a file, in a change."""
    value = 1.1 * Parameters.quantities()[name].value if name != "sprocket_friction" else 0.5
    expected = setup_walk("soft", {name: value})
    for symbol in (SYMBOLS[name], Parameters.quantities()[name].symbol):
        assert setup_walk("soft", {symbol: value}) == expected
        assert preset("soft").with_values({symbol: value}) == expected.parameters
        path = written(tmp_path, f"preset: soft\nparameters: {{{symbol}: {value!r}}}")
        assert read_walk_file(path)[1]["parameters"] == {name: value}


def test_a_value_is_given_once(tmp_path: Path) -> None:
    """A value by name and by symbol is refused."""
    path = written(tmp_path, "preset: soft\nparameters: {mu_fc: 0.3, floor_friction: 0.3}")
    with pytest.raises(InputError, match=r"^parameters\.floor_friction: given twice, also as 'mu_fc'; remove one$"):
        read_walk_file(path)
    for call in (warpchain.walk, lambda **both: preset("soft").with_values(both)):
        with pytest.raises(InputError, match=r"^(parameters\.)?gravity: given twice, also as 'g'; remove one$"):
            call(gravity=9.0, g=9.0)
    with pytest.raises(InputError, match=r"^links: given twice, also as 'n'; remove one$"):
        warpchain.walk(links=60, n=80)


@pytest.mark.parametrize(
    ("written", "meant"),
    [("floor_frictoin", "parameters.floor_friction"), ("mu_fd", "parameters.mu_fc"), ("frequncy", "scene.frequency")],
)
def test_an_unknown_name_is_looked_for_everywhere(written: str, meant: str) -> None:
    """The remedy names the closest name or symbol, whatever its section."""
    for call in (lambda: warpchain.walk(**{written: 1}), lambda: preset("paper").with_values({written: 1})):
        with pytest.raises(InputError, match=rf"{written}'?: unknown name; did you mean {meant}\?$"):
            call()
