"""How tests are spread over the cores of a machine."""

from pathlib import Path

import pytest

from warpchain.engine.processors import processors

MOST_WORKERS = 16
"""With more, each would mostly compile kernels that another compiles at the same time."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """One worker per core for whole folders; tests that are picked by file or name run in this process, at once."""
    is_picked = config.option.keyword or not all(Path(argument).is_dir() for argument in config.args)
    return 0 if is_picked else min(processors(), MOST_WORKERS)


def pytest_addoption(parser: pytest.Parser) -> None:
    """How long hostile inputs are tried."""
    parser.addoption(
        "--fuzz-minutes",
        type=float,
        default=0.0,
        metavar="MINUTES",
        help="time of tests/test_fuzz.py, which else takes a fixed number of inputs; counts and failures are printed",
    )
