"""Contacts, shared by cpu/ and gpu/: the impulse law and what may touch."""
