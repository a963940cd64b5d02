"""`python -m warpchain` is the command `warpchain`."""

import sys
from typing import NoReturn

from warpchain.cli.interrupts import INTERRUPTED, ignore_interrupts


def run() -> NoReturn:
    """Run the command line and exit; Ctrl-C is heard from here on, also while libraries are imported."""
    try:
        from warpchain.cli.main import main

        main()
    except KeyboardInterrupt:
        ignore_interrupts()
        print("interrupted", file=sys.stderr)
        sys.exit(INTERRUPTED)
    finally:
        ignore_interrupts()


if __name__ == "__main__":
    run()
