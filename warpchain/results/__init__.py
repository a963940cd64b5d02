"""Result objects of walks and sweeps, which users draw, save and repeat."""
