"""Rigid joints, vectorised over eight segments of the loop."""
