"""A child process that takes inputs over a pipe, is watched while it does, and is replaced when it dies or hangs."""

import json
import os
import select
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PATIENCE = 30.0
"""Time [s] without an answer after which the child is killed: the limit of `SECONDS` on a machine that others use."""
SECONDS = 5.0
"""Most processor time [s] of an input."""
MEGABYTES = 500.0
"""Most memory [MB] that the child ever has, with Python and all libraries."""


@dataclass(frozen=True)
class Answer:
    """What became of an input.

    Attributes:
        outcome: in a word or two.
        problem: what must not have happened, and did; None if all is well.
        seconds: processor time.
        megabytes: most memory of the process meanwhile.
    """

    outcome: str
    problem: str | None
    seconds: float = 0.0
    megabytes: float = 0.0


class WatchedProcess:
    """Asks `tests.support.fuzzed_process`, which it starts when it has none."""

    def __init__(self, scratch: Path) -> None:
        """Have a folder for the files of the child."""
        self.scratch, self._child, self._started = scratch, None, 0
        self._buffer = b""

    def ask(self, kind: str, given: Any) -> Answer:
        """What becomes of an input of a kind; given is anything that JSON can say."""
        child = self._child = self._child or self._start()
        assert child.stdin is not None
        child.stdin.write(json.dumps([kind, given]).encode() + b"\n")
        child.stdin.flush()
        line = self._line(PATIENCE)
        if line is None:
            outcome, problem = "crashed", f"died with exit status {child.poll()}"
            if child.poll() is None:
                outcome, problem = "hung", f"no answer within {PATIENCE} s"
                child.send_signal(signal.SIGABRT)  # Python then says where it is
            self._end()
            said = (self.scratch / f"stderr-{self._started}").read_text(errors="replace")
            return Answer(outcome, f"{problem}\n{said}")
        answer = Answer(**json.loads(line))
        if answer.problem is None and answer.seconds > SECONDS:
            problem = f"{answer.outcome} after {answer.seconds:.1f} s of processor time"
            answer = replace(answer, outcome="slow", problem=problem)
        if answer.problem is None and answer.megabytes > MEGABYTES:
            answer = replace(answer, outcome="large", problem=f"{answer.outcome} with {answer.megabytes:.0f} MB")
        if answer.problem is not None:
            self._end()  # whatever is wrong in this process is not to be blamed on the next input
        return answer

    def _start(self) -> "subprocess.Popen[bytes]":
        """A child that is ready."""
        self._started += 1
        self._buffer = b""
        folder = self.scratch / f"child-{self._started}"
        folder.mkdir()
        with (self.scratch / f"stderr-{self._started}").open("wb") as stderr:
            self._child = subprocess.Popen(
                [sys.executable, "-m", "tests.support.fuzzed_process", folder],
                cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr,
            )  # fmt: skip
        assert self._line(300.0) == b"ready", (self.scratch / f"stderr-{self._started}").read_text()
        return self._child

    def _line(self, patience: float) -> bytes | None:
        """The next line from the child; None if it ends or takes too long."""
        assert self._child is not None and self._child.stdout is not None
        pipe, end = self._child.stdout.fileno(), time.monotonic() + patience
        while b"\n" not in self._buffer:
            if not select.select([pipe], [], [], max(0.0, end - time.monotonic()))[0]:
                return None
            part = os.read(pipe, 2**16)
            if not part:
                self._child.wait()
                return None
            self._buffer += part
        line, _, self._buffer = self._buffer.partition(b"\n")
        return line

    def _end(self) -> None:
        """Have no child any more."""
        if self._child is None:
            return
        child, self._child = self._child, None
        try:
            child.wait(0.5)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        for pipe in (child.stdin, child.stdout):
            if pipe is not None:
                pipe.close()

    def close(self) -> None:
        """End the child."""
        if self._child is not None:
            self._child.kill()
            self._end()
