"""The contact pass of one thread."""
