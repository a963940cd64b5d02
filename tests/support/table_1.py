"""Table 1 of the paper, typed from it independently of the package."""

TABLE_1 = {
    "link_length": (1.268, 0.001, -2),
    "sprocket_radius": (5.56, 0.05, -2),
    "inner_mass": (3.700, 0.002, -3),
    "inner_inertia": (1.69, 0.01, -7),
    "outer_mass": (3.147, 0.002, -3),
    "outer_inertia": (1.292, 0.009, -7),
    "viscous_friction": (9, 1, -5),
    "coulomb_friction": (1.10, 0.09, -4),
    "floor_restitution": (0.018, 0.004, 0),
    "floor_friction": (0.27, 0.02, 0),
    "gravity": (9.809, 0, 0),
    "chain_restitution": (0.80, 0, 0),
    "chain_friction": (0.62, 0, 0),
    "joint_stiffness": (1, 0, 9),
    "joint_damping": (1, 0, 3),
    "friction_smoothing": (1, 0, -3),
    "tangential_restitution": (0, 0, 0),
    "sprocket_restitution": (0.01, 0, 0),
    "sprocket_friction": (0.99, 0, 0),
}
"""Mantissa, uncertainty, power of ten."""
UNCERTAIN = [name for name, (_, sigma, _) in TABLE_1.items() if sigma]
