"""The contact pass on a CPU."""
