"""Fields that users can set, with their checks, and their names in files and messages."""
