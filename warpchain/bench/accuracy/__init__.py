"""`warpchain bench accuracy`: error against cost, whole walks, ensembles, and a page with all of it."""
