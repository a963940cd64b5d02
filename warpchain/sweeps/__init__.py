"""Definition of a sweep: its file, grid, samples, walks and recorded motions."""
