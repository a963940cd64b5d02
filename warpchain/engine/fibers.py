"""Streams for a device without streams: work is deferred until the host waits for it.

What the host reads too early is then missing, as it would be on a GPU.
"""

from collections import deque
from collections.abc import Callable
from typing import Any

QUESTIONS = 3
"""An event is reached when the host has asked so often whether it is, as if the device had come so far by then."""


class HeldStream:
    """Work in its order, done up to an event as soon as that is waited for; named as in `warp.Stream`."""

    def __init__(self) -> None:
        """Begin without work."""
        self._held: deque[Callable[[], Any]] = deque()
        self.done = 0  # pieces of work

    def hold(self, work: Callable[[], Any]) -> None:
        """Add work."""
        self._held.append(work)

    def record_event(self) -> "HeldEvent":
        """An event after the work so far."""
        return HeldEvent(self, self.done + len(self._held))

    def wait_event(self, event: "HeldEvent") -> None:
        """Let later work wait for an event of another stream."""
        self.hold(event.reach)

    def wait_stream(self, other: "HeldStream") -> None:
        """Let later work wait for the work of another stream so far."""
        self.wait_event(other.record_event())

    def advance(self, count: int) -> None:
        """Do the first pieces of work, so many in all, if they are not done yet."""
        while self.done < count:
            self.done += 1
            self._held.popleft()()


class HeldEvent:
    """A place in the work of a stream."""

    def __init__(self, stream: HeldStream, count: int) -> None:
        """The place after the first ``count`` pieces of work."""
        self._stream, self._count, self._asked = stream, count, 0

    @property
    def is_complete(self) -> bool:
        """Whether the stream has come so far."""
        self._asked += 1
        if self._asked == QUESTIONS:
            self.reach()
        return self._stream.done >= self._count

    def reach(self) -> None:
        """Do the work before this place."""
        self._stream.advance(self._count)
