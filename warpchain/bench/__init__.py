"""The measurements of ``warpchain bench``: steps and errors of the methods, and walks a second."""
