"""What a user types and sees: the command `warpchain`."""
