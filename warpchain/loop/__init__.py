"""The stationary loop on the sprocket: its record before the release, averages, theory; waves along the chain."""
