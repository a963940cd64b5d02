"""What is done at every sample mark: record, release, rest, softening."""
