"""Every method by the name that a user writes, with the facts that step loops and host need.

Every entry of :data:`TABLEAUS` and :data:`ROSENBROCK_TABLES` is a method, and nothing else names it. ``hybrid`` takes
an explicit method near contacts and rigid joints between them.
"""

from dataclasses import dataclass
from typing import Literal

from warpchain.kernels.methods.explicit_tableaus import HYBRID, HYBRID_SPRINGS, TABLEAUS
from warpchain.kernels.methods.rosenbrock_tableaus import ROSENBROCK_TABLES


@dataclass(frozen=True)
class Method:
    """One method.

    Attributes:
        name: What a user writes for ``method``.
        title: One line for help texts.
        kind: Kind of its steps on springs.
        tableau: Key of its coefficients in the table of that kind.
        order: Order of the solution that is propagated.
        error_order: Order of the embedded solution; both set the controller's exponents.
        stages: Number of stages.
        reuses_last: Whether a step leaves the first stage of the next.
        has_rigid_flight: Whether joints are rigid between impulses.
    """

    name: str
    title: str
    kind: Literal["explicit", "rosenbrock"]
    tableau: str
    order: int
    error_order: int
    stages: int
    reuses_last: bool
    has_rigid_flight: bool = False

    @property
    def runs_on_gpus(self) -> bool:
        """Whether it has a GPU kernel. Those of implicit steps and rigid flights were written, and saved no time."""
        return self.kind == "explicit" and not self.has_rigid_flight

    @property
    def has_joint_forces(self) -> bool:
        """Whether a force stands in every joint at any time: rigid flights have no springs that could be read."""
        return not self.has_rigid_flight

    @property
    def can_tilt(self) -> bool:
        """Whether it carries chains whose plane tilts: implicit steps and rigid flights know nothing of the plane."""
        return self.kind == "explicit" and not self.has_rigid_flight


def method_names() -> tuple[str, ...]:
    """Names of all methods."""
    return (*TABLEAUS, *ROSENBROCK_TABLES, HYBRID)


def find_method(name: str) -> Method:
    """The method of this name.

    Raises:
        KeyError: There is none.
    """
    key = HYBRID_SPRINGS if name == HYBRID else name
    if key in TABLEAUS:
        tableau = TABLEAUS[key]
        return Method(
            name=name,
            title=f"rigid joints between impulses, {key} around them" if name == HYBRID else tableau.title,
            kind="explicit",
            tableau=key,
            order=tableau.order,
            error_order=tableau.error_order,
            stages=tableau.stages,
            reuses_last=tableau.first_same_as_last,
            has_rigid_flight=name == HYBRID,
        )
    table = ROSENBROCK_TABLES[key]
    return Method(
        name=name,
        title=table.title,
        kind="rosenbrock",
        tableau=key,
        order=table.order,
        error_order=table.error_order,
        stages=table.stages,
        reuses_last=False,
    )
