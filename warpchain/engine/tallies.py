"""What a kernel tallies of each chain: names and meanings, in the order of the rows of `warpchain.kernels.layout`."""

from typing import Final

CONTACTS: Final = {
    "floor": "between links and floor",
    "sprocket": "between links and sprocket",
    "self": "between links of the chain",
}
"""Kinds of contact."""
IMPULSES: Final = {kind: f"number of impulses: {between}" for kind, between in CONTACTS.items()}
"""Impulses by kind of contact."""
DEPTHS: Final = {kind: f"greatest overlap: {between}" for kind, between in CONTACTS.items()}
"""Greatest overlaps [m] by kind of contact."""
COUNTS: Final = {
    "accepted": "accepted steps, all phases",
    "rejected": "rejected steps, all phases",
    **IMPULSES,
    "bounces": "number of bounces off the floor",
    "list_builds": "number of neighbour lists built",
    "strands": "number of impulses between strands of the loop",
}
"""Counters."""
EXTREMES: Final = {"opening": "greatest distance between two joined link ends", **DEPTHS}
"""Greatest lengths [m]."""
LOSSES: Final = {
    "joint_friction": "energy lost to joint friction, viscous and Coulomb",
    "joint_damping": "energy lost to the damping of the joint springs",
    "floor": "energy lost in impacts on the floor, and to a sprocket that moves after the release",
    "sprocket": "energy lost in impacts on the sprocket",
    "self_contact": "energy lost in impacts of links on one another",
    "softening": "energy taken out of joint springs by softening them in the pile, less that put in after the release",
    "joint_switch": "energy lost where joints go from springs to rigid, less that gained where they go back",
}
"""Losses of energy [J], positive."""
LOST: Final = {name: meaning for name, meaning in LOSSES.items() if name != "sprocket"}
"""Losses [J] that a chain without sprocket can have."""
