"""Test problems with known answers, and hard cases that break careless integrators."""
