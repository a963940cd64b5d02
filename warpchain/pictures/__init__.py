"""Figures and animations of one walk, and figures of a quantity over a grid."""

import os
import sys
import warnings


def _import_despite_backend() -> None:
    """Import matplotlib, also where MPLBACKEND names a backend that it does not know: figures here need none.

    Nothing is imported where the variable is not set, where a notebook has set it, or where matplotlib is there.
    """
    given = os.environ.get("MPLBACKEND", "")
    if not given or given.startswith("module://") or "matplotlib" in sys.modules:
        return
    del os.environ["MPLBACKEND"]
    import matplotlib

    try:
        matplotlib.rcParams["backend"] = given  # as matplotlib does itself
        os.environ["MPLBACKEND"] = given
    except ValueError:
        from warpchain.inputs.validation import InputWarning, shown

        problem = f"{shown(given)} is not a backend of matplotlib"
        warnings.warn(f"MPLBACKEND: {problem}; figures are drawn without it", InputWarning, stacklevel=2)


_import_despite_backend()
