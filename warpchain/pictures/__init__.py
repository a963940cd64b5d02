"""Figures and moving pictures of one walk; they know the shape of a walk, not its class."""
