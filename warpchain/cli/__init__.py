"""The command line `warpchain`: commands, options and output."""
