"""`python -m warpchain` is the command `warpchain`."""

from warpchain.cli import main

main()
