"""Parameters for the reference in NumPy: equations that are not stiff, and contacts worked by hand."""

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
UNIT = preset("paper").with_values(
    {
        "link_length": 2.0,
        "circle_radius": 0.5,
        **dict.fromkeys(["inner_mass", "outer_mass", "inner_inertia", "outer_inertia"], 1.0),
        **dict.fromkeys(["floor_restitution", "sprocket_restitution", "chain_restitution"], 0.0),
        **dict.fromkeys(["floor_friction", "sprocket_friction", "chain_friction"], 1.0),
    }
)
"""Links of 2 m, 1 kg and 1 kg m², circles of 0.5 m, e = 0 and μ = 1: for contacts worked by hand."""
