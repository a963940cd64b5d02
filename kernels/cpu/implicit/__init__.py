"""Rigid joints and Rosenbrock methods, vectorised over eight segments of the loop."""
