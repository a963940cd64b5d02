"""`python -m warpchain` is the command `warpchain`."""

from warpchain.cli.main import main

main()
