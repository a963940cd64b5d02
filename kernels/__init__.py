"""Warp kernels of warpchain, installed as ``warpchain.kernels``.

Arrays of structs go in, numbers come out; nothing here knows of files or options. Every module imports only ``warp``
and its siblings. Physics is in scalar ``wp.func``s, which a loop over links (CPU) and one thread per link (GPU) share.
"""

if __name__ != "warpchain.kernels":
    raise ImportError("import warpchain.kernels, not kernels: a second copy of every kernel would be built")
