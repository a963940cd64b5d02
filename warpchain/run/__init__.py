"""The three main functions of the library: `walk`, `simulate` and `sweep`."""
