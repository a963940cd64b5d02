"""Possible values of `method`: integrators, and solver profiles, i.e. integrators with settings.

The integrators are those of `warpchain.kernels`. Nothing heavy is imported here, because help texts need the names.
"""

from collections.abc import Mapping
from typing import Final

from warpchain.kernels.methods.method import find_method, method_names

METHODS: Final[Mapping[str, str]] = {name: find_method(name).title for name in method_names()}
"""Integrators, each described in a few words."""

BURST_TOLERANCE: Final = 1e-4
"""Default of `hybrid`: its bursts are of order 3, and at 1e-6 slower than `rkf78`.

1e-3 is enough for ensembles of walks and takes half the time, but without any dissipation energy drifts.
"""

_LOOSE: Final = {"tolerance": 3e-3, "soft_tolerance": 2e-2, "skin": 3e-3, "controller": "pi"}
_SOFTENED: Final = {"soften_pile": True, "soften_drive": True}
METHODS_BY_NEED: Final[Mapping[str, Mapping[str, object]]] = {
    "standard": {"method": "hybrid", **_LOOSE, **_SOFTENED},
    "explicit": {"method": "os32", **_LOOSE, **_SOFTENED},
    "reference": {"method": "rkf78", "tolerance": 1e-6},
}
"""One word for an integrator and its settings.

The means of `standard` and `explicit` lie within some tenths of a per cent of those at tight tolerances. `standard`
is the cheapest on a CPU. It means `explicit` where there is no `hybrid`, on a GPU and if the plane of the chain tilts,
and if joint forces are recorded, which `hybrid` does not have.
"""


def meant_by(method: object, *, can_be_rigid: bool) -> object:
    """The method that a word means where rigid flights are possible, or where they are not: `standard` differs."""
    is_standard = isinstance(method, str) and method == "standard"  # it is not checked yet
    return "explicit" if is_standard and not can_be_rigid else method
