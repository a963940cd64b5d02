"""Chains on a device; only this subpackage launches kernels."""
