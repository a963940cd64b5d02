"""What a user may say: fields, their checks, and how files and errors name them."""
