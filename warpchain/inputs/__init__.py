"""What a user may say: checked once, at the door."""
