"""Physical parameters of a roller chain: Table 1 of the paper, each quantity declared once.

Every field of `Parameters` carries a `Quantity`: symbol, unit, value and uncertainty in Table 1, and origin. Presets,
error messages and the samples of `warpchain.inputs.distributions` are derived from it.

Source: "A walking roller chain", Table 1, unless a quantity says otherwise.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal, Self

from warpchain.inputs.validation import InputError, Section, by_name, number_field, shown, validated

Source = Literal["measured", "looked up", "adjusted", "chosen here"]

Limits = Mapping[str, float]

FRACTION: Final[Limits] = {"ge": 0.0, "le": 1.0}
FRICTION: Final[Limits] = {"ge": 0.0, "le": 10.0}
"""Rubber has more than 1."""
SIGNED_FRACTION: Final[Limits] = {"ge": -1.0, "le": 1.0}
LENGTH: Final[Limits] = {"ge": 1e-9, "le": 1e3}
"""From a few atoms to a kilometre: like the next ones far beyond any chain, and small enough for squares and ratios."""
WIDTH: Final[Limits] = {"ge": 0.0, "le": 1e3}
MASS: Final[Limits] = {"gt": 0.0, "le": 1e6}
INERTIA: Final[Limits] = {"gt": 0.0, "le": 1e12}
"""Up to that of the greatest mass at the greatest length."""
TORQUE: Final[Limits] = {"ge": 0.0, "le": 1e9}
GRAVITY: Final[Limits] = {"ge": 0.0, "le": 1e6}
"""Up to that of a white dwarf."""
STIFFNESS: Final[Limits] = {"gt": 0.0, "le": 1e12}
DAMPING: Final[Limits] = {"ge": 0.0, "le": 1e12}
TURNING: Final[Limits] = {"gt": 0.0, "le": 1e6}
"""Up to a speed that no joint reaches at the highest frequency of a scene."""


@dataclass(frozen=True)
class Quantity:
    """One row of Table 1.

    Attributes:
        symbol: symbol in the paper's equations.
        unit: SI unit, "1" for pure numbers.
        value: value in Table 1, in `unit`.
        sigma: standard deviation in Table 1, in `unit`; 0 when the table gives none.
        source: how the value was obtained; "chosen here" when it is not in the paper.
        meaning: one line saying what the quantity is.
    """

    symbol: str
    unit: str
    value: float
    sigma: float
    source: Source
    meaning: str


def _row(
    symbol: str, unit: str, value: float, sigma: float, limits: Limits, meaning: str, source: Source = "measured"
) -> Any:
    """A required field that carries a row of the table, see `Parameters.quantities`."""
    return number_field(..., unit, meaning, symbol=symbol, value=value, sigma=sigma, source=source, **limits)


class Parameters(Section):
    """Physical parameters of one chain, its sprocket and the floor, in SI units.

    No field has a default: a set of parameters comes from a named preset (`preset`), with changes made by
    `with_values`. The order of the fields is part of the interface, because samples are drawn in it.

    Raises:
        pydantic.ValidationError: a value is missing, unknown, not a finite number or out of bounds, or
            `circle_radius` is not smaller than half of `link_length`.
    """

    link_length: float = _row("ℓ", "m", 1.268e-2, 1e-5, LENGTH, "distance between the two joints of a link")
    sprocket_radius: float = _row(
        "R", "m", 5.56e-2, 5e-4, LENGTH, "radius of the sprocket; sprocket_radius_is says which"
    )
    inner_mass: float = _row("m_inner", "kg", 3.700e-3, 2e-6, MASS, "mass of an inner link")
    outer_mass: float = _row("m_outer", "kg", 3.147e-3, 2e-6, MASS, "mass of an outer link")
    inner_inertia: float = _row("I_inner", "kg m²", 1.69e-7, 1e-9, INERTIA, "moment of inertia of an inner link")
    outer_inertia: float = _row("I_outer", "kg m²", 1.292e-7, 9e-10, INERTIA, "moment of inertia of an outer link")
    viscous_friction: float = _row("β", "N m s", 9e-5, 1e-5, TORQUE, "joint torque per angular velocity")
    coulomb_friction: float = _row("τ_c", "N m", 1.10e-4, 9e-6, TORQUE, "joint torque at angular velocities above ω_c")
    floor_restitution: float = _row("e_fc", "1", 0.018, 0.004, FRACTION, "normal restitution, floor and chain")
    floor_friction: float = _row("μ_fc", "1", 0.27, 0.02, FRICTION, "friction coefficient, floor and chain")
    gravity: float = _row("g", "m/s²", 9.809, 0.0, GRAVITY, "gravitational acceleration, along −y", "looked up")
    chain_restitution: float = _row("e_cc", "1", 0.80, 0.0, FRACTION, "normal restitution, two links", "looked up")
    chain_friction: float = _row("μ_cc", "1", 0.62, 0.0, FRACTION, "friction coefficient, two links", "looked up")
    sprocket_restitution: float = _row(
        "e_sc", "1", 0.01, 0.0, FRACTION, "normal restitution, sprocket and chain", "adjusted"
    )
    sprocket_friction: float = _row(
        "μ_sc", "1", 0.99, 0.0, FRACTION, "friction coefficient, sprocket and chain", "adjusted"
    )
    joint_stiffness: float = _row("k", "N/m", 1e9, 0.0, STIFFNESS, "stiffness of a joint's spring", "adjusted")
    joint_damping: float = _row("b", "N s/m", 1e3, 0.0, DAMPING, "damping of a joint's spring", "adjusted")
    friction_smoothing: float = _row(
        "ω_c", "rad/s", 1e-3, 0.0, TURNING, "width of Coulomb friction's sign change, tanh(ω/ω_c)", "adjusted"
    )
    tangential_restitution: float = _row(
        "e_t", "1", 0.0, 0.0, SIGNED_FRACTION, "tangential restitution, all pairs", "adjusted"
    )
    circle_radius: float = _row(
        "r", "m", 4.2e-3, 0.0, LENGTH, "radius of the contact circle at a link end", "chosen here"
    )
    """Not in the paper: between the roller (3.9 mm) and the plates (about 5 mm) of a half-inch chain."""
    half_width: float = _row("h", "m", 4e-3, 0.0, WIDTH, "half width of a link (tilting plane only)", "chosen here")
    """Not in the paper: a half-inch chain is about 8 mm wide over its pins."""

    def check_together(self) -> None:
        """See `Section`."""
        if not self.circle_radius < (half := self.link_length / 2):
            raise InputError(
                f"circle_radius: expected less than half a link, {half}, got {self.circle_radius}; use less"
            )

    @classmethod
    def quantities(cls) -> dict[str, Quantity]:
        """The parameter table: name of each field → its `Quantity`, in the order of declaration."""
        return {
            name: Quantity(meaning=field.description, **field.json_schema_extra)  # type: ignore
            for name, field in cls.model_fields.items()
        }

    def with_values(self, values: Mapping[str, object]) -> Self:
        """A copy with some values replaced, checked like any other set.

        Args:
            values: name or symbol, in ASCII or as printed → new value, in the units of the table.

        Raises:
            InputError: a name is unknown, a value is given twice, or the new set is not physical.
        """
        return validated(type(self), {**vars(self), **by_name(values, "parameters")}, "parameters")


_TABLE_1: Final = Parameters.model_validate({name: q.value for name, q in Parameters.quantities().items()})

PRESETS: Final[dict[str, Parameters]] = {
    "paper": _TABLE_1,
    "soft": _TABLE_1.model_copy(update={"joint_stiffness": 1e7, "joint_damping": 100.0, "friction_smoothing": 0.1}),
}
"""Named sets of parameters. `paper` is Table 1 as it is. `soft` has softer joints and a smoother joint
friction, which take far fewer steps with `reference`, not with `standard`; the paper found that these adjusted
values matter little, but they make another model."""


def preset(name: str) -> Parameters:
    """The parameters of a named preset.

    Raises:
        InputError: the name is unknown; the message lists the known ones.
    """
    if not isinstance(name, str) or name not in PRESETS:
        raise InputError(f"preset: unknown preset {shown(name)}; use one of {', '.join(PRESETS)}")
    return PRESETS[name]
