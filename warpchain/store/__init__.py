"""What a sweep leaves on disk, and reads back."""
