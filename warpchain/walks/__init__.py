"""Runs walks on the chains of a batch and reduces them to numbers."""
