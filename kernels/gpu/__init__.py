"""One block of threads carries one chain, one thread a link. Never imports cpu/."""
