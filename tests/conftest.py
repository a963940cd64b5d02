"""How tests are spread over the cores of a machine, and how long hostile inputs are tried."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# Each core has a worker already, and threads of NumPy's linear algebra that wait for one another keep it busy: with two
# on a core, tests of posteriors took three times as long. NumPy reads this when it is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.support.command_line import command  # noqa: F401
from warpchain.engine.processors import processors

settings.register_profile("long", max_examples=5_000)  # of tests/test_fuzz.py: some minutes

MOST_WORKERS = 16
"""With more, each would mostly compile kernels that another compiles at the same time."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One worker per core for whole folders; tests that are picked by file or name run in this process, at once."""
    is_picked = config.option.keyword or not all(Path(argument).is_dir() for argument in config.args)
    return 0 if is_picked else min(processors(), MOST_WORKERS)
