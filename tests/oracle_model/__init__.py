"""The model in plain NumPy, written from its equations, for tests to compare with.

It shares no code with the kernels, so that it can show their errors, and it is not made to be fast.
"""
