"""Warp kernels of warpchain, installed as ``warpchain.kernels``.

Nothing here knows of files, options or people: arrays of structs go in, numbers come out. Every module imports
only ``warp`` and its siblings. The physics functions are scalar ``wp.func``s, so that a loop over links (CPU) and
one thread per link (GPU) can call the very same source.
"""

if __name__ != "warpchain.kernels":
    raise ImportError("import warpchain.kernels, not kernels: a second copy of every kernel would be built")
