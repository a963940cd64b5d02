"""Hostile inputs of every kind end soon, in little memory, in the right result or in one printable line."""

import itertools
import json
import time
from collections import Counter
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings

from tests.support import watched_process
from tests.support.fuzzed_inputs import INPUTS
from tests.support.watched_process import WatchedProcess

pytestmark = pytest.mark.slow

EXAMPLES = 60
"""Inputs of each kind."""
FEWER = {"bytes of sweep.yaml": 5, "bytes of log.txt": 5, "shards run again": 30}
"""Inputs of kinds that take longer: most of them end in reading a whole sweep."""
BATCH = 200
"""Inputs between two looks at the clock, when a time is given."""
SEED = 20180601


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WatchedProcess]:
    """The process that takes the inputs."""
    process = WatchedProcess(tmp_path_factory.mktemp("fuzz"))
    yield process
    process.close()


@pytest.mark.parametrize("kind", INPUTS)
def test_hostile_inputs_end_well(
    watched: WatchedProcess, kind: str, request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]
) -> None:
    """Within 5 s and 500 MB: what undamaged input gives, or a line and exit status 2, 1 for damage."""
    minutes = request.config.getoption("fuzz_minutes")
    play, strategy = INPUTS[kind]
    counts: Counter[str] = Counter()
    failures: list[str] = []
    seconds = megabytes = 0.0

    def ask(hostile: object) -> None:
        nonlocal seconds, megabytes
        answer = watched.ask(play, hostile)
        seconds, megabytes = max(seconds, answer.seconds), max(megabytes, answer.megabytes)
        counts[answer.outcome] += 1
        if answer.problem is not None:
            failures.append(f"{answer.outcome}: {json.dumps([play, hostile])}\n{answer.problem}")
            if minutes:
                with capsys.disabled():
                    print(f"\n{failures[-1]}", flush=True)

    end = time.monotonic() + 60 * minutes / len(INPUTS)
    for number in itertools.count():
        limits = settings(
            max_examples=BATCH if minutes else FEWER.get(kind, EXAMPLES),
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        limits(seed(SEED + number)(given(strategy)(ask)))()
        if time.monotonic() > end:
            break
    if minutes:
        with capsys.disabled():
            outcomes = ", ".join(f"{name} {number}" for name, number in counts.most_common())
            print(f"\n{kind}: {counts.total()}; {outcomes}; at most {seconds:.2f} s, {megabytes:.0f} MB", flush=True)
    assert not failures, f"{len(failures)} of {counts.total()}\n" + "\n\n".join(failures[:3])


@pytest.mark.parametrize(
    ("given", "outcome", "words"),
    [
        ("__import__('time').sleep(60)", "hung", "no answer within 3 s"),
        ("__import__('os').abort()", "crashed", "Fatal Python error: Aborted"),
        ("sum(range(5 * 10**6))", "slow", "s of processor time"),
        ("b'x' * 6 * 10**8", "large", "MB"),
        ("1 / 0", "traceback", "ZeroDivisionError"),
        ("walk(links=3)", "exit 2", None),
    ],
)
def test_the_watched_process_is_watched(
    watched: WatchedProcess, monkeypatch: pytest.MonkeyPatch, given: str, outcome: str, words: str | None
) -> None:
    """What must not happen is told, and the next input finds a process that answers."""
    monkeypatch.setattr(watched_process, "PATIENCE", 3 if outcome == "hung" else 60)
    monkeypatch.setattr(watched_process, "SECONDS", 0.01 if outcome == "slow" else 5.0)
    answer = watched.ask("python", given)
    assert answer.outcome == outcome
    assert answer.problem is None if words is None else words in str(answer.problem)
