"""The stationary loop on the sprocket: its record before the release, and averages."""
