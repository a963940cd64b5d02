"""Parameters that make no stiff equations, for the reference in NumPy."""

from warpchain.inputs.parameters import preset

MILD = preset("paper").with_values(
    {
        "joint_stiffness": 1e5,
        "joint_damping": 0.5,
        "friction_smoothing": 5.0,
        "viscous_friction": 9e-4,
        "coulomb_friction": 1e-3,
    }
)
"""Soft and dissipative: every term of the equations matters within milliseconds."""
SILENT = MILD.with_values({"joint_damping": 0.0, "viscous_friction": 0.0, "coulomb_friction": 0.0})
"""MILD without dissipation."""
