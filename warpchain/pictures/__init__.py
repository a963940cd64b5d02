"""Figures and moving pictures of one walk, and of a quantity over a grid: they draw what `walks` knows."""
