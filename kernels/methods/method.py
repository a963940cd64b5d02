"""Every method by the name that a user writes, with the facts that step loops and host need.

Every entry of :data:`TABLEAUS` is a method, and nothing else names it. ``hybrid`` takes one of them near contacts and
rigid joints between them.
"""

from dataclasses import dataclass

from warpchain.kernels.methods.explicit_tableaus import HYBRID, HYBRID_SPRINGS, TABLEAUS


@dataclass(frozen=True)
class Method:
    """One method.

    Attributes:
        name: What a user writes for ``method``.
        title: One line for help texts.
        tableau: Key in :data:`TABLEAUS` of its steps on springs.
        order: Order of the solution that is propagated.
        error_order: Order of the embedded solution; both set the controller's exponents.
        stages: Number of stages.
        reuses_last: Whether a step leaves the first stage of the next.
        has_rigid_flight: Whether joints are rigid between impulses.
    """

    name: str
    title: str
    tableau: str
    order: int
    error_order: int
    stages: int
    reuses_last: bool
    has_rigid_flight: bool

    @property
    def runs_on_gpus(self) -> bool:
        """Whether it has a GPU kernel. That of rigid flights was written, and saved no time."""
        return not self.has_rigid_flight

    @property
    def has_joint_forces(self) -> bool:
        """Whether a force stands in every joint at any time: rigid flights have no springs that could be read."""
        return not self.has_rigid_flight

    @property
    def can_tilt(self) -> bool:
        """Whether it carries chains whose plane tilts: rigid flights know nothing of the plane."""
        return not self.has_rigid_flight


def method_names() -> tuple[str, ...]:
    """Names of all methods."""
    return (*TABLEAUS, HYBRID)


def find_method(name: str) -> Method:
    """The method of this name.

    Raises:
        KeyError: There is none.
    """
    key = HYBRID_SPRINGS if name == HYBRID else name
    tableau = TABLEAUS[key]
    return Method(
        name=name,
        title=f"rigid joints between impulses, {key} around them" if name == HYBRID else tableau.title,
        tableau=key,
        order=tableau.order,
        error_order=tableau.error_order,
        stages=tableau.stages,
        reuses_last=tableau.first_same_as_last,
        has_rigid_flight=name == HYBRID,
    )
