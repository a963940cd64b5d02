"""What a chain and its walk are: a checked setup, what follows from it, states, floors, start shapes."""
