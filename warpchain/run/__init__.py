"""The library's three verbs: `walk`, `simulate` and `sweep`."""
