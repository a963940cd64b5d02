"""`python -m warpchain` is the command `warpchain`."""

import gc
import os
import sys
from typing import NoReturn

from warpchain.cli.interrupts import INTERRUPTED, ignore_interrupts


def run() -> NoReturn:
    """Run the command line and exit; Ctrl-C is heard from here on, also while libraries are imported."""
    gc.set_threshold(50_000)  # imports leave many objects: a search for cycles after every 700 takes 0.1 s in all
    try:
        _open_closed_outputs()
        from warpchain.cli.main import main

        main()
    except KeyboardInterrupt:
        ignore_interrupts()
        print("interrupted", file=sys.stderr)
        sys.exit(INTERRUPTED)
    finally:
        ignore_interrupts()


def _open_closed_outputs() -> None:
    """Let what was closed before the start (`2>&-`) lead nowhere, instead of to the next file that is opened."""
    for number, name in ((1, "stdout"), (2, "stderr")):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            try:
                os.fstat(number)
            except OSError:  # it is free
                os.dup2(nowhere, number)
            os.set_inheritable(nowhere, True)
            setattr(sys, name, os.fdopen(nowhere, "w"))


if __name__ == "__main__":
    run()
