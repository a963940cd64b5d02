"""The contact pass of a block."""
