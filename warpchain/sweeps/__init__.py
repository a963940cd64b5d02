"""What a sweep is: its file, its walks, and what it keeps of them."""
