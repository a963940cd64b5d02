"""The contact pass on a GPU."""
