"""One thread carries one chain. Never imports gpu/."""
