"""Table 1 with its stiff joints, and with soft ones."""

from warpchain.inputs.parameters import preset

PAPER, SOFT = preset("paper"), preset("soft")
