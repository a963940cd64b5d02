"""The stationary loop on the sprocket: its record before the release, its averages and their theory."""
