"""The model in plain NumPy, which shares nothing with the kernels."""
