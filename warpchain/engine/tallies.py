"""Names and meanings of the counters that kernels keep per chain, in the order of `warpchain.kernels.layout`."""

from typing import Final

CONTACTS: Final = {
    "floor": "between links and floor",
    "sprocket": "between links and sprocket",
    "self": "between links of the chain",
}
"""Kinds of contact."""
IMPULSES: Final = {kind: f"number of impulses: {between}" for kind, between in CONTACTS.items()}
"""Impulses by kind of contact."""
DEPTHS: Final = {kind: f"largest penetration: {between}" for kind, between in CONTACTS.items()}
"""Greatest overlaps [m] by kind of contact."""
COUNTS: Final = {
    "accepted": "number of accepted steps in all phases",
    "rejected": "number of rejected steps in all phases",
    **IMPULSES,
    "bounces": "number of bounces off the floor",
    "list_builds": "number of times the neighbour list was built",
    "strands": "number of impulses between strands of the loop",
}
"""Counters."""
EXTREMES: Final = {"opening": "largest separation of two link ends that a joint connects", **DEPTHS}
"""Greatest lengths [m]."""
LOSSES: Final = {
    "joint_friction": "energy lost to joint friction, viscous and Coulomb",
    "joint_damping": "energy lost to the damping of the joint springs",
    "floor": "energy lost in impacts on the floor and on a sprocket that moves after the release",
    "sprocket": "energy lost in impacts on the sprocket",
    "self_contact": "energy lost in impacts between links",
    "softening": "spring energy removed by softening joints in the pile, minus that added while they stiffened",
    "joint_switch": "energy lost when joints switch from springs to rigid, minus that gained when they switch back",
}
"""Losses of energy [J], positive."""
LOST: Final = {name: meaning for name, meaning in LOSSES.items() if name != "sprocket"}
"""Losses [J] that a chain without sprocket can have."""
