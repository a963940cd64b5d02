"""What happens at every sample mark: recording, release, rest, softening; and what a run tallies."""
