"""A sweep, shown: figures, statistics and a page."""
