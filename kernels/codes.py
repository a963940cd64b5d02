"""How a run ended, as kernels write it. A code is never renumbered or reused; a new one gets the next number."""

RUNNING = 0
AT_REST = 1
FINISHED = 2
TIME_LIMIT = 3
STEP_LIMIT = 4
STEP_TOO_SMALL = 5
NOT_FINITE = 6
NOT_STEADY = 7
LIST_OVERFLOW = 8
DISTANCE_LIMIT = 9
