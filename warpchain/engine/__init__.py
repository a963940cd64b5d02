"""Chains on a device. Nothing else launches kernels."""
