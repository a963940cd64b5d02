"""Every method by the name that a user writes, with the facts that step loops and host need.

Every entry of :data:`TABLEAUS` is a method; nothing else names it. ``hybrid`` has one near contacts, else rigid joints.
"""

from dataclasses import dataclass

from warpchain.kernels.methods.explicit_tableaus import HYBRID, HYBRID_SPRINGS, TABLEAUS, Tableau


@dataclass(frozen=True)
class Method:
    """One method. Rigid flights run on CPUs only, have no joint forces to be read, and keep planes fixed."""

    name: str  # what a user writes for ``method``
    title: str  # one line for help texts
    tableau: Tableau  # of its steps on springs
    has_rigid_flight: bool  # whether joints are rigid between impulses; a GPU kernel of them saved no time


def method_names() -> tuple[str, ...]:
    """Names of all methods."""
    return (*TABLEAUS, HYBRID)


def find_method(name: str) -> Method:
    """The method of this name; a ``KeyError`` if there is none."""
    if name != HYBRID:
        return Method(name, TABLEAUS[name].title, TABLEAUS[name], has_rigid_flight=False)
    title = f"rigid joints between impulses, {HYBRID_SPRINGS} around them"
    return Method(name, title, TABLEAUS[HYBRID_SPRINGS], has_rigid_flight=True)
