"""Warp kernels of warpchain, installed as ``warpchain.kernels``.

Arrays of structs go in, numbers come out; nothing here knows of files or options. Every module imports only ``warp``
and its siblings. The physics functions are scalar ``wp.func``s, so that a loop over links (CPU) and one thread per link
(GPU) call the same source.
"""

if __name__ != "warpchain.kernels":
    raise ImportError("import warpchain.kernels, not kernels: a second copy of every kernel would be built")
