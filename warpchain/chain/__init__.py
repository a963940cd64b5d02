"""Definitions of chains and walks: checked setups, states, floors and start shapes; no device is needed."""
