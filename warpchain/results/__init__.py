"""What a user gets back: one walk, a sweep, and what they draw, save and run again."""
