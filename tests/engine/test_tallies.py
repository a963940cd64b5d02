"""Names of tallies, and where kernels put them."""

import pytest

from warpchain.engine.tallies import COUNTS, EXTREMES, LOSSES
from warpchain.kernels import layout


@pytest.mark.parametrize(
    ("names", "rows"),
    [
        (
            COUNTS,
            {
                "accepted": layout.ACCEPTED,
                "rejected": layout.REJECTED,
                "floor": layout.FLOOR_IMPULSES,
                "sprocket": layout.SPROCKET_IMPULSES,
                "self": layout.SELF_IMPULSES,
                "bounces": layout.BOUNCES,
                "list_builds": layout.LIST_BUILDS,
            },
        ),
        (
            EXTREMES,
            {
                "opening": layout.OPENING,
                "floor": layout.FLOOR_DEPTH,
                "sprocket": layout.SPROCKET_DEPTH,
                "self": layout.SELF_DEPTH,
            },
        ),
        (
            LOSSES,
            {
                "joint_friction": layout.LOSS_FRICTION,
                "joint_damping": layout.LOSS_DAMPING,
                "floor": layout.LOSS_FLOOR,
                "sprocket": layout.LOSS_SPROCKET,
                "self_contact": layout.LOSS_SELF,
                "softening": layout.LOSS_SOFTENING,
                "joint_switch": layout.LOSS_JOINT_SWITCH,
            },
        ),
    ],
    ids=["counts", "extremes", "losses"],
)
def test_names_are_in_the_order_of_the_rows(names: dict[str, str], rows: dict[str, int]) -> None:
    """The n-th name is that of the row that the kernels call n, and there is a name for each row."""
    assert {name: place for place, name in enumerate(names)} == rows
