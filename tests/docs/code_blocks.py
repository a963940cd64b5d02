"""Reads the code blocks of README, docs/ and studies/, with the comments that say which are not run.

A block is not run if an HTML comment stands on the line before it: `<!-- not run: needs a GPU -->`. The reasons that
count are those of `REASONS`.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[2]
PAGES: Final = [ROOT / "README.md", *sorted((*ROOT.glob("docs/**/*.md"), *ROOT.glob("studies/**/*.md")))]

REASONS: Final = (
    "needs a GPU",
    "needs a cluster",
    "takes minutes",
    "sets up an environment",
    "needs your video",
    "runs until Ctrl-C",
)
"""Why a block may not be run."""

_FENCE: Final = re.compile(
    r"^(?:<!-- not run: (?P<reason>[^>]+?) -->\n+)?```(?P<language>\S*)\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL
)
_INLINE: Final = re.compile(r"`([^`]+)`")


@dataclass(frozen=True)
class CodeBlock:
    """A fenced block of a page; `reason` says why it is not run, None if it is."""

    language: str
    code: str
    reason: str | None

    @property
    def is_run(self) -> bool:
        """Whether it is code that nothing keeps from being run."""
        return self.reason is None and self.language in ("python", "sh")


def code_blocks(page: Path) -> list[CodeBlock]:
    """The fenced blocks of a page, in order."""
    found = _FENCE.finditer(page.read_text(encoding="utf-8"))
    return [CodeBlock(match["language"], match["code"], match["reason"]) for match in found]


def inline_code(page: Path) -> list[str]:
    """Code in the sentences and tables of a page, each on one line."""
    text = _FENCE.sub("", page.read_text(encoding="utf-8"))
    return [" ".join(match[1].split()) for match in _INLINE.finditer(text)]


def name_of(page: Path) -> str:
    """A page's path in the repository."""
    return page.relative_to(ROOT).as_posix()
