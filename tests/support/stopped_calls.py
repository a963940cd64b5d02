"""Calls that are stopped between two changes of the disk, as by a kill."""

import os
from collections.abc import Callable
from typing import Any

import pytest


class _Kill(BaseException):
    """Stands for a kill between two system calls."""


def is_stopped(act: Callable[[], object], changes: int, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Call a function, stopped before the next change of the disk after so many; whether there was one."""
    left = changes

    def counted(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **settings: Any) -> Any:
            nonlocal left
            left -= 1
            if left < 0:
                raise _Kill
            return real(*arguments, **settings)

        return call

    with monkeypatch.context() as patched:
        for name in ("replace", "rename", "mkdir", "unlink", "rmdir"):
            patched.setattr(os, name, counted(getattr(os, name)))
        try:
            act()
        except _Kill:
            return True
    return False
