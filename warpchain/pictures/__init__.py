"""Figures and moving pictures of one walk; of a quantity over a grid; they draw numbers of `walks`, and know no result."""
